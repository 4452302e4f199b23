//! `poses`: generates a sweep over distances, or poses near first contact.
//!
//! a stays, and b is rotated at random about its centre and placed at a distance d from the centre of a, in a
//! random direction. Poses are made in a world in which the longest side of a is 2, and scaled back unless
//! `--normalise` is given; that option also scales b to this size, as in Klein & Zachmann 2004, section 6.

use std::f64::consts::TAU;
use std::path::PathBuf;

use clap::Args;
use nearmiss::{Pose, Scan};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;
use serde::Serialize;

use crate::console::{Bar, Console};
use crate::error::CliError;
use crate::input::Opening;
use crate::output;

mod approach;

use approach::Approach;

/// Options of `poses`: either a sweep or poses near contact.
#[derive(Debug, Clone, Args)]
#[command(group = clap::ArgGroup::new("kind").required(true).args(["sweep", "near"]))]
pub struct PosesArgs {
    /// Scan that stays: prepared (.nm), or a point cloud or mesh
    pub a: PathBuf,
    /// Scan that is turned and moved
    pub b: PathBuf,
    /// Make poses at thirteen distances between the centres, from 0 to 1.5 times the longest side of A
    ///
    /// Rotations and directions are random.
    #[arg(long)]
    pub sweep: bool,
    /// Make poses up to 10 r before or after first contact, half of them without overlap
    ///
    /// r is the larger sampling radius. First contact, found by bisection and not by `collide`, is
    /// where the nearest points of the two scans are r/2 apart.
    #[arg(long)]
    pub near: bool,
    /// Scale both scans to a longest side of 2, and centre them
    ///
    /// Without this option, poses keep the units of the files: A stays where it is, and B keeps its
    /// size.
    #[arg(long)]
    pub normalise: bool,
    /// Number of poses at each distance (--sweep) or in all (--near)
    #[arg(long, alias = "count", value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(1..))]
    pub per_distance: u32,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// File to write, for `collide --poses`; `-` writes to standard output
    #[arg(short, long, value_name = "F.jsonl")]
    pub output: PathBuf,
    /// Show no progress
    #[arg(long)]
    pub quiet: bool,
    /// Check prepared scans in full before use: checksums and all values
    #[arg(long)]
    pub verify: bool,
}

/// The number of distances of a sweep: 0, 0.25, … 3.
const DISTANCES: u32 = 13;

/// The step between the distances of a sweep.
const STEP: f64 = 0.25;

/// A line of the file.
#[derive(Debug, Serialize)]
struct Line {
    a: [f64; 16],
    b: [f64; 16],
    /// The distance of the centres.
    d: f64,
    /// The shift from first contact; positive if the scans are apart.
    #[serde(skip_serializing_if = "Option::is_none")]
    offset: Option<f64>,
}

/// The world in which poses are generated, and the transform back to the world of the file.
#[derive(Debug)]
struct Stage {
    /// The poses of a, and of b before it is turned and moved.
    bases: [Pose; 2],
    /// Half the longest side of b in this world; that of a is 1.
    size_of_b: f64,
    /// From this world to that of the file; `None` if they are the same.
    back: Option<Pose>,
}

impl Stage {
    /// Creates the stage. Fails for scans without an extent.
    fn new(args: &PosesArgs, [a, b]: [&Scan; 2]) -> Result<Self, CliError> {
        let base = |path: &PathBuf, scan| {
            let what = "expected a scan with an extent, got points at one place only";
            normalised(scan).ok_or_else(|| CliError::UnsuitableFile { path: path.clone(), what: what.into() })
        };
        let [base_a, base_b] = [base(&args.a, a)?, base(&args.b, b)?];
        if args.normalise {
            return Ok(Self { bases: [base_a, base_b], size_of_b: 1.0, back: None });
        }
        let size_of_b = base_a.scale() / base_b.scale();
        let resized = Pose::IDENTITY.with_scale(size_of_b).after(&base_b);
        Ok(Self { bases: [base_a, resized], size_of_b, back: Some(base_a.inverse()) })
    }

    /// Returns the line of the file for a pose of b, a distance and an offset.
    fn line(&self, b: &Pose, d: f64, offset: Option<f64>) -> Line {
        match &self.back {
            None => Line { a: self.bases[0].to_row_major(), b: b.to_row_major(), d, offset },
            Some(back) => Line {
                a: Pose::IDENTITY.to_row_major(),
                b: back.after(b).to_row_major(),
                d: d * back.scale(),
                offset: offset.map(|offset| offset * back.scale()),
            },
        }
    }
}

pub(crate) fn run(args: &PosesArgs) -> Result<(), CliError> {
    if !output::is_stdout(&args.output) {
        output::check_apart(&args.output, &[&args.a, &args.b])?;
    }
    let console = Console::new(args.quiet);
    let [a, b] = Opening::new(args.verify, console).open_both(None, [&args.a, &args.b])?;
    let stage = Stage::new(args, [&a, &b])?;
    if args.near {
        let lines = near(args, [&a, &b], &stage, console)?;
        write(args, lines.into_iter())
    } else {
        let count = u64::from(DISTANCES) * u64::from(args.per_distance);
        let bar = console.steps("making poses", count);
        let poses = (0..).zip(sweep(args.per_distance, args.seed, &stage.bases[1]));
        let lines = poses.map(|(i, pose)| {
            bar.advance(1);
            let d = distance(i, args.per_distance);
            stage.line(&pose, d, None)
        });
        write(args, lines)
    }
}

fn write(args: &PosesArgs, mut lines: impl Iterator<Item = Line>) -> Result<(), CliError> {
    output::replace_or_print(&args.output, |out| {
        lines.try_for_each(|line| {
            serde_json::to_writer(&mut *out, &line)?;
            writeln!(out)
        })
    })
}

/// Returns the poses of b in a sweep, `per_distance` at each distance. `base` scales and centres b.
pub(crate) fn sweep(per_distance: u32, seed: u64, base: &Pose) -> impl Iterator<Item = Pose> {
    (0..u64::from(DISTANCES) * u64::from(per_distance)).map(move |i| {
        let (turn, direction) = placement(&mut rng(seed, i));
        at(&turn, direction, distance(i, per_distance), base)
    })
}

/// Returns the distance of the `i`-th pose of a sweep.
#[expect(clippy::cast_precision_loss, reason = "0 to 12")]
fn distance(i: u64, per_distance: u32) -> f64 {
    (i / u64::from(per_distance)) as f64 * STEP
}

/// Returns the pose that centres the bounds of a scan and scales their longest side to 2, or `None`
/// for bounds without an extent.
pub(crate) fn normalised(scan: &Scan) -> Option<Pose> {
    let bounds = scan.bounds();
    let scale = 1.0 / bounds.half_extents().into_iter().fold(0.0, f64::max);
    let centre = bounds.centre();
    (scale.is_finite() && scale > 0.0)
        .then(|| Pose::IDENTITY.with_scale(scale).with_translation(centre.map(|c| -c * scale)))
}

/// Returns the pose of b, turned and at distance `d`.
fn at(turn: &Pose, direction: [f64; 3], d: f64, base: &Pose) -> Pose {
    turn.with_translation(direction.map(|c| c * d)).after(base)
}

/// Returns the random generator of the `i`-th pose. Each pose has its own, so poses can be
/// generated in any order.
fn rng(seed: u64, i: u64) -> Xoshiro256PlusPlus {
    // The key comes from a generator too, so that seeds 0 and 1 share no pose.
    let mut of_seed = Xoshiro256PlusPlus::seed_from_u64(seed);
    let key: u64 = of_seed.random();
    Xoshiro256PlusPlus::seed_from_u64(key ^ i.wrapping_mul(0x9e37_79b9_7f4a_7c15))
}

/// Returns a uniform random rotation (Shoemake, "Uniform random rotations", Graphics Gems III,
/// 1992) and a uniform random direction.
fn placement(rng: &mut Xoshiro256PlusPlus) -> (Pose, [f64; 3]) {
    let share: f64 = rng.random();
    let [s, t, phi] = [0; 3].map(|_| rng.random::<f64>() * TAU);
    let (low, high) = ((1.0 - share).sqrt(), share.sqrt());
    let turn = Pose::from_quaternion([low * s.sin(), low * s.cos(), high * t.sin(), high * t.cos()]);
    let z = rng.random_range(-1.0..=1.0_f64);
    let level = (1.0 - z * z).sqrt();
    (turn, [level * phi.cos(), level * phi.sin(), z])
}

/// The largest shift from first contact, in sampling radii.
const FARTHEST: f64 = 10.0;

/// The number of rotations and directions that are tried before `--near` gives up.
const TRIES: usize = 200;

fn near(args: &PosesArgs, scans: [&Scan; 2], stage: &Stage, console: Console) -> Result<Vec<Line>, CliError> {
    let bases = &stage.bases;
    let [ra, rb] = [0, 1].map(|k| scans[k].sampling_radius() * bases[k].scale());
    let radius = ra.max(rb);
    // Each scan is within √3 times half its longest side of its centre.
    let far = 1.75 * (1.0 + stage.size_of_b);
    let approach = Approach::new(scans, &bases[0], 0.5 * radius, 0.02 * radius, far);
    let bar: Bar = console.steps("making poses", u64::from(args.per_distance));
    let line = |i: u32| {
        let mut rng = rng(args.seed, u64::from(i));
        let line = (0..TRIES).find_map(|_| {
            let (turn, direction) = placement(&mut rng);
            let touch = approach.first_touch(|d| at(&turn, direction, d, &bases[1]))?;
            let shift: f64 = rng.random_range(0.0..FARTHEST) * radius;
            let offset = if i.is_multiple_of(2) { shift } else { -shift };
            let d = touch + offset;
            Some(stage.line(&at(&turn, direction, d, &bases[1]), d, Some(offset)))
        });
        bar.advance(1);
        line.ok_or_else(|| CliError::UnsuitableFile {
            path: args.b.clone(),
            what: format!(
                "expected contact with {}, got none in {TRIES} random directions; check that both scans sample \
                 surfaces and have the same units",
                args.a.display()
            ),
        })
    };
    (0..args.per_distance).into_par_iter().map(line).collect()
}
