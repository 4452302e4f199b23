//! `sweep`: decides whether a whole motion is free, and finds the first impact otherwise.

mod picture;
mod report;

use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::Args;
use nearmiss::{
    Budget, Deadline, MeshScanSweep, Motion, MotionError, PlanError, Pose, Prepared, Scan, Scratch, Sweep,
    SweepAnswer, SweepOptions, SweepPlan, SweepVerdict,
};

use crate::as_mesh::{AsMeshName, one_of_two};
use crate::bodies::{Bodies, swap};
use crate::console::{Console, Results, now};
use crate::error::CliError;
use crate::eval::KernelName;
use crate::meaning::MeaningArgs;
use crate::parse::{parse_duration, parse_radius, parse_work};
use crate::posing::{PairArgs, PoseFile, Posed};
use crate::preprocess::parse_threads;
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
    /// Lines have the forms that `collide --poses` takes: `{"a":[…],"b":[…]}`, where either may be left
    /// out, or the pose of b alone. From line to line each scan moves by a screw: a steady rotation
    /// about an axis and a steady shift along it. A rotation takes the shorter way, at most half a
    /// turn; for larger rotations, give intermediate poses. The scale must stay the same.
    #[arg(long, alias = "poses", value_name = "FILE")]
    pub path: PathBuf,
    /// Distance that the scans must keep, in world units
    #[arg(long, alias = "margin", value_name = "D", allow_hyphen_values = true, value_parser = parse_radius, default_value = "0")]
    pub clearance: f64,
    /// Metric of the kernel that defines the surfaces; by default the one the scans were prepared for
    ///
    /// With the geodesic kernel, nothing is proven.
    #[arg(long, value_enum, conflicts_with = "thickened", help_heading = "Research", hide_short_help = true)]
    pub kernel: Option<KernelName>,
    /// The meaning of the scans
    #[command(flatten)]
    pub meaning: MeaningArgs,
    /// Compare the triangles of this input, a or b, instead of its points
    #[arg(long, value_name = "WHICH", value_parser = one_of_two())]
    pub as_mesh: Option<AsMeshName>,
    /// Time limit for the whole motion, such as 50ms
    ///
    /// The unit is ns, us, ms or s. When time runs out, the answer states what has been proven.
    #[arg(long, value_name = "50ms", allow_hyphen_values = true, value_parser = parse_duration, help_heading = "Budget and evidence")]
    pub budget: Option<Duration>,
    /// Work limit for the whole motion; reproducible, unlike time
    ///
    /// A unit is one evaluation of f or one node pair.
    #[arg(long, value_name = "N", value_parser = parse_work, help_heading = "Budget and evidence")]
    pub work: Option<u64>,
    /// Threads to prepare raw inputs; 0 for all cores
    #[arg(long, value_name = "N", value_parser = parse_threads, help_heading = "Budget and evidence")]
    pub threads: Option<usize>,
    /// Draw the motion, coloured by clearance, and a plot of clearance over time, as PNG
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
    let inputs = args.pair.inputs();
    if let Some(path) = &args.image {
        output::check_apart(path, &[inputs[0], inputs[1], &args.path])?;
        scans_picture::check_name(path)?;
    }
    let mut poses = args.pair.path_file(&args.path)?;
    let opening = args.pair.opening(args.threads, console);
    let kernel = args.kernel.map(KernelName::metric);
    let bodies = match args.as_mesh {
        Some(which) => opening.open_mesh_and_scan(which, kernel, inputs)?,
        None if args.meaning.thickened.is_some() => Bodies::Scans(opening.open_points(inputs)?),
        None => Bodies::Scans(opening.open_both(kernel, inputs)?),
    };
    let motions = read_motions(&mut poses, &bodies)?;
    let plan = plan(&options(args, bodies.scan()), &bodies)?;
    let first = bodies.at(&motions.each_ref().map(|motion| motion.at(0.0)));
    first.compare_sizes(&args.pair.size_check(console));
    let duration = motions[0].duration().max(motions[1].duration());
    let bar = console.spinner(format_args!("sweeping {duration} steps"));
    let start = now();
    let answer = sweep(&bodies, &motions, &plan, &budget(args, start));
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
        let of_mesh;
        let shown = match &bodies {
            Bodies::Scans([a, b]) => [a, b],
            Bodies::MeshAndScan { mesh, scan, mesh_is_a } => {
                of_mesh = picture::points_of(mesh, inputs[usize::from(!mesh_is_a)])?;
                if *mesh_is_a { [&of_mesh, scan] } else { [scan, &of_mesh] }
            }
        };
        output::save_picture(&picture::paint((&bodies, shown, &motions), &plan, &answer, &style), path)?;
        drop(bar);
    }
    let mut results = Results::new();
    let report = Report::new(&answer, duration, micros);
    if args.json {
        results.json(&report)?;
    } else {
        results.line(report.sentence(&answer, args.clearance, first.unit()))?;
        results.line(report.details())?;
    }
    results.flush()
}

/// Returns the budget of a sweep that starts at `start`.
fn budget(args: &SweepArgs, start: Instant) -> Budget {
    let mut budget = Budget::UNLIMITED;
    (budget.work, budget.deadline) =
        (args.work, args.budget.and_then(|time| start.checked_add(time)).map(Deadline::at));
    budget
}

/// Validates the options.
fn plan(options: &SweepOptions, bodies: &Bodies) -> Result<SweepPlan, PlanError> {
    match bodies {
        Bodies::Scans([a, b]) => SweepPlan::new(options, a, b),
        Bodies::MeshAndScan { scan, .. } => SweepPlan::against_mesh(options, scan),
    }
}

/// Answers the question.
fn sweep(bodies: &Bodies, motions: &[Motion; 2], plan: &SweepPlan, budget: &Budget) -> SweepAnswer {
    let scratch = &mut Scratch::default();
    match bodies {
        Bodies::Scans([a, b]) => {
            Sweep::new(a.along(&motions[0]), b.along(&motions[1])).within(budget).first_impact(plan, scratch)
        }
        Bodies::MeshAndScan { mesh, scan, mesh_is_a } => {
            let of_mesh = usize::from(!mesh_is_a);
            let moving = scan.along(&motions[1 - of_mesh]);
            let sweep = MeshScanSweep::new(moving, mesh, &motions[of_mesh]).within(budget);
            let mut answer = sweep.first_impact(plan, scratch);
            if let (true, SweepVerdict::Impact { contact, .. }) = (mesh_is_a, &mut answer.verdict) {
                swap(contact);
            }
            answer
        }
    }
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
    let motion = |name: &str, of: &[Pose]| {
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
