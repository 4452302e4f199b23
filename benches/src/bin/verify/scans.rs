//! Evidence and bounds in scans of rooms: an object at random poses, against the exact distances of
//! the points.
//!
//! The check fails if a bound does not hold, if a contact is further than a local spacing from the
//! nearest points, or if fewer than 95 % of the separations of at least six local spacings are
//! certified, or fewer than 95 % of the lower bounds there are at least half of the distance.

use nearmiss::{
    BuildOptions, CollideOptions, CollidePlan, DistanceOptions, DistancePlan, Pair, Pose, Scan, Scratch,
};
use nearmiss_benches::Failure;
use nearmiss_benches::in_scan::{Score, truths};
use nearmiss_benches::object::Object;

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Scans that the object is placed in
    #[arg(required = true, value_name = "SCAN")]
    scans: Vec<String>,
    /// The object to place in the scans
    #[arg(long, value_name = "OBJECT", default_value = "bumpy:4000")]
    object: String,
    /// Poses of the object
    #[arg(long, value_name = "N", default_value_t = 150)]
    poses: usize,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

/// Returns `true` if the check passes.
pub(crate) fn run(arguments: &Arguments) -> Result<bool, Failure> {
    let body = Object::read(&arguments.object)?;
    let small = Scan::build(&body.cloud, &BuildOptions::default())?;
    let mut is_clean = true;
    for source in &arguments.scans {
        let object = Object::read(source)?;
        let scan = Scan::build(&object.cloud, &BuildOptions::default())?;
        let truths = truths(&object.cloud, &body.cloud, None, (arguments.poses, arguments.seed))?;
        let collide = CollidePlan::new(&CollideOptions::default(), &scan, &small)?;
        let distance = DistancePlan::new(&DistanceOptions::default(), &scan, &small)?;
        let (mut score, mut scratch) = (Score::default(), Scratch::default());
        for (i, truth) in truths.iter().enumerate() {
            let pair = || Pair::new(scan.at(&Pose::IDENTITY), small.at(&truth.pose));
            let answer = pair().collide(&collide, &mut scratch);
            let bounds = pair().distance(&distance, &mut scratch);
            let faults = [score.verdict(truth, &answer), score.distance(truth, &bounds)];
            faults.iter().flatten().for_each(|fault| println!("pose {i}: {fault}"));
        }
        let Score { far, certified, at_least_half, contacts, furthest_contact, .. } = score;
        println!(
            "{}: {} points, {:.1} % on sheets; of {} poses {far} are at least 6 spacings away, {certified} of these \
             certified apart, {at_least_half} with a lower bound of at least half the distance; {contacts} contacts, at \
             most {furthest_contact:.2} spacings off",
            object.name,
            object.cloud.len(),
            100.0 * scan.sheet_share(),
            truths.len(),
        );
        is_clean &= score.is_clean();
    }
    Ok(is_clean)
}
