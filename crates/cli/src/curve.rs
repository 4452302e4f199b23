//! `curve`: finds all curves in which two scans intersect.

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;
use nearmiss::io::{Column, PlyPoints};
use nearmiss::{Budget, Curve, CurveEnd, CurveOptions, CurvePlan, Curves, Deadline, Pair, Placed, Scratch};
use serde::Serialize;

use crate::answer_report::AnswerReport;
use crate::console::{Console, Results, micros_since, now};
use crate::curve_picture;
use crate::digits::{count, rough, short, work};
use crate::error::CliError;
use crate::eval::KernelName;
use crate::no_curve::NoCurve;
use crate::parse::{parse_duration, parse_work};
use crate::picture::names;
use crate::posing::PairArgs;
use crate::preprocess::parse_threads;
use crate::viewpoint::ViewArgs;
use crate::{output, picture, posing};

/// Options of `curve`.
#[derive(Debug, Clone, Args)]
pub struct CurveArgs {
    /// The scans and their poses
    #[command(flatten)]
    pub pair: PairArgs,
    /// Metric of the kernel that defines the surfaces; by default the one the scans were prepared for
    #[arg(long, value_enum, help_heading = "Research", hide_short_help = true)]
    pub kernel: Option<KernelName>,
    /// Distance between points along a curve, in world units
    ///
    /// Points are closer together where a curve bends. The default is twice the smaller
    /// sampling radius.
    #[arg(long, value_name = "S", allow_hyphen_values = true, value_parser = parse_length)]
    pub spacing: Option<f64>,
    /// Largest distance of a point from either surface, in world units; by default a thousandth
    /// of the smaller sampling radius
    #[arg(long, value_name = "E", allow_hyphen_values = true, value_parser = parse_length)]
    pub tolerance: Option<f64>,
    /// Time limit, such as 5ms; the curves found until then are written
    #[arg(long, value_name = "5ms", allow_hyphen_values = true, value_parser = parse_duration, help_heading = "Budget and evidence")]
    pub budget: Option<Duration>,
    /// Work limit, in evaluations of f and node pairs; reproducible, unlike time
    #[arg(long, value_name = "N", value_parser = parse_work, help_heading = "Budget and evidence")]
    pub work: Option<u64>,
    /// Threads to prepare raw inputs; 0 for all cores
    #[arg(long, value_name = "N", value_parser = parse_threads, help_heading = "Budget and evidence")]
    pub threads: Option<usize>,
    /// PLY file for the curves: points with the number of their curve, and edges
    #[arg(short, long, value_name = "OUT.ply", help_heading = "Output")]
    pub output: PathBuf,
    /// Draw both scans and their curves, as PNG
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

fn parse_length(text: &str) -> Result<f64, String> {
    let length = text.parse().ok().filter(|l: &f64| *l > 0.0 && l.is_finite());
    length.ok_or_else(|| "expected a length of more than zero, in world units".into())
}

/// The JSON output of `curve`.
#[derive(Debug, Serialize)]
struct CurveReport {
    /// The verdict on contact; scans without a curve may still touch.
    verdict: &'static str,
    points: usize,
    curves: usize,
    closed: usize,
    length: f64,
    max_residual: f64,
    /// `false` if the budget ended the search; absent otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    complete: Option<bool>,
    evaluations: u64,
    micros: f64,
    /// The answer of `collide` for the surfaces; only if no curve was found.
    #[serde(skip_serializing_if = "Option::is_none")]
    surfaces: Option<AnswerReport>,
    /// The answer of `collide` for the obstacles; only if no curve was found.
    #[serde(skip_serializing_if = "Option::is_none")]
    obstacles: Option<AnswerReport>,
}

pub(crate) fn run(args: &CurveArgs) -> Result<(), CliError> {
    let console = Console::new(args.quiet);
    let inputs = args.pair.inputs();
    output::check_apart(&args.output, &inputs)?;
    if let Some(path) = &args.image {
        output::check_apart(path, &inputs)?;
        picture::check_name(path)?;
        if *path == args.output {
            return Err(CliError::Usage(format!(
                "{}: expected one output for each file, got two outputs; name another file",
                path.display()
            )));
        }
    }
    let matrices = args.pair.matrices()?;
    let kernel = args.kernel.map(KernelName::metric);
    let [a, b] = args.pair.opening(args.threads, console).open_both(kernel, inputs)?;
    let [pose_a, pose_b] = posing::of_options(&matrices, [&a, &b])?;
    let [a, b] = [a.at(&pose_a), b.at(&pose_b)];

    let plan = CurvePlan::new(&options(args), a.scan(), b.scan())?;
    let (mut found, mut scratch) = (Curves::default(), Scratch::default());
    let start = now();
    let mut budget = Budget::UNLIMITED;
    (budget.work, budget.deadline) =
        (args.work, args.budget.and_then(|time| start.checked_add(time)).map(Deadline::at));
    Pair::new(a, b).within(&budget).curves(&plan, &mut found, &mut scratch);
    let missed = if found.curves.is_empty() && found.complete {
        let spent = found.statistics.evaluations + found.statistics.node_pairs;
        budget.work = budget.work.map(|units| units.saturating_sub(spent));
        Some(NoCurve::ask([&a, &b], &budget)?)
    } else {
        None
    };
    let micros = micros_since(start);

    write(&args.output, &found)?;
    if let Some(path) = &args.image {
        let bar = console.spinner(format_args!("painting {}", path.display()));
        let style = picture::Style {
            names: names(inputs),
            points: false,
            view: args.view,
            unit: args.pair.world_unit(),
        };
        output::save_picture(&curve_picture::paint([&a, &b], &found, &style), path)?;
        drop(bar);
    }
    tell(&found, missed.as_ref(), [&a, &b], micros, args.json)
}

/// Returns the options of a query.
pub(crate) fn options(args: &CurveArgs) -> CurveOptions {
    let mut options = CurveOptions::default();
    (options.spacing, options.tolerance) = (args.spacing, args.tolerance);
    options
}

/// Writes the points in the world frame, each with the number of its curve, and the edges.
fn write(path: &Path, found: &Curves) -> Result<(), CliError> {
    let number = |i: usize| u32::try_from(i).unwrap_or(u32::MAX);
    let all = || (0..).zip(&found.curves);
    let curve: Vec<u32> = all().flat_map(|(i, curve)| std::iter::repeat_n(i, curve.count)).collect();
    let edges: Vec<[u32; 2]> =
        found.curves.iter().flat_map(Curve::edges).map(|edge| edge.map(number)).collect();
    output::replace(path, |out| {
        let columns = [Column::Uint("curve", &curve)];
        let ply = PlyPoints::double(&found.points).with_columns(&columns).with_edges(&edges);
        ply.write(out).map_err(CliError::writing_ply(path))
    })
}

fn tell(
    found: &Curves,
    missed: Option<&NoCurve>,
    views: [&Placed<'_>; 2],
    micros: f64,
    json: bool,
) -> Result<(), CliError> {
    let mut results = Results::new();
    let (mut evaluations, mut node_pairs) = (found.statistics.evaluations, found.statistics.node_pairs);
    for statistics in missed.iter().flat_map(|missed| missed.statistics()) {
        evaluations += statistics.evaluations;
        node_pairs += statistics.node_pairs;
    }
    let verdict = match missed {
        _ if !found.curves.is_empty() => "intersecting",
        Some(missed) => missed.word(),
        None => "undecided",
    };
    let [surfaces, obstacles] = missed.map_or([None, None], |missed| missed.reports().map(Some));
    let report = CurveReport {
        verdict,
        points: found.points.len(),
        curves: found.curves.len(),
        closed: found.closed(),
        length: found.length(),
        max_residual: found.max_residual,
        complete: (!found.complete).then_some(false),
        evaluations,
        micros,
        surfaces,
        obstacles,
    };
    if json {
        results.json(&report)?;
        return results.flush();
    }
    results.line(missed.map_or_else(|| sentence(found), |missed| missed.sentence(views)))?;
    if !found.complete {
        results.line(unfinished(views))?;
    }
    results.line(format_args!(
        "{}",
        work(
            [(report.points as u64, "point"), (node_pairs, "node pair"), (report.evaluations, "evaluation")],
            micros
        )
    ))?;
    results.flush()
}

/// Returns a description of the curves.
fn sentence(found: &Curves) -> String {
    let touching = found.curves.iter().filter(|curve| curve.count == 1).count();
    let closed = found.closed();
    let open = found.curves.len() - touching - closed;
    let mut parts = Vec::new();
    if closed > 0 {
        parts.push(count(closed as u64, "closed curve"));
    }
    if open > 0 {
        parts.push(count(open as u64, "open curve"));
    }
    let mut text = match (parts.is_empty(), touching) {
        (true, 0) => return "No curve found.".to_owned(),
        (true, _) => format!("They touch in {}", count(touching as u64, "point")),
        (false, 0) => format!("They intersect in {}", parts.join(" and ")),
        (false, _) => {
            format!(
                "They intersect in {} and touch in {}",
                parts.join(" and "),
                count(touching as u64, "point")
            )
        }
    };
    if open + closed > 0 {
        let total = if open + closed > 1 { "total length" } else { "length" };
        text += &format!(", {total} {}", short(found.length()));
    }
    text += &format!(", within {} of both surfaces.", rough(found.max_residual));
    let ends = |wanted: CurveEnd| {
        let ends = found.curves.iter().filter(|curve| curve.count > 1).filter_map(|curve| curve.ends);
        ends.flatten().filter(|&end| end == wanted).count()
    };
    let said: Vec<String> = [
        (CurveEnd::BorderOfA, "at the border of a"),
        (CurveEnd::BorderOfB, "at the border of b"),
        (CurveEnd::Tangent, "where they touch"),
        (CurveEnd::Lost, "where the points do not look like a single surface"),
        (CurveEnd::Budget, "where the budget ran out"),
    ]
    .into_iter()
    .filter_map(|(end, place)| Some(ends(end)).filter(|&n| n > 0).map(|n| format!("{n} {place}")))
    .collect();
    if !said.is_empty() {
        text += &format!(" Ends: {}.", said.join(", "));
    }
    text
}

/// Returns the reason why curves may be missing.
fn unfinished(views: [&Placed<'_>; 2]) -> &'static str {
    let is_finite = |view: &&Placed<'_>| view.stored_to_world().to_row_major().iter().all(|c| c.is_finite());
    if views.iter().all(is_finite) {
        "The budget ran out, so curves may be missing. Raise --budget or --work."
    } else {
        "A pose is not finite; check --pose-a and --pose-b."
    }
}
