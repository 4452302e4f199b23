//! A thousand people, as capsules, walk on a scanned floor at 60 steps a second: how long does a step
//! take on one core?
//!
//! `cargo run --release -p nearmiss --example crowd [SCAN [HEIGHT [COUNT]]]`, z up
//!
//! Each capsule falls and walks ahead, and is pushed out along the normals of its contacts. Some times a
//! second it looks ahead by a ray, and turns where there is no floor. Where it is blocked it turns, too.
#![expect(clippy::print_stdout, clippy::disallowed_methods, reason = "a program for people, with a clock")]

use std::error::Error;
use std::f64::consts::TAU;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use nearmiss::{
    BuildOptions, CollideOptions, Detail, PointCloud, Pose, Ray, Scan, Scratch, Shape, ShapeHint, ShapePlan,
    Target,
};
use nearmiss_testdata::arbitrary::rng;
use rand::{Rng, RngExt};

const STEPS: u32 = 600;
const STEP: f64 = 1.0 / 60.0;
const SPEED: f64 = 1.4;
const GRAVITY: f64 = 9.81;

/// Steps between two looks ahead, and how far ahead they are.
const LOOK: usize = 8;
const AHEAD: f64 = 0.4;

/// The least upward component of a normal on which one can stand: 50°.
const STEEP: f64 = 0.64;

struct Walker {
    /// The middle of the lower end of the capsule.
    foot: [f64; 3],
    fall: f64,
    heading: f64,
    walked: f64,
    is_standing: bool,
    hint: ShapeHint,
}

impl Walker {
    fn shape(&self, height: f64) -> Shape<'static> {
        let radius = 0.15 * height;
        let [x, y, z] = self.foot;
        Shape::Capsule { ends: [self.foot, [x, y, z + height - 2.0 * radius]], radius }
    }

    /// Returns `true` if there is a floor ahead, at most half the height below.
    fn sees_floor(&self, target: &Target<'_>, height: f64, scratch: &mut Scratch) -> bool {
        let [x, y, z] = self.foot;
        let place = [x + AHEAD * self.heading.cos(), y + AHEAD * self.heading.sin(), z];
        target.is_hit(&Ray::new(place, [0.0, 0.0, -1.0]).with_max(0.65 * height), scratch)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut words = std::env::args_os().skip(1);
    let scan = match words.next().map(PathBuf::from) {
        Some(path) if path.extension().is_some_and(|end| end == "nm") => {
            Scan::open(&path, nearmiss::Check::Structure)?
        }
        Some(path) => Scan::build(&nearmiss::io::read(&path, None)?.cloud, &BuildOptions::default())?,
        None => Scan::build(&PointCloud::from_positions(&hills())?, &BuildOptions::default())?,
    };
    let mut number = || words.next().and_then(|word| word.to_str().and_then(|word| word.parse::<f64>().ok()));
    let height = number().unwrap_or(1.7);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count")]
    let count = number().unwrap_or(1000.0) as usize;

    let options = CollideOptions::estimated().with_detail(Detail::Verdict);
    let plan = ShapePlan::new(&options, &scan)?;
    let target = Target::new(scan.at(&Pose::IDENTITY), &plan);
    let (mut rng, mut scratch) = (rng(1), Scratch::default());
    let mut walkers = settle(&target, (height, count), &mut rng, &mut scratch);
    println!("{} capsules, {height} high, on {} points", walkers.len(), scan.len());

    let (mut contacts, mut total, mut longest) = (Vec::new(), Duration::ZERO, Duration::ZERO);
    for (step, _) in (0..STEPS).enumerate() {
        let start = Instant::now();
        for (number, walker) in walkers.iter_mut().enumerate() {
            if (number + step).is_multiple_of(LOOK) && !walker.sees_floor(&target, height, &mut scratch) {
                walker.heading = rng.random_range(0.0..TAU);
            }
            let before = walker.foot;
            walker.fall += GRAVITY * STEP;
            let way = SPEED * STEP;
            walker.foot[0] += walker.heading.cos() * way;
            walker.foot[1] += walker.heading.sin() * way;
            walker.foot[2] -= walker.fall * STEP;
            walker.is_standing = false;
            target.contacts_hinted(&walker.shape(height), &mut walker.hint, &mut contacts, &mut scratch);
            // Each contact pushes by what those before it have left.
            let mut push = [0.0; 3];
            for contact in &contacts {
                let n = contact.normal;
                let left = contact.depth - (0..3).map(|k| push[k] * n[k]).sum::<f64>();
                (0..3).for_each(|k| push[k] += n[k] * left.max(0.0));
                walker.is_standing |= n[2] > STEEP;
            }
            (0..3).for_each(|k| walker.foot[k] += push[k]);
            if walker.is_standing {
                walker.fall = 0.0;
            }
            let gone = (walker.foot[0] - before[0]).hypot(walker.foot[1] - before[1]);
            walker.walked += gone;
            if gone < 0.5 * way {
                walker.heading = rng.random_range(0.0..TAU);
            }
        }
        let time = start.elapsed();
        (total, longest) = (total + time, longest.max(time));
    }
    let bottom = scan.bounds().min[2] - height;
    let standing = walkers.iter().filter(|walker| walker.is_standing).count();
    let lost = walkers.iter().filter(|walker| walker.foot[2] < bottom).count();
    let walked = walkers.iter().map(|walker| walker.walked).fold(0.0, |sum, own| sum + own);
    #[expect(clippy::cast_precision_loss, reason = "a count")]
    let mean = walked / walkers.len().max(1) as f64;
    println!(
        "{:.2?} a step in the mean, {longest:.2?} at most; {:.2?} are left for 60 steps a second",
        total / STEPS,
        Duration::from_secs_f64(STEP)
    );
    println!("after {STEPS} steps {standing} stand, {lost} fell off the scan; {mean:.1} walked in the mean");
    Ok(())
}

/// Puts capsules where a ray from above, or from the ceiling below it, finds a floor with room above.
fn settle(
    target: &Target<'_>,
    (height, count): (f64, usize),
    rng: &mut impl Rng,
    scratch: &mut Scratch,
) -> Vec<Walker> {
    let bounds = target.scan().scan().bounds();
    let (mut walkers, mut hits) = (Vec::new(), Vec::new());
    for _ in 0..100 * count {
        if walkers.len() == count {
            break;
        }
        let [x, y] = [0, 1].map(|k| rng.random_range(bounds.min[k]..bounds.max[k]));
        target.cast_all(&Ray::new([x, y, bounds.max[2] + height], [0.0, 0.0, -1.0]), &mut hits, scratch);
        let floors: Vec<f64> =
            hits.iter().filter(|hit| hit.normal[2].abs() > 0.95).map(|hit| hit.point[2]).collect();
        if floors.is_empty() {
            continue;
        }
        let floor = floors[rng.random_range(0..floors.len())];
        let foot = [x, y, floor + 0.17 * height];
        let heading = rng.random_range(0.0..TAU);
        let hint = ShapeHint::default();
        let walker = Walker { foot, fall: 0.0, heading, walked: 0.0, is_standing: false, hint };
        if !target.touch(&walker.shape(height), scratch).verdict.is_touching() {
            walkers.push(walker);
        }
    }
    walkers
}

/// Points of a hilly ground, 40 by 40, every 0.1.
fn hills() -> Vec<[f64; 3]> {
    let place = |i: u32| [f64::from(i % 400) * 0.1, f64::from(i / 400) * 0.1];
    let raised = |[x, y]: [f64; 2]| [x, y, 0.8 * (0.3 * x).sin() * (0.25 * y).cos()];
    (0..160_000).map(|i| raised(place(i))).collect()
}
