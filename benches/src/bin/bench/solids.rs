//! Convex shapes and rays against the surface of a scan, and rivals with the same shapes: nanoseconds
//! per query, each shape queried once per pass.
//!
//! Positions are drawn in the bounding box, or at most 3 r from a point. Touches are first order, with
//! estimated and with certified separations; contacts and rays are first order. The rivals are parry on
//! the mesh, if there is one, and a plain grid and kiddo on the points, for spheres. Rays hit or miss.

use std::hint::black_box;
use std::ops::ControlFlow;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nearmiss::{
    BatchScratch, BuildOptions, CollideOptions, Detail, Pose, Ray, Scan, Scratch, Shape, ShapePlan, Target,
    each,
};
use nearmiss_benches::clock::{nanoseconds, timed};
use nearmiss_benches::object::Object;
use nearmiss_benches::rivals::grid::Grid;
use nearmiss_benches::rivals::solids::{Manifolds, TriMeshTarget};
use nearmiss_benches::sample::count;
use nearmiss_benches::{Failure, machine};
use nearmiss_testdata::arbitrary::{point_in, rng, rotation, unit_vector};
use rand::RngExt;

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Objects to measure: files, `dragon-5k`, `dragon-23k` or `bumpy:POINTS`
    #[arg(required = true, value_name = "OBJECT")]
    objects: Vec<String>,
    /// Shapes of each kind per set
    #[arg(long, value_name = "N", default_value_t = 100_000)]
    count: usize,
    /// Passes; the least time counts
    #[arg(long, value_name = "N", default_value_t = 5)]
    passes: u32,
    /// The radius of a shape, in r
    #[arg(long, value_name = "R", default_value_t = 1.0)]
    radius: f64,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    println!("{}", machine::description());
    for source in &arguments.objects {
        let object = Object::read(source)?.scaled()?;
        measure(&object, arguments)?;
    }
    Ok(())
}

/// The rivals.
struct Rivals {
    grid: Grid,
    tree: ImmutableKdTree<f32, 3>,
    mesh: Option<TriMeshTarget>,
}

impl Rivals {
    fn new(object: &Object, radius: f64) -> Result<Self, Failure> {
        let points: Vec<[f32; 3]> = (0..object.cloud.len()).map(|i| single(object.cloud.point(i))).collect();
        let tree = ImmutableKdTree::<f32, 3>::new_from_slice(&points).map_err(|e| format!("{e:?}"))?;
        let mesh = object.mesh.as_ref().map(TriMeshTarget::new).transpose()?;
        Ok(Self { grid: Grid::new(&points, single([radius; 3])[0]), tree, mesh })
    }

    /// Nanoseconds of parry's touch, distance and contacts, of the grid and of kiddo for these shapes; `-`
    /// if a rival has no such question.
    fn told(&self, shapes: &[Shape<'_>], passes: u32) -> [String; 5] {
        let told = |(time, _): (f64, usize)| format!("{:.0}", time / count(shapes.len()));
        let none = || "-".to_string();
        let [touch, distance, contacts] = self.mesh.as_ref().map_or_else(
            || [none(), none(), none()],
            |mesh| {
                let all = || shapes.iter();
                let mut working = Manifolds::default();
                [
                    told(least(passes, || all().filter(|&s| mesh.touches(black_box(s))).count())),
                    told(least(passes, || all().filter(|&s| mesh.distance(black_box(s)) > 0.0).count())),
                    told(least(passes, || all().map(|s| mesh.contacts(black_box(s), &mut working)).sum())),
                ]
            },
        );
        let balls: Vec<([f32; 3], f32)> = shapes
            .iter()
            .filter_map(|shape| match *shape {
                Shape::Sphere { centre, radius } => Some((single(centre), single([radius; 3])[0])),
                _ => None,
            })
            .collect();
        if balls.is_empty() {
            return [touch, distance, contacts, none(), none()];
        }
        let by_grid =
            least(passes, || balls.iter().filter(|&&(c, r)| self.grid.any_within(black_box(c), r)).count());
        let by_tree = least(passes, || {
            let within = |&&(c, r): &&([f32; 3], f32)| {
                let query = self.tree.query(black_box(&c)).within::<SquaredEuclidean<f32>>(r * r);
                query.unsorted().iter().next().is_some()
            };
            balls.iter().filter(within).count()
        });
        [touch, distance, contacts, told(by_grid), told(by_tree)]
    }
}

#[expect(clippy::cast_possible_truncation, reason = "the rivals are single precision")]
fn single(p: [f64; 3]) -> [f32; 3] {
    p.map(|c| c as f32)
}

fn measure(object: &Object, arguments: &Arguments) -> Result<(), Failure> {
    let &Arguments { count: number, passes, radius, seed, .. } = arguments;
    let radius = radius * object.r;
    let scan = Scan::build(&object.cloud, &BuildOptions::default())?.with_shapes();
    let plan = |options: CollideOptions| ShapePlan::new(&options.with_detail(Detail::Verdict), &scan);
    let (estimated, certified) = (plan(CollideOptions::estimated())?, plan(CollideOptions::default())?);
    let [estimated, certified] =
        [estimated, certified].map(|plan| Target::new(scan.at(&Pose::IDENTITY), &plan));
    let rivals = Rivals::new(object, radius)?;
    println!(
        "## {}: {} points, r {:.5}, radius {} r\n",
        object.name,
        object.cloud.len(),
        object.r,
        arguments.radius
    );
    println!(
        "| ns a query, least of {passes} passes | touch | certified | distance | contacts | parry: touch | distance | contacts | grid | kiddo | touching |"
    );
    println!("| --- |{}", " --: |".repeat(10));
    let targets = [&estimated, &certified];
    for (name, away) in [("in the bounding box", None), ("up to 3 r off", Some(3.0))] {
        let drawn = draw(object, (number, radius, seed), away);
        for (kind, shapes) in [
            ("sphere", &drawn.spheres),
            ("capsule", &drawn.capsules),
            ("box", &drawn.boxes),
            ("cylinder", &drawn.cylinders),
        ] {
            let ours = of_shapes(targets, shapes, passes);
            let [touch, proven, distance, manifold, hits] = ours.map(|x| x / count(number));
            let [mesh, apart, met, grid, tree] = rivals.told(shapes, passes);
            println!(
                "| {kind}, {name} | {touch:.0} | {proven:.0} | {distance:.0} | {manifold:.0} | {mesh} | {apart} | {met} | {grid} | {tree} | {hits:.3} |",
            );
        }
        let mut scratch = Scratch::default();
        let (hits, misses): (Vec<Ray>, Vec<Ray>) =
            drawn.rays.iter().partition(|ray| estimated.cast(ray, &mut scratch).hit.is_some());
        for (kind, rays) in [("ray that hits", hits), ("ray that misses", misses)] {
            let mut of = |target: &Target<'_>| {
                least(passes, || {
                    rays.iter().filter(|&r| target.cast(black_box(r), &mut scratch).hit.is_some()).count()
                })
                .0 / count(rays.len())
            };
            let (ours, proven) = (of(&estimated), of(&certified));
            let mesh = rivals.mesh.as_ref().map_or_else(
                || "-".to_string(),
                |mesh| {
                    let (time, _) =
                        least(passes, || rays.iter().filter(|&r| mesh.is_hit(black_box(r))).count());
                    format!("{:.0}", time / count(rays.len()))
                },
            );
            println!("| {kind}, {name} | {ours:.0} | {proven:.0} | | | {mesh} | | | | | {} |", rays.len());
        }
    }
    let spheres = draw(object, (number, radius, seed), Some(3.0)).spheres;
    println!(
        "\nSpheres up to 3 r off, on two threads: {:.2} times as fast.\n",
        speedup(&estimated, &spheres)?
    );
    Ok(())
}

/// The times of all shapes, in nanoseconds: touch, certified, distance, contacts; and the number that
/// touch.
fn of_shapes([estimated, certified]: [&Target<'_>; 2], shapes: &[Shape<'_>], passes: u32) -> [f64; 5] {
    let (mut scratch, mut contacts) = (Scratch::default(), Vec::new());
    let (touch, hits) = least(passes, || {
        shapes.iter().filter(|&s| estimated.touch(black_box(s), &mut scratch).verdict.is_touching()).count()
    });
    let (proven, _) = least(passes, || {
        shapes.iter().filter(|&s| certified.touch(black_box(s), &mut scratch).verdict.is_separated()).count()
    });
    let (distance, _) = least(passes, || {
        let all = shapes.iter();
        all.filter(|&s| certified.distance(black_box(s), f64::INFINITY, &mut scratch).is_some()).count()
    });
    let (manifold, _) = least(passes, || {
        let found = shapes.iter().map(|s| {
            estimated.contacts(black_box(s), &mut contacts, &mut scratch);
            contacts.len()
        });
        found.sum()
    });
    [touch, proven, distance, manifold, count(hits)]
}

/// The time of one thread over that of two, for a batch.
fn speedup(target: &Target<'_>, shapes: &[Shape<'_>]) -> Result<f64, Failure> {
    let time = |threads: usize| -> Result<f64, Failure> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        let (mut answers, mut scratch) = (vec![false; shapes.len()], BatchScratch::default());
        let (best, _) = least(5, || {
            pool.install(|| {
                each(&mut answers, None, &mut scratch, |i, scratch| {
                    ControlFlow::Continue(target.touch(&shapes[i], scratch).verdict.is_touching())
                })
            })
        });
        Ok(best)
    };
    Ok(time(1)? / time(2)?)
}

/// Shapes and rays at the same positions.
struct Drawn {
    spheres: Vec<Shape<'static>>,
    capsules: Vec<Shape<'static>>,
    boxes: Vec<Shape<'static>>,
    cylinders: Vec<Shape<'static>>,
    rays: Vec<Ray>,
}

/// Draws positions at most `away` r from a point or, without `away`, in the bounding box.
fn draw(object: &Object, (number, radius, seed): (usize, f64, u64), away: Option<f64>) -> Drawn {
    let rng = &mut rng(seed);
    let bounds = object.cloud.bounds();
    let mut drawn =
        Drawn { spheres: vec![], capsules: vec![], boxes: vec![], cylinders: vec![], rays: vec![] };
    for _ in 0..number {
        let centre = match away {
            None => [0, 1, 2].map(|k| rng.random_range(bounds.min[k]..bounds.max[k])),
            Some(away) => {
                let p = object.cloud.point(rng.random_range(0..object.cloud.len()));
                let d = point_in(rng, away * object.r);
                [0, 1, 2].map(|k| p[k] + d[k])
            }
        };
        let along = unit_vector(rng);
        let end = [0, 1, 2].map(|k| centre[k] + 4.0 * radius * along[k]);
        drawn.spheres.push(Shape::Sphere { centre, radius });
        drawn.capsules.push(Shape::Capsule { ends: [centre, end], radius });
        let pose = rotation(rng).with_translation(centre);
        drawn.boxes.push(Shape::Box { pose, half: [2.0 * radius, radius, 0.5 * radius], radius: 0.0 });
        drawn.cylinders.push(Shape::Cylinder { pose, half_height: 2.0 * radius, radius, rounding: 0.0 });
        drawn.rays.push(Ray::new([0, 1, 2].map(|k| centre[k] - 3.0 * along[k]), along));
    }
    drawn
}

/// The least time of several passes, and the count of the last one.
fn least(passes: u32, mut pass: impl FnMut() -> usize) -> (f64, usize) {
    let mut best = (f64::INFINITY, 0);
    for _ in 0..passes {
        let (found, time) = timed(&mut pass);
        best = (best.0.min(nanoseconds(time)), black_box(found));
    }
    best
}
