//! `sweep`: decides whether a whole motion is free, and finds the first impact otherwise.

mod picture;
mod report;

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use nearmiss::{
    Budget, Deadline, Motion, MotionError, Prepared, Scan, Scratch, Sweep, SweepOptions, SweepPlan,
};

use crate::bodies::Bodies;
use crate::console::{Console, Results, now};
use crate::error::CliError;
use crate::eval::KernelName;
use crate::meaning::MeaningArgs;
use crate::parse::{parse_duration, parse_radius};
use crate::posing::{PairArgs, PoseFile, Posed};
use crate::preprocess::parse_threads;
use crate::sentence::unit;
use crate::viewpoint::ViewArgs;
use crate::{output, picture as scans_picture};
use report::Report;

/// Options of `sweep`.
#[derive(Debug, Clone, Args)]
pub struct SweepArgs {
    /// The scans and their poses
    #[command(flatten)]
    pub pair: PairArgs,
    /// Poses of the path, one on each line of this file; `-` reads standard input
    ///
    /// Lines have the forms that `collide --poses` takes: `{"a":[…],"b":[…]}`, where either may
    /// be left out, or the pose of b alone. From line to line each scan moves by a screw: a steady
    /// rotation about an axis and a steady shift along it. It turns the shorter way, by at most
    /// half a turn; give more lines for more. The scale must stay the same.
    #[arg(long, value_name = "FILE")]
    pub path: PathBuf,
    /// Distance that the scans must keep, in world units
    #[arg(long, value_name = "D", allow_hyphen_values = true, value_parser = parse_radius, default_value = "0")]
    pub clearance: f64,
    /// Distances that define the surfaces; by default those that the scans were prepared for
    ///
    /// With the geodesic kernel, nothing is proven.
    #[arg(long, value_enum, conflicts_with = "thickened", help_heading = "Research", hide_short_help = true)]
    pub kernel: Option<KernelName>,
    /// The meaning of the scans
    #[command(flatten)]
    pub meaning: MeaningArgs,
    /// Time limit for the whole motion, such as 50ms
    ///
    /// The unit is ns, us, ms or s. What is proven by then is told.
    #[arg(long, value_name = "50ms", allow_hyphen_values = true, value_parser = parse_duration, help_heading = "Budget and evidence")]
    pub budget: Option<Duration>,
    /// Work limit for the whole motion; reproducible, unlike time
    ///
    /// A unit is one evaluation of f or one node pair.
    #[arg(long, value_name = "N", help_heading = "Budget and evidence")]
    pub work: Option<u64>,
    /// Threads to prepare raw inputs; 0 for all cores
    #[arg(long, value_name = "N", value_parser = parse_threads, help_heading = "Budget and evidence")]
    pub threads: Option<usize>,
    /// Draw the motion with the clearance as colour, and the clearance over time, as PNG
    #[arg(long, value_name = "OUT.png", help_heading = "Output")]
    pub image: Option<PathBuf>,
    /// From where the picture is taken
    #[command(flatten)]
    pub view: ViewArgs,
    /// Print one JSON object
    #[arg(long, help_heading = "Output")]
    pub json: bool,
    /// Show no progress
    #[arg(long, help_heading = "Output")]
    pub quiet: bool,
}

pub(crate) fn run(args: &SweepArgs) -> Result<(), CliError> {
    let console = Console::new(args.quiet);
    if let Some(path) = &args.image {
        let mut inputs = args.pair.inputs().to_vec();
        inputs.push(&args.path);
        output::check_apart(path, &inputs)?;
        scans_picture::check_name(path)?;
    }
    let mut poses = args.pair.path_file(&args.path)?;
    let opening = args.pair.opening(args.threads, console);
    let inputs = args.pair.inputs();
    let scans = if args.meaning.thickened.is_some() {
        opening.open_points(inputs)?
    } else {
        opening.open_both(args.kernel.map(KernelName::metric), inputs)?
    };
    let plan = SweepPlan::new(&options(args, &scans[0]), &scans[0], &scans[1])?;
    let bodies = Bodies::Scans(scans);
    let motions = read_motions(&mut poses, &bodies)?;
    let Bodies::Scans(scans) = &bodies else { return Ok(()) };
    let moving = [scans[0].along(&motions[0]), scans[1].along(&motions[1])];
    let first = moving.map(|moving| moving.at(0.0));
    args.pair.size_check(console).compare(first.each_ref());

    let bar = console.spinner(format_args!("sweeping {} steps", motions[1].duration()));
    let start = now();
    let mut budget = Budget::UNLIMITED;
    (budget.work, budget.deadline) =
        (args.work, args.budget.and_then(|time| start.checked_add(time)).map(Deadline::at));
    let sweep = Sweep::new(moving[0], moving[1]).within(&budget);
    let answer = sweep.first_impact(&plan, &mut Scratch::default());
    #[expect(clippy::cast_precision_loss, reason = "nanoseconds of less than a month are exact")]
    let micros = start.elapsed().as_nanos() as f64 / 1e3;
    drop(bar);
    if let Some(path) = &args.image {
        let bar = console.spinner(format_args!("painting {}", path.display()));
        let style = scans_picture::Style {
            names: scans_picture::names(inputs),
            points: args.meaning.thickened.is_some(),
            view: args.view,
            unit: args.pair.world_unit(),
        };
        picture::paint(moving, &plan, &answer, &style).save(path)?;
        drop(bar);
    }
    let mut results = Results::new();
    let report = Report::new(&answer, motions[0].duration().max(motions[1].duration()), micros);
    if args.json {
        results.json(&report)?;
    } else {
        results.line(report.sentence(&answer, args.clearance, unit(first.each_ref())))?;
        results.line(report.details())?;
    }
    results.flush()
}

/// Returns the options of a sweep. `a` is the first scan.
pub(crate) fn options(args: &SweepArgs, a: &Scan) -> SweepOptions {
    SweepOptions::default().with_semantics(args.meaning.semantics(a)).with_clearance(args.clearance)
}

/// Reads the poses of the whole path.
fn read_motions(poses: &mut PoseFile, bodies: &Bodies) -> Result<[Motion; 2], CliError> {
    let (mut lines, mut of_a, mut of_b) = (Vec::new(), Vec::new(), Vec::new());
    while let Some((line, text)) = poses.next_line()? {
        let Posed { poses: [a, b], .. } = poses.poses(line, &text, bodies.posable())?;
        lines.push(line);
        of_a.push(a);
        of_b.push(b);
    }
    let motion = |name: &str, of: &[nearmiss::Pose]| {
        Motion::through(of).map_err(|refused| {
            let index = match refused {
                MotionError::NotFinite { index } | MotionError::Scale { index, .. } => index,
                _ => 0,
            };
            let line = lines.get(index).copied().unwrap_or_default();
            poses.fault_on(line, format!("`{name}`: {refused}"))
        })
    };
    Ok([motion("a", &of_a)?, motion("b", &of_b)?])
}
