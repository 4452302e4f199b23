//! `sweep`: decides whether a whole motion is free, and finds the first impact otherwise.

mod args;
mod picture;
mod report;
mod swept;

use std::time::Instant;

use nearmiss::{Budget, Deadline, Motion, MotionError, Pose};

use crate::console::{Console, Results, micros_since, now};
use crate::error::CliError;
use crate::posing::{PoseFile, Posed};
use crate::{output, picture as scans_picture};
pub use args::SweepArgs;
use report::Report;
use swept::Swept;

pub(crate) fn run(args: &SweepArgs) -> Result<(), CliError> {
    args.check_as_mesh()?;
    let console = Console::new(args.quiet);
    let inputs = args.pair.inputs();
    if let Some(path) = &args.image {
        output::check_apart(path, &[inputs[0], inputs[1], &args.path])?;
        scans_picture::check_name(path)?;
    }
    let mut poses = args.pair.path_file(&args.path)?;
    let swept = Swept::open(args, console)?;
    let (motions, moving) = read_motions(&mut poses, &swept)?;
    let plan = swept.plan(args)?;
    let first = motions.each_ref().map(|motion| motion.at(0.0));
    let unit = swept.compare_sizes(&first, args, console);
    let duration = motions[0].duration().max(motions[1].duration());
    let bar = console.spinner(format_args!("sweeping {duration} steps"));
    let start = now();
    let answer = swept.sweep(&motions, &plan, &budget(args, start));
    let micros = micros_since(start);
    drop(bar);
    if let Some(path) = &args.image {
        let bar = console.spinner(format_args!("painting {}", path.display()));
        let style = scans_picture::Style {
            names: scans_picture::names(inputs),
            points: args.meaning.thickened.is_some(),
            view: args.view,
            unit: args.pair.world_unit(),
        };
        let shown = swept.shown(args)?;
        let picture = picture::paint((&swept, &shown, &motions), &plan, &answer, &style);
        output::save_picture(&picture, path)?;
        drop(bar);
    }
    let mut results = Results::new();
    let report = Report::new(&answer, duration, micros);
    if args.json {
        results.json(&report)?;
    } else {
        results.line(report.sentence(&answer, (args.clearance, unit), swept.are_meshes()))?;
        results.line(report.details(moving))?;
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

/// Reads the poses of the whole path. Also tells which of both move.
fn read_motions(poses: &mut PoseFile, swept: &Swept) -> Result<([Motion; 2], [bool; 2]), CliError> {
    let (mut lines, mut of_a, mut of_b) = (Vec::new(), Vec::new(), Vec::new());
    while let Some((line, text)) = poses.next_line()? {
        let Posed { poses: [a, b], .. } = poses.poses(line, &text, swept.posable())?;
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
    let moves = |of: &[Pose]| of.iter().any(|pose| *pose != of[0]);
    Ok(([motion("a", &of_a)?, motion("b", &of_b)?], [moves(&of_a), moves(&of_b)]))
}
