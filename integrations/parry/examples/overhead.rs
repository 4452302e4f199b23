//! The time that a question takes by parry's traits beside that of nearmiss alone, in nanoseconds:
//! `cargo run --release -p nearmiss-parry --example overhead`.

#![expect(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "a program may print and read the clock"
)]

use std::hint::black_box;
use std::time::Instant;

use nearmiss::geometry::PointCloud;
use nearmiss::{BuildOptions, CollideOptions, Detail, Pose, Ray, Scan, Scratch, Shape, ShapePlan, Target};
use nearmiss_parry::{ScanDispatcher, ScanShape};
use nearmiss_testdata::dragon::{Dragon, dragon_mesh};
use parry3d::math::{Pose as ParryPose, Vector};
use parry3d::query::{DefaultQueryDispatcher, QueryDispatcher as _, Ray as ParryRay, RayCast as _};
use parry3d::shape::Ball;

/// Places that are asked about in one pass.
const PLACES: u16 = 4096;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let dragon = dragon_mesh(Dragon::Points23k)?;
    let scan =
        Scan::build(&PointCloud::from_positions(dragon.vertices())?, &BuildOptions::default())?.with_shapes();
    let options = CollideOptions::estimated().with_detail(Detail::Verdict);
    let plan = ShapePlan::new(&options, &scan)?;
    let target = Target::new(scan.at(&Pose::IDENTITY), &plan);
    let shape = ScanShape::new(scan.clone())?;
    let dispatcher = ScanDispatcher.chain(DefaultQueryDispatcher);
    let mut scratch = Scratch::default();

    // Places beside points of the scan, so that about half of the balls touch.
    let every = scan.len() / usize::from(PLACES);
    let places: Vec<[f32; 3]> = (0..usize::from(PLACES))
        .map(|i| {
            let p = scan.at(&Pose::IDENTITY).point(i * every);
            #[expect(clippy::cast_possible_truncation, reason = "parry computes in single precision")]
            p.map(|c| c as f32 + 0.004)
        })
        .collect();
    let ball = Ball::new(0.007);
    println!("| question | nearmiss, ns | by parry, ns | more, ns |\n| --- | --: | --: | --: |");
    let row = |name: &str, ours: f64, theirs: f64| {
        println!("| {name} | {ours:.0} | {theirs:.0} | {:.0} |", theirs - ours);
    };
    let ours = best(&places, |&centre| {
        let solid = Shape::Sphere { centre: centre.map(f64::from), radius: f64::from(0.007_f32) };
        target.touch(&solid, &mut scratch).verdict.is_touching()
    });
    let theirs = best(&places, |&centre| {
        let pose = ParryPose::from_translation(Vector::from_array(centre));
        dispatcher.intersection_test(&pose, &shape, &ball).is_ok_and(|it| it.intersecting)
    });
    row("ball touches", ours, theirs);
    let ours = best(&places, |&origin| {
        let ray = Ray::new(origin.map(f64::from), [0.0, 1.0, 0.0]);
        target.cast(&ray, &mut scratch).hit.is_some()
    });
    let theirs = best(&places, |&origin| {
        let ray = ParryRay::new(Vector::from_array(origin), Vector::Y);
        shape.cast_local_ray(&ray, f32::MAX, true).is_some()
    });
    row("ray", ours, theirs);
    Ok(())
}

/// The least mean time of a question over some passes, in nanoseconds.
fn best(places: &[[f32; 3]], mut ask: impl FnMut(&[f32; 3]) -> bool) -> f64 {
    let mut least = f64::INFINITY;
    for _ in 0..15 {
        let clock = Instant::now();
        for place in places {
            black_box(ask(black_box(place)));
        }
        least = least.min(clock.elapsed().as_secs_f64() * 1e9 / f64::from(PLACES));
    }
    least
}
