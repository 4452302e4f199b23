//! `distance`: finds the distance between two scans.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use nearmiss::{Budget, Deadline, Distance, DistanceOptions, DistancePlan, Pose, Scan, Scratch, Semantics};
use serde::Serialize;

use crate::as_mesh::AsMeshName;
use crate::bodies::Bodies;
use crate::console::{Console, Results, micros_since, now};
use crate::digits::{rough, short, work};
use crate::distance_picture::paint_distance;
use crate::error::CliError;
use crate::eval::KernelName;
use crate::evidence::word;
use crate::meaning::MeaningArgs;
use crate::mesh::distance::DistanceQuestion;
use crate::parse::{parse_duration, parse_work};
use crate::path::{PathArgs, PathLog};
use crate::path_entry::{PathEntry, PathVerdict};
use crate::picture::names;
use crate::posing::{self, PairArgs, PoseFile, Posed};
use crate::preprocess::parse_threads;
use crate::sentence::{bracket, untold};
use crate::units::SizeCheck;
use crate::viewpoint::ViewArgs;
use crate::{output, picture};

/// Options of `distance`.
#[derive(Debug, Clone, Args)]
pub struct DistanceArgs {
    /// The scans and their poses
    #[command(flatten)]
    pub pair: PairArgs,
    /// The options for many poses
    #[command(flatten)]
    pub path: PathArgs,
    /// Metric of the kernel that defines the surfaces; by default the one the scans were prepared for
    ///
    /// With the geodesic kernel, no lower bound is proven.
    #[arg(long, value_enum, conflicts_with = "thickened", help_heading = "Research", hide_short_help = true)]
    pub kernel: Option<KernelName>,
    /// The meaning of the scans
    #[command(flatten)]
    pub meaning: MeaningArgs,
    /// Compare the triangles of these inputs instead of points
    ///
    /// With `both`, the distance is exact. With `a` or `b`, the other input is a scan. Like scans, meshes are
    /// hollow: what is wholly inside one is as far as from its faces.
    #[arg(long, value_enum, value_name = "WHICH")]
    pub as_mesh: Option<AsMeshName>,
    /// Stop when the bounds differ by at most this fraction of the upper bound; at least 0, less than 1
    ///
    /// If the distance is less than about the local spacing, the bounds may stay further apart. This
    /// option has no effect with --surface-only or --thickened.
    #[arg(long, value_name = "E", allow_hyphen_values = true, default_value_t = DistanceOptions::default().relative, value_parser = parse_relative, help_heading = "Budget and evidence")]
    pub relative: f64,
    /// Time limit for each query, such as 200us
    ///
    /// The unit is ns, us, ms or s. The bounds are valid whenever the search ends; with less
    /// time they are further apart.
    #[arg(long, value_name = "200us", allow_hyphen_values = true, value_parser = parse_duration, help_heading = "Budget and evidence")]
    pub budget: Option<Duration>,
    /// Work limit for each query; reproducible, unlike time
    ///
    /// A unit is one evaluation of f or one node pair; 1000 to 20000 is common.
    #[arg(long, value_name = "N", value_parser = parse_work, help_heading = "Budget and evidence")]
    pub work: Option<u64>,
    /// Threads to prepare raw inputs; 0 for all cores
    #[arg(long, value_name = "N", value_parser = parse_threads, help_heading = "Budget and evidence")]
    pub threads: Option<usize>,
    /// Draw both scans, the nearest places and the distance between them, as PNG
    #[arg(long, value_name = "OUT.png", conflicts_with = "poses", help_heading = "Output")]
    pub image: Option<PathBuf>,
    /// From where the picture is taken
    #[command(flatten)]
    pub view: ViewArgs,
    /// Print one JSON object for each query
    #[arg(long, help_heading = "Output")]
    pub json: bool,
    /// Show no progress
    #[arg(long, help_heading = "Output")]
    pub quiet: bool,
}

impl DistanceArgs {
    /// Fails if an option was given that does not apply to meshes.
    fn check_as_mesh(&self, which: AsMeshName) -> Result<(), CliError> {
        let of_meshes = which == AsMeshName::Both;
        let relative = DistanceOptions::default().relative;
        which.refuse(&[
            ("--kernel", of_meshes && self.kernel.is_some()),
            ("--surface-only", of_meshes && self.meaning.surface_only),
            ("--thickened", of_meshes && self.meaning.thickened.is_some()),
            ("--relative", of_meshes && self.relative.to_bits() != relative.to_bits()),
            ("--image", self.image.is_some()),
        ])
    }
}

/// The JSON output of `distance`.
#[derive(Debug, Serialize)]
struct DistanceReport {
    lower: f64,
    upper: f64,
    points: [[f64; 3]; 2],
    /// The local spacing of the scans where they are nearest, in world units.
    band: f64,
    /// The evidence of the upper bound.
    evidence: &'static str,
    source_a: u32,
    source_b: u32,
    /// `false` if the budget ended the search; absent otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    complete: Option<bool>,
    evaluations: u64,
    node_pairs: u64,
    leaf_pairs: u64,
    micros: f64,
}

/// The bodies and settings that all queries share.
struct Question<'a> {
    bodies: Bodies,
    plan: DistancePlan,
    args: &'a DistanceArgs,
    sizes: SizeCheck,
}

pub(crate) fn run(args: &DistanceArgs) -> Result<(), CliError> {
    if let Some(which) = args.as_mesh {
        args.check_as_mesh(which)?;
        if which == AsMeshName::Both {
            return of_meshes(args).run();
        }
    }
    let console = Console::new(args.quiet);
    if let Some(path) = &args.image {
        output::check_apart(path, &args.pair.inputs())?;
        picture::check_name(path)?;
    }
    args.path.check(&args.pair.inputs(), None)?;
    let matrices = args.pair.matrices()?;
    let mut poses = args.pair.pose_file(args.path.poses.as_ref())?;
    let inputs = args.pair.inputs();
    let opening = args.pair.opening(args.threads, console);
    let kernel = args.kernel.map(KernelName::metric);
    let bodies = match args.as_mesh {
        Some(which) => opening.open_mesh_and_scan(which, kernel, inputs)?,
        None if args.meaning.thickened.is_some() => Bodies::Scans(opening.open_points(inputs)?),
        None => Bodies::Scans(opening.open_both(kernel, inputs)?),
    };
    let plan = bodies.distance_plan(&options(args, bodies.scan()))?;
    let question = Question { bodies, plan, args, sizes: args.pair.size_check(console) };
    let mut results = Results::new();
    match &mut poses {
        Some(poses) => output::replace_if_any(args.path.csv.as_deref(), |csv| {
            let mut log = PathLog::new(&args.path, csv, false)?;
            let watch = poses.watch(console, &mut results);
            question.answer_all(poses, &mut log, &mut results)?;
            drop(watch);
            log.draw(&args.path, &names(inputs), 0.0)?;
            let unit = question.bodies.unit();
            if args.json { Ok(()) } else { results.line(log.summary(unit, 0.0)) }
        })?,
        None => {
            let poses = posing::of_options(&matrices, question.bodies.posable())?;
            question.answer(None, &poses, &mut Scratch::default(), &mut results)?;
        }
    }
    results.flush()
}

/// Returns the options of a query. `a` is the first scan.
pub(crate) fn options(args: &DistanceArgs, a: &Scan) -> DistanceOptions {
    DistanceOptions::default().with_semantics(args.meaning.semantics(a)).with_relative(args.relative)
}

/// Returns the same question about meshes.
fn of_meshes(args: &DistanceArgs) -> DistanceQuestion<'_> {
    let DistanceArgs { pair, path, budget, work, threads, json, quiet, .. } = args;
    let (budget, work, threads) = (*budget, *work, *threads);
    DistanceQuestion { pair, path, budget, work, threads, json: *json, quiet: *quiet }
}

impl Question<'_> {
    fn answer_all(
        &self,
        poses: &mut PoseFile,
        log: &mut PathLog<'_>,
        results: &mut Results,
    ) -> Result<(), CliError> {
        let mut scratch = Scratch::default();
        while let Some((line, text)) = poses.next_line()? {
            // Answers to the lines before a faulty one are written before the error.
            let read = poses.poses(line, &text, self.bodies.posable());
            let Posed { poses: poses_of_line, time } =
                read.or_else(|fault| results.flush().and(Err(fault)))?;
            let (found, micros) = self.answer(Some(line), &poses_of_line, &mut scratch, results)?;
            poses.answered();
            let verdict = if found.upper <= 0.0 { PathVerdict::Intersecting } else { PathVerdict::Separated };
            let (clearance, place) = (Some([found.lower, found.upper]), Some(found.points[0]));
            let (evidence, reason) = (Some(word(found.evidence)), None);
            log.add(PathEntry {
                line,
                time,
                verdict,
                evidence,
                reason,
                clearance,
                penetration: None,
                is_nested: false,
                place,
                micros,
            })?;
        }
        Ok(())
    }

    /// Answers the query for one pair of poses. Returns the distance and the time in microseconds.
    fn answer(
        &self,
        line: Option<u64>,
        poses: &[Pose; 2],
        scratch: &mut Scratch,
        results: &mut Results,
    ) -> Result<(Distance, f64), CliError> {
        let start = now();
        let views = self.bodies.at(poses);
        let mut budget = Budget::UNLIMITED;
        (budget.work, budget.deadline) =
            (self.args.work, self.args.budget.and_then(|time| start.checked_add(time)).map(Deadline::at));
        let found = views.distance(&self.plan, &budget, scratch);
        let micros = micros_since(start);
        views.compare_sizes(&self.sizes);
        if let Some((path, scans)) = self.args.image.as_ref().zip(views.scans()) {
            let style = picture::Style {
                names: names(self.args.pair.inputs()),
                points: self.args.meaning.thickened.is_some(),
                view: self.args.view,
                unit: self.args.pair.world_unit(),
            };
            output::save_picture(&paint_distance(scans, &found, &style), path)?;
        }
        if self.args.json {
            results.json(&report(&found, micros))?;
            return Ok((found, micros));
        }
        let sentence = sentence(&found, views.unit(), self.plan.options());
        if let Some(line) = line {
            results.line(format_args!("line {line}: {sentence}"))?;
            return Ok((found, micros));
        }
        results.line(sentence)?;
        let [of_a, of_b] = views.items();
        results.line(format_args!(
            "between {of_a} {} of a and {of_b} {} of b (counted from 0); {}",
            found.sources[0].0,
            found.sources[1].0,
            work(
                [
                    (found.statistics.node_pairs, "node pair"),
                    (found.statistics.leaf_pairs, "leaf pair"),
                    (found.statistics.evaluations, "evaluation"),
                ],
                micros
            )
        ))?;
        Ok((found, micros))
    }
}

fn report(found: &Distance, micros: f64) -> DistanceReport {
    DistanceReport {
        lower: found.lower,
        upper: found.upper,
        points: found.points,
        band: found.band,
        evidence: word(found.evidence),
        source_a: found.sources[0].0,
        source_b: found.sources[1].0,
        complete: (!found.complete).then_some(false),
        evaluations: found.statistics.evaluations,
        node_pairs: found.statistics.node_pairs,
        leaf_pairs: found.statistics.leaf_pairs,
        micros,
    }
}

/// Returns the distance as a sentence.
fn sentence(found: &Distance, unit: f64, options: &DistanceOptions) -> String {
    let semantics = options.semantics;
    let unfinished =
        if found.complete { "" } else { " The budget ran out; raise --budget or --work for tighter bounds." };
    if found.upper <= 0.0 {
        let untold = match semantics {
            Semantics::Thickened(_) => String::new(),
            _ => format!("; {}", untold(found.band)),
        };
        return format!("They touch ({}){untold}.{unfinished}", word(found.evidence));
    }
    let bracket = bracket(found, unit);
    match semantics {
        Semantics::Thickened(_) => format!("They are {bracket}.{unfinished}"),
        _ => format!(
            "They are {bracket} ({}); the scans themselves are known to their local spacing of {}.{}{unfinished}",
            word(found.evidence),
            rough(found.band),
            limited(found, options).unwrap_or_default()
        ),
    }
}

/// Returns a sentence if the spacing of the scans keeps the bounds further apart than
/// [`DistanceOptions::relative`].
fn limited(found: &Distance, options: &DistanceOptions) -> Option<String> {
    /// Allowance for rounding in the search.
    const ROUNDING: f64 = 1e-6;
    let apart = found.upper - found.lower;
    let is_met = apart <= (options.relative + ROUNDING) * found.upper;
    (options.semantics == Semantics::Obstacle && found.complete && !is_met).then(|| {
        format!(
            " The bounds stay {} apart, more than the {} % of --relative, because of this spacing.",
            rough(apart),
            short(100.0 * options.relative)
        )
    })
}

/// Parses a relative precision.
fn parse_relative(text: &str) -> Result<f64, String> {
    let relative = text.parse().ok().filter(|relative| (0.0..1.0).contains(relative));
    relative.ok_or_else(|| "expected a number of at least 0 and less than 1".into())
}
