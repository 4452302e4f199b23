//! Decided and certified shares on real scans: an object at random poses in a room, a LiDAR frame,
//! a façade.
//!
//! The object is placed at random within the scan's bounds; by default it is 1/25 of the scan's
//! diagonal long. The truth is the exact distance of the nearest two points, and lengths are given in
//! local spacings ([`nearmiss_benches::in_scan`]). Each pose is queried once for a certified verdict
//! and once for the distance, in separate passes.

use std::hint::black_box;

use nearmiss::{
    BuildOptions, CollideOptions, CollidePlan, Detail, DistanceOptions, DistancePlan, Evidence, Pair,
    PairHint, Pose, Scan, Scratch,
};
use nearmiss_benches::clock::{nanoseconds, timed};
use nearmiss_benches::in_scan::{FAR, Score, Truth, truths};
use nearmiss_benches::object::Object;
use nearmiss_benches::sample::{Sample, count};
use nearmiss_benches::{Failure, machine};
use nearmiss_testdata::arbitrary::{rng, unit_vector};

#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Scans that the object is placed in
    #[arg(required = true, value_name = "SCAN")]
    scans: Vec<String>,
    /// The object to place in the scans
    #[arg(long, value_name = "OBJECT", default_value = "bumpy:4000")]
    object: String,
    /// The longest side that the object is scaled to; by default a 25th of the scan's diagonal
    #[arg(long, value_name = "S")]
    size: Option<f64>,
    /// Poses of the object
    #[arg(long, value_name = "N", default_value_t = 150)]
    poses: usize,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// The reach that the scan is built with; by default it is estimated
    #[arg(long, value_name = "L")]
    reach: Option<f64>,
    /// The length of a hinted step
    #[arg(long, value_name = "L", default_value_t = 0.001)]
    step: f64,
    /// Hinted steps from each pose
    #[arg(long, value_name = "N", default_value_t = 200)]
    steps: usize,
    /// List the poses with uncertified separations, loose bounds or distant contacts
    #[arg(long)]
    listed: bool,
}

pub(crate) fn run(options: &Options) -> Result<(), Failure> {
    println!("{}\n", machine::description());
    println!(
        "| scan | points | r | reach | on sheets | poses ≥ 6 spacings | certified | `lower` ≥ half the truth | \
         `lower` above it | `upper` above it | contacts | furthest contact, spacings | µs a verdict, far: mean, p99 | \
         µs a distance: mean, p99 | asked again: mean | ns a hinted step |"
    );
    println!("|{}", " --- |".repeat(16));
    options.scans.iter().try_for_each(|scan| measure(scan, options))
}

fn measure(source: &str, options: &Options) -> Result<(), Failure> {
    let object = Object::read(source)?;
    let body = Object::read(&options.object)?;
    let build = BuildOptions::default();
    let build = options.reach.map_or(build, |reach| build.with_reach(reach));
    let (a, b) = (Scan::build(&object.cloud, &build)?, Scan::build(&body.cloud, &BuildOptions::default())?);
    let truths = truths(&object.cloud, &body.cloud, options.size, (options.poses, options.seed))?;

    let mut score = Score::default();
    let far = verdicts([&a, &b], &truths, options, &mut score)?;
    let plan = DistancePlan::new(&DistanceOptions::default(), &a, &b)?;
    let mut scratch = Scratch::default();
    let (mut distances, mut again) = (Sample::default(), Sample::default());
    for (i, truth) in truths.iter().enumerate() {
        let (va, vb) = (a.at(&Pose::IDENTITY), b.at(&truth.pose));
        let mut ask = || timed(|| black_box(Pair::new(va, *black_box(&vb)).distance(&plan, &mut scratch)));
        let (found, time) = ask();
        distances.push(nanoseconds(time));
        // A planner queries nearly the same pose again, so its data is in the cache.
        again.push((0..2).map(|_| nanoseconds(ask().1)).fold(f64::INFINITY, f64::min));
        let fault = score.distance(truth, &found).filter(|_| options.listed);
        fault.iter().for_each(|fault| println!("pose {i}: {fault}"));
    }
    let hinted = hinted_step(&a, &b, &truths, options)?;

    let share = |of: usize| 100.0 * count(of) / count(score.far.max(1));
    let (far, distances, again) = (far.summary(), distances.summary(), again.summary());
    println!(
        "| {} | {} | {:.4} | {:.4} | {:.1} % | {} | {:.1} % | {:.1} % | {} | {} | {} | {:.2} | {:.1}, {:.0} | {:.0}, {:.0} | {:.0} | {:.0} |",
        object.name,
        object.cloud.len(),
        object.r,
        a.reach(),
        100.0 * a.sheet_share(),
        score.far,
        share(score.certified),
        share(score.at_least_half),
        score.lower_above,
        score.upper_above,
        score.contacts,
        score.furthest_contact,
        far.mean / 1e3,
        far.p99 / 1e3,
        distances.mean / 1e3,
        distances.p99 / 1e3,
        again.mean / 1e3,
        hinted,
    );
    Ok(())
}

/// Queries the verdict of every pose; returns the times of the poses far from contact.
fn verdicts(
    [a, b]: [&Scan; 2],
    truths: &[Truth],
    options: &Options,
    score: &mut Score,
) -> Result<Sample, Failure> {
    let asked = CollideOptions::estimated().with_evidence(Evidence::Certified);
    let plan = CollidePlan::new(&asked, a, b)?;
    let (mut scratch, mut far) = (Scratch::default(), Sample::default());
    for (i, truth) in truths.iter().enumerate() {
        let (va, vb) = (a.at(&Pose::IDENTITY), b.at(&truth.pose));
        let (answer, time) = timed(|| black_box(Pair::new(va, *black_box(&vb)).collide(&plan, &mut scratch)));
        let fault = score.verdict(truth, &answer).filter(|_| options.listed);
        fault.iter().for_each(|fault| println!("pose {i}: {fault}"));
        if truth.is_far() {
            far.push(nanoseconds(time));
        }
    }
    Ok(far)
}

/// The mean time of a hinted query while the object moves in steps of `--step` from the clear
/// poses.
fn hinted_step(a: &Scan, b: &Scan, truths: &[Truth], options: &Options) -> Result<f64, Failure> {
    let asked = CollideOptions::estimated().with_evidence(Evidence::Certified).with_detail(Detail::Verdict);
    let plan = CollidePlan::new(&asked, a, b)?;
    let (mut scratch, mut all) = (Scratch::default(), Sample::default());
    let rng = &mut rng(options.seed ^ 1);
    for truth in truths.iter().filter(|truth| truth.is_far()).take(50) {
        let way = unit_vector(rng);
        let (mut hint, mut pose) = (PairHint::default(), truth.pose);
        let from: [f64; 3] = pose.translation();
        let most = truth.distance - FAR * truth.spacing;
        for step in 0..options.steps {
            // Back and forth, so that the object stays clear.
            let far = options.step * count(step);
            let along = if most > 0.0 { most - (far % (2.0 * most) - most).abs() } else { 0.0 };
            pose = pose.with_translation([0, 1, 2].map(|k| from[k] + way[k] * along));
            let (va, vb) = (a.at(&Pose::IDENTITY), b.at(&pose));
            let (_, time) =
                timed(|| black_box(Pair::new(va, vb).hinted(&mut hint).collide(&plan, &mut scratch)));
            if step > 1 {
                all.push(nanoseconds(time));
            }
        }
    }
    Ok(all.summary().mean)
}
