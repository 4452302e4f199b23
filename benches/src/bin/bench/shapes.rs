//! Spheres, capsules and boxes against the points of a scan: nanoseconds per query of ours and of
//! the rivals, with the same shapes, each queried once per pass.
//!
//! There are three sets of shapes, whose radius is a multiple of r: positions drawn in the bounding
//! box, at most 3 r from a surface point, and at most 10 r. The rivals are a plain grid whose cells
//! have the sphere's radius, and kiddo's search for a point within the radius.

use std::hint::black_box;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nearmiss::{BuildOptions, Pose, Scan, Shape, ShapeIndex};
use nearmiss_benches::clock::{nanoseconds, timed};
use nearmiss_benches::object::Object;
use nearmiss_benches::rivals::grid::Grid;
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
    #[arg(long, value_name = "N", default_value_t = 200_000)]
    count: usize,
    /// Passes; the least time counts
    #[arg(long, value_name = "N", default_value_t = 7)]
    passes: u32,
    /// The radius of a shape, in r
    #[arg(long, value_name = "R", default_value_t = 1.0)]
    radius: f64,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let &Arguments { ref objects, count, passes, radius, seed } = arguments;
    println!("{}", machine::description());
    for source in objects {
        let object = Object::read(source)?.scaled()?;
        measure(&object, (count, passes, radius * object.r, seed))?;
    }
    Ok(())
}

fn measure(object: &Object, (number, passes, radius, seed): (usize, u32, f64, u64)) -> Result<(), Failure> {
    let scan = Scan::build(&object.cloud, &BuildOptions::default())?;
    let (index, made) = timed(|| ShapeIndex::new(&scan));
    let placed = scan.at(&Pose::IDENTITY).with_shapes(&index);
    #[expect(clippy::cast_possible_truncation, reason = "the rivals are single precision")]
    let single = |p: [f64; 3]| p.map(|c| c as f32);
    let points: Vec<[f32; 3]> = (0..object.cloud.len()).map(|i| single(object.cloud.point(i))).collect();
    let (grid, grid_made) = timed(|| Grid::new(&points, single([radius; 3])[0]));
    let (tree, tree_made) = timed(|| ImmutableKdTree::<f32, 3>::new_from_slice(&points));
    let tree = tree.map_err(|e| format!("{e:?}"))?;
    println!(
        "## {}: {} points, r {:.5}, radius {:.2} r; made in: ours {made:.2?}, grid {grid_made:.2?}, kiddo {tree_made:.2?}\n",
        object.name,
        object.cloud.len(),
        object.r,
        radius / object.r,
    );
    println!(
        "| ns a query, least of {passes} passes | sphere | batch of spheres | capsule | box | grid, sphere | kiddo, sphere | touching |"
    );
    println!("| --- |{}", " --: |".repeat(7));
    for (name, away) in
        [("in the bounding box", None), ("up to 3 r off", Some(3.0)), ("up to 10 r off", Some(10.0))]
    {
        let Drawn { centres, spheres, capsules, boxes } = draw(object, (number, radius, seed), away);
        let singles: Vec<[f32; 3]> = centres.iter().map(|&c| single(c)).collect();
        let [reach] = [single([radius; 3])[0]];
        let one_by_one = |shapes: &[Shape<'_>]| {
            least(passes, || shapes.iter().filter(|s| placed.touches(black_box(s))).count())
        };
        let mut answers = vec![false; number];
        let (sphere, hits) = one_by_one(&spheres);
        let (batch, hits_of_batch) = least(passes, || {
            placed.touch_each(&spheres, &mut answers);
            answers.iter().filter(|&&hit| hit).count()
        });
        let (by_grid, hits_of_grid) =
            least(passes, || singles.iter().filter(|&&c| grid.any_within(black_box(c), reach)).count());
        let (by_kiddo, _) = least(passes, || {
            let within = |c: &&[f32; 3]| {
                let query = tree.query(black_box(*c)).within::<SquaredEuclidean<f32>>(reach * reach);
                query.unsorted().iter().next().is_some()
            };
            singles.iter().filter(within).count()
        });
        if hits != hits_of_batch || hits.abs_diff(hits_of_grid) > number / 10_000 {
            return Err(format!("{hits} hits, in a batch {hits_of_batch}, by the grid {hits_of_grid}").into());
        }
        println!(
            "| {name} | {:.1} | {:.1} | {:.1} | {:.1} | {:.1} | {:.1} | {:.3} |",
            sphere / count(number),
            batch / count(number),
            one_by_one(&capsules).0 / count(number),
            one_by_one(&boxes).0 / count(number),
            by_grid / count(number),
            by_kiddo / count(number),
            count(hits) / count(number),
        );
    }
    println!();
    Ok(())
}

/// Shapes of each kind at the same positions.
struct Drawn {
    centres: Vec<[f64; 3]>,
    spheres: Vec<Shape<'static>>,
    capsules: Vec<Shape<'static>>,
    boxes: Vec<Shape<'static>>,
}

/// Draws positions at most `away` r from a point or, without `away`, in the bounding box.
fn draw(object: &Object, (number, radius, seed): (usize, f64, u64), away: Option<f64>) -> Drawn {
    let rng = &mut rng(seed);
    let bounds = object.cloud.bounds();
    let centres: Vec<[f64; 3]> = (0..number)
        .map(|_| match away {
            None => [0, 1, 2].map(|k| rng.random_range(bounds.min[k]..bounds.max[k])),
            Some(away) => {
                let p = object.cloud.point(rng.random_range(0..object.cloud.len()));
                let d = point_in(rng, away * object.r);
                [0, 1, 2].map(|k| p[k] + d[k])
            }
        })
        .collect();
    let spheres: Vec<Shape<'_>> = centres.iter().map(|&centre| Shape::Sphere { centre, radius }).collect();
    let capsules: Vec<Shape<'_>> = centres
        .iter()
        .map(|&from| {
            let along = unit_vector(rng).map(|x| x * 4.0 * radius);
            Shape::Capsule { ends: [from, [0, 1, 2].map(|k| from[k] + along[k])], radius }
        })
        .collect();
    let boxes: Vec<Shape<'_>> = centres
        .iter()
        .map(|&centre| Shape::Box {
            pose: rotation(rng).with_translation(centre),
            half: [2.0 * radius, radius, 0.5 * radius],
            radius: 0.0,
        })
        .collect();
    Drawn { centres, spheres, capsules, boxes }
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
