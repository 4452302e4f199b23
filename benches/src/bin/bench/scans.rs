//! Decided and certified shares on real scans: an object at random poses in a room, a LiDAR frame,
//! a façade.
//!
//! The object is placed at random within the scan's bounds; by default it is 1/25 of the scan's
//! diagonal long. The truth is the exact distance of the nearest two points. Lengths are given in
//! *local spacings*. The local spacing is the greater of the distances from either of these two
//! points to its sixth distinct neighbour in its own scan, times the scale of the pose. Each pose
//! is queried once for a certified verdict and once for the distance, in separate passes.

use std::hint::black_box;

use nearmiss::{
    BuildOptions, CollideOptions, CollidePlan, Detail, Distance, DistanceOptions, DistancePlan, Evidence,
    Pair, PairHint, PointCloud, Pose, Scan, Scratch, Verdict,
};
use nearmiss_benches::clock::{nanoseconds, timed};
use nearmiss_benches::object::Object;
use nearmiss_benches::rivals::kiddo::PointScan;
use nearmiss_benches::sample::{Sample, count};
use nearmiss_benches::scorer::spacings;
use nearmiss_benches::{Failure, machine};
use nearmiss_testdata::arbitrary::{rng, rotation, unit_vector};
use rand::RngExt;

/// Separations of at least this many local spacings should be certified.
const FAR: f64 = 6.0;

/// The object's longest side over the scan's diagonal.
const SHARE: f64 = 0.04;

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

/// The truth about a pose, by brute force.
struct Truth {
    pose: Pose,
    /// Distance of the nearest two points.
    distance: f64,
    /// The local spacing at these points.
    spacing: f64,
}

#[derive(Default)]
struct Score {
    far: usize,
    certified: usize,
    at_least_half: usize,
    lower_above: usize,
    upper_above: usize,
    contacts: usize,
    furthest_contact: f64,
}

fn measure(source: &str, options: &Options) -> Result<(), Failure> {
    let object = Object::read(source)?;
    let body = Object::read(&options.object)?;
    let half = object.cloud.bounds().half_extents();
    let diagonal = 2.0 * half.iter().map(|x| x * x).sum::<f64>().sqrt();
    let size = options.size.unwrap_or(SHARE * diagonal);
    let longest = 2.0 * body.cloud.bounds().half_extents().into_iter().fold(0.0, f64::max);
    let scale = size / longest;

    let build = BuildOptions::default();
    let build = options.reach.map_or(build, |reach| build.with_reach(reach));
    let (a, b) = (Scan::build(&object.cloud, &build)?, Scan::build(&body.cloud, &BuildOptions::default())?);
    let truths = truths(&object.cloud, &body.cloud, scale, options)?;

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
        count_distance(&found, truth, &mut score);
        if options.listed && truth.distance >= FAR * truth.spacing && found.lower < 0.5 * truth.distance {
            let Distance { lower, upper, .. } = found;
            println!("pose {i}: {lower} to {upper}, truth {}", truth.distance);
        }
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
        let is_far = truth.distance >= FAR * truth.spacing;
        match answer.verdict {
            Verdict::Separated { evidence, gap } => {
                if gap > truth.distance {
                    println!("pose {i}: a gap of {gap}, but points {} apart", truth.distance);
                }
                let is_certified = evidence == Evidence::Certified;
                score.certified += usize::from(is_far && is_certified);
                if options.listed && is_far && !is_certified {
                    println!("pose {i}: {:.1} spacings apart, not certified", truth.distance / truth.spacing);
                }
            }
            Verdict::Intersecting { .. } => {
                score.contacts += 1;
                let off = truth.distance / truth.spacing;
                score.furthest_contact = score.furthest_contact.max(off);
                if options.listed && off > 1.0 {
                    println!("pose {i}: a contact {off:.2} spacings from the nearest points");
                }
            }
            Verdict::Undecided(reason) => println!("pose {i}: {reason:?}"),
        }
        if is_far {
            score.far += 1;
            far.push(nanoseconds(time));
        }
    }
    Ok(far)
}

fn count_distance(found: &Distance, truth: &Truth, score: &mut Score) {
    let is_far = truth.distance >= FAR * truth.spacing;
    // Both sides round the same positions to single precision once.
    let rounding = 1e-6 * truth.distance + 1e-6 * truth.spacing;
    score.at_least_half += usize::from(is_far && found.lower >= 0.5 * truth.distance);
    score.lower_above += usize::from(found.lower > truth.distance + rounding);
    score.upper_above += usize::from(found.upper > truth.distance + rounding);
}

/// Random poses of the object with the exact distances of the points.
fn truths(
    scan: &PointCloud,
    body: &PointCloud,
    scale: f64,
    options: &Options,
) -> Result<Vec<Truth>, Failure> {
    let (spacings_a, spacings_b) = (spacings(scan)?, spacings(body)?);
    let tree = PointScan::new(scan, f64::INFINITY)?;
    let centre = body.bounds().centre();
    let (bounds, rng) = (scan.bounds(), &mut rng(options.seed));
    let truths = (0..options.poses).map(|_| {
        let to =
            [0, 1, 2].map(|k| bounds.min[k] + (bounds.max[k] - bounds.min[k]) * rng.random_range(0.0..1.0));
        let turned = rotation(rng).with_scale(scale);
        let from = turned.apply(centre);
        let pose = turned.with_translation([0, 1, 2].map(|k| to[k] - from[k]));
        let (distance, i, j) = tree.nearest_pair(body, &pose);
        Truth { pose, distance, spacing: spacings_a[i].max(spacings_b[j] * scale) }
    });
    Ok(truths.collect())
}

/// The mean time of a hinted query while the object moves in steps of `--step` from the clear
/// poses.
fn hinted_step(a: &Scan, b: &Scan, truths: &[Truth], options: &Options) -> Result<f64, Failure> {
    let asked = CollideOptions::estimated().with_evidence(Evidence::Certified).with_detail(Detail::Verdict);
    let plan = CollidePlan::new(&asked, a, b)?;
    let (mut scratch, mut all) = (Scratch::default(), Sample::default());
    let rng = &mut rng(options.seed ^ 1);
    for truth in truths.iter().filter(|truth| truth.distance >= FAR * truth.spacing).take(50) {
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
