//! Convex shapes and rays against the surface of a scan: nanoseconds per query, with the same shapes,
//! each queried once per pass.
//!
//! Positions are drawn in the bounding box, or at most 3 r from a point. Touches are first order, with
//! estimated and with certified separations; contacts and rays are first order.

use std::hint::black_box;

use nearmiss::{BuildOptions, CollideOptions, Detail, Pose, Ray, Scan, Scratch, Shape, ShapePlan, Target};
use nearmiss_benches::clock::{nanoseconds, timed};
use nearmiss_benches::object::Object;
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

fn measure(object: &Object, arguments: &Arguments) -> Result<(), Failure> {
    let &Arguments { count: number, passes, radius, seed, .. } = arguments;
    let scan = Scan::build(&object.cloud, &BuildOptions::default())?;
    let plan = |options: CollideOptions| ShapePlan::new(&options.with_detail(Detail::Verdict), &scan);
    let (estimated, certified) = (plan(CollideOptions::estimated())?, plan(CollideOptions::default())?);
    let [estimated, certified] =
        [estimated, certified].map(|plan| Target::new(scan.at(&Pose::IDENTITY), &plan));
    println!("## {}: {} points, r {:.5}, radius {radius} r\n", object.name, object.cloud.len(), object.r);
    println!("| ns a query, least of {passes} passes | touch | certified | distance | contacts | touching |");
    println!("| --- |{}", " --: |".repeat(5));
    let mut scratch = Scratch::default();
    let mut contacts = Vec::new();
    for (name, away) in [("in the bounding box", None), ("up to 3 r off", Some(3.0))] {
        let drawn = draw(object, (number, radius * object.r, seed), away);
        for (kind, shapes) in
            [("sphere", &drawn.spheres), ("capsule", &drawn.capsules), ("box", &drawn.boxes)]
        {
            let (touch, hits) = least(passes, || {
                shapes
                    .iter()
                    .filter(|&s| estimated.touch(black_box(s), &mut scratch).verdict.is_touching())
                    .count()
            });
            let (proven, _) = least(passes, || {
                shapes
                    .iter()
                    .filter(|&s| certified.touch(black_box(s), &mut scratch).verdict.is_separated())
                    .count()
            });
            let (distance, _) = least(passes, || {
                let all = shapes.iter();
                all.filter(|&s| certified.distance(black_box(s), f64::INFINITY, &mut scratch).is_some())
                    .count()
            });
            let (manifold, _) = least(passes, || {
                let found = shapes.iter().map(|s| {
                    estimated.contacts(black_box(s), &mut contacts, &mut scratch);
                    contacts.len()
                });
                found.sum()
            });
            let n = count(number);
            println!(
                "| {kind}, {name} | {:.0} | {:.0} | {:.0} | {:.0} | {:.3} |",
                touch / n,
                proven / n,
                distance / n,
                manifold / n,
                count(hits) / n,
            );
        }
        let (cast, hits) = least(passes, || {
            drawn
                .rays
                .iter()
                .filter(|&ray| estimated.cast(black_box(ray), &mut scratch).hit.is_some())
                .count()
        });
        println!("| ray, {name} | {:.0} | | | | {:.3} |", cast / count(number), count(hits) / count(number));
    }
    println!();
    Ok(())
}

/// Shapes and rays at the same positions.
struct Drawn {
    spheres: Vec<Shape<'static>>,
    capsules: Vec<Shape<'static>>,
    boxes: Vec<Shape<'static>>,
    rays: Vec<Ray>,
}

/// Draws positions at most `away` r from a point or, without `away`, in the bounding box.
fn draw(object: &Object, (number, radius, seed): (usize, f64, u64), away: Option<f64>) -> Drawn {
    let rng = &mut rng(seed);
    let bounds = object.cloud.bounds();
    let mut drawn = Drawn { spheres: vec![], capsules: vec![], boxes: vec![], rays: vec![] };
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
