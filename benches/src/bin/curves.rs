//! What the curves of pairs of objects cost: all of them, at the default spacing and at others.
//!
//! `curves OBJECT OBJECT … [--shift X] [--passes N]`: pairs of objects, each scaled to a longest side of 2, the second of a pair
//! shifted along x by X of that, turned a little.
#![expect(clippy::print_stdout, reason = "a program for people")]

use nearmiss::{
    Budget, BuildOptions, CollideOptions, CollidePlan, CollideScratch, Contacts, CurveOptions, CurvePlan,
    CurveScratch, Curves, Detail, Evidence, Order, Pose, Scan, collide_all, curves_with,
};
use nearmiss_benches::arguments::Arguments;
use nearmiss_benches::clock::{nanoseconds, timed};
use nearmiss_benches::object::Object;
use nearmiss_benches::{Failure, machine};

/// Spacings, in lesser sampling radii.
const SPACINGS: [f64; 4] = [8.0, 2.0, 1.0, 0.25];

fn main() -> Result<(), Failure> {
    let mut arguments = Arguments::of_process();
    let shift: f64 = arguments.value("--shift")?.unwrap_or(0.25);
    let passes: u32 = arguments.value("--passes")?.unwrap_or(20);
    let objects = arguments.words()?;
    if objects.is_empty() || objects.len() % 2 == 1 {
        return Err("usage: curves OBJECT OBJECT … [--shift X] [--passes N]".into());
    }
    println!("{}", machine::description());
    println!("b turned by 0.7 about (1, 2, 3) and shifted by {shift} along x; least of {passes} passes\n");
    println!(
        "| a, b | r | spacing, r | hits | curves | closed | points | length, r | max residual, r | evaluations | contacts, ms | \
         all, ms |\n| --- |{}",
        " --: |".repeat(11)
    );
    let scans = objects
        .iter()
        .map(|source| {
            let object = Object::read(source)?.scaled()?;
            Ok((object.name.clone(), Scan::build(&object.cloud, &BuildOptions::default())?))
        })
        .collect::<Result<Vec<_>, Failure>>()?;
    let pose = Pose::from_axis_angle([1.0, 2.0, 3.0], 0.7).with_translation([shift, 0.0, 0.0]);
    for pair in scans.chunks_exact(2) {
        let [(name_a, a), (name_b, b)] = pair else { continue };
        let r = a.sampling_radius().min(b.sampling_radius());
        let views = [a.at(&Pose::IDENTITY), b.at(&pose)];
        let options = CollideOptions::default()
            .with_detail(Detail::Verdict)
            .with_evidence(Evidence::Estimated)
            .with_order(Order::DepthFirst);
        let plan = CollidePlan::new(&options, a, b)?;
        let (mut contacts, mut scratch) = (Contacts::default(), CollideScratch::default());
        let contact_time = least(passes, || {
            collide_all(&views[0], &views[1], &plan, &Budget::UNLIMITED, &mut contacts, &mut scratch);
        });
        for spacing in SPACINGS {
            let plan = CurvePlan::new(&CurveOptions::default().with_spacing(spacing * r), a, b)?;
            let (mut found, mut scratch) = (Curves::default(), CurveScratch::default());
            let time = least(passes, || {
                curves_with(&views[0], &views[1], &plan, &Budget::UNLIMITED, &mut found, &mut scratch);
            });
            println!(
                "| {name_a}, {name_b} | {r:.5} | {spacing} | {} | {} | {} | {} | {:.1} | {:.1e} | {} | {:.3} | {:.3} |",
                contacts.contacts.len(),
                found.curves.len(),
                found.closed(),
                found.points.len(),
                found.length() / r,
                found.max_residual / r,
                found.statistics.evaluations,
                contact_time,
                time,
            );
        }
    }
    Ok(())
}

/// The least time of some passes, in milliseconds.
fn least(passes: u32, mut work: impl FnMut()) -> f64 {
    (0..passes).map(|_| nanoseconds(timed(&mut work).1) / 1e6).fold(f64::INFINITY, f64::min)
}
