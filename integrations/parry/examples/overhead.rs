//! The time that a question takes by parry's traits beside that of nearmiss alone, with a target at hand
//! and with one made for the question, in nanoseconds:
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
    println!("| question | of a target, ns | of a scan at a pose, ns | by parry, ns | more, ns |");
    println!("| --- | --: | --: | --: | --: |");
    let row = |name: &str, [ready, ours, theirs]: [f64; 3]| {
        println!("| {name} | {ready:.0} | {ours:.0} | {theirs:.0} | {:.0} |", theirs - ours);
    };
    let sphere =
        |centre: &[f32; 3]| Shape::Sphere { centre: centre.map(f64::from), radius: f64::from(0.007_f32) };
    let ready = best(&places, |centre| target.touch(&sphere(centre), &mut scratch).verdict.is_touching());
    // A question of parry makes the target, as it has no place to keep one.
    let made = || Target::new(scan.at(black_box(&Pose::IDENTITY)), black_box(&plan));
    let ours = best(&places, |centre| made().touch(&sphere(centre), &mut scratch).verdict.is_touching());
    let theirs = best(&places, |&centre| {
        let pose = ParryPose::from_translation(Vector::from_array(centre));
        dispatcher.intersection_test(&pose, &shape, &ball).is_ok_and(|it| it.intersecting)
    });
    row("ball touches", [ready, ours, theirs]);
    let up = |origin: &[f32; 3]| Ray::new(origin.map(f64::from), [0.0, 1.0, 0.0]);
    let ready = best(&places, |origin| target.cast(&up(origin), &mut scratch).hit.is_some());
    let ours = best(&places, |origin| made().cast(&up(origin), &mut scratch).hit.is_some());
    let theirs = best(&places, |&origin| {
        let ray = ParryRay::new(Vector::from_array(origin), Vector::Y);
        shape.cast_local_ray(&ray, f32::MAX, true).is_some()
    });
    row("ray", [ready, ours, theirs]);
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
