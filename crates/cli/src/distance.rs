//! `distance`: how far two scans are apart.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use nearmiss::{
    Budget, Deadline, Distance, DistanceOptions, DistancePlan, Pair, Placed, Pose, Scan, Scratch, Semantics,
};
use serde::Serialize;

use crate::console::{Console, Results, now};
use crate::digits::{count, rough};
use crate::distance_picture::paint_distance;
use crate::error::CliError;
use crate::eval::KernelName;
use crate::meaning::MeaningArgs;
use crate::parse::parse_duration;
use crate::picture::names;
use crate::posing::{self, PairArgs};
use crate::preprocess::parse_threads;
use crate::report::word;
use crate::sentence::{bracket, unit, untold};
use crate::units::SizeCheck;
use crate::viewpoint::ViewArgs;
use crate::{output, picture};

/// Options of `distance`.
#[derive(Debug, Clone, Args)]
pub struct DistanceArgs {
    /// What is asked about
    #[command(flatten)]
    pub pair: PairArgs,
    /// A query a line, {"a":[16 numbers],"b":[16 numbers]}, as `poses` makes them; an answer a line, in order
    #[arg(long, value_name = "FILE.jsonl", conflicts_with_all = ["pose_a", "pose_b"])]
    pub poses: Option<PathBuf>,
    /// Which distances define the surfaces; by default as prepared, else straight ones. By the geodesic
    /// kernel no lower bound is proven
    #[arg(long, value_enum, conflicts_with = "thickened")]
    pub kernel: Option<KernelName>,
    /// The meaning of the scans
    #[command(flatten)]
    pub meaning: MeaningArgs,
    /// Obstacles only: the search stops when the lower bound is this share of the upper one below it, 0 to
    /// less than 1. Within about the local spacing of contact the bounds may stay further apart
    #[arg(long, value_name = "E", allow_hyphen_values = true, default_value_t = DistanceOptions::default().relative, value_parser = parse_relative)]
    pub relative: f64,
    /// Time for each query, often 50us to 1ms: a number with ns, us, ms or s. The bounds are then further
    /// apart
    #[arg(long, value_name = "200us", allow_hyphen_values = true, value_parser = parse_duration)]
    pub budget: Option<Duration>,
    /// Work units for each query, evaluations of f and node pairs, often 1000 to 20000; reproducible, unlike
    /// time
    #[arg(long, value_name = "N")]
    pub work: Option<u64>,
    /// Threads to prepare raw inputs, 0 for all cores
    #[arg(long, value_name = "N", value_parser = parse_threads)]
    pub threads: Option<usize>,
    /// Picture, as PNG, of both scans, the two nearest places, and the lengths between
    #[arg(long, value_name = "OUT.png", conflicts_with = "poses")]
    pub image: Option<PathBuf>,
    /// From where the picture is taken
    #[command(flatten)]
    pub view: ViewArgs,
    /// One object of JSON a query instead of sentences
    #[arg(long)]
    pub json: bool,
    /// No progress on the terminal
    #[arg(long)]
    pub quiet: bool,
}

/// What `distance` finds.
#[derive(Debug, Serialize)]
struct DistanceReport {
    lower: f64,
    upper: f64,
    points: [[f64; 3]; 2],
    /// Nothing is promised of where the scanned things are within it.
    band: f64,
    /// Of the upper bound.
    evidence: &'static str,
    source_a: u32,
    source_b: u32,
    /// False where the budget ended the search, else not said.
    #[serde(skip_serializing_if = "Option::is_none")]
    complete: Option<bool>,
    evaluations: u64,
    node_pairs: u64,
    leaf_pairs: u64,
    micros: f64,
}

/// What is the same for all queries.
struct Question<'a> {
    scans: [&'a Scan; 2],
    plan: DistancePlan,
    args: &'a DistanceArgs,
    sizes: SizeCheck,
}

pub(crate) fn run(args: &DistanceArgs) -> Result<(), CliError> {
    let console = Console::new(args.quiet);
    if let Some(path) = &args.image {
        output::check_apart(path, &args.pair.inputs())?;
        picture::check_name(path)?;
    }
    let matrices = args.pair.matrices()?;
    let mut poses = args.pair.pose_file(args.poses.as_ref())?;
    let inputs = args.pair.inputs();
    let opening = args.pair.opening(args.threads, console);
    let [a, b] = if args.meaning.thickened.is_some() {
        opening.open_points(inputs)?
    } else {
        opening.open_both(args.kernel.map(KernelName::metric), inputs)?
    };
    let semantics = args.meaning.semantics(&a);
    let options = DistanceOptions::default().with_semantics(semantics).with_relative(args.relative);
    let plan = DistancePlan::new(&options, &a, &b)?;
    let question = Question { scans: [&a, &b], plan, args, sizes: args.pair.size_check(console) };
    let mut scratch = Scratch::default();
    let mut results = Results::new();
    match &mut poses {
        Some(poses) => {
            while let Some((line, text)) = poses.next_line()? {
                // What was answered before a faulty line is told before the fault.
                let read = poses.poses(line, &text, question.scans);
                let placed = read.or_else(|fault| results.flush().and(Err(fault)))?;
                question.answer(Some(line), &placed, &mut scratch, &mut results)?;
            }
        }
        None => {
            let placed = posing::of_options(&matrices, question.scans)?;
            question.answer(None, &placed, &mut scratch, &mut results)?;
        }
    }
    results.flush()
}

impl Question<'_> {
    fn answer(
        &self,
        line: Option<u64>,
        poses: &[Pose; 2],
        scratch: &mut Scratch,
        results: &mut Results,
    ) -> Result<(), CliError> {
        let start = now();
        let [a, b] = [self.scans[0].at(&poses[0]), self.scans[1].at(&poses[1])];
        let mut budget = Budget::UNLIMITED;
        (budget.work, budget.deadline) =
            (self.args.work, self.args.budget.and_then(|time| start.checked_add(time)).map(Deadline::at));
        let found = Pair::new(a, b).within(&budget).distance(&self.plan, scratch);
        #[expect(clippy::cast_precision_loss, reason = "nanoseconds of less than a month are exact")]
        let micros = start.elapsed().as_nanos() as f64 / 1e3;
        self.sizes.compare([&a, &b]);
        if let Some(path) = &self.args.image {
            let style = picture::Style {
                names: names(self.args.pair.inputs()),
                points: self.args.meaning.thickened.is_some(),
                view: self.args.view,
                unit: self.args.pair.world_unit(),
            };
            paint_distance([&a, &b], &found, &style).save(path)?;
        }
        if self.args.json {
            return results.json(&report(&found, micros));
        }
        let sentence = sentence(&found, [&a, &b], self.plan.options().semantics);
        if let Some(line) = line {
            return results.line(format_args!("line {line}: {sentence}"));
        }
        results.line(sentence)?;
        results.line(format_args!(
            "between point {} of a and point {} of b, counted from 0; {}, {}, {}, {micros:.1} µs",
            found.sources[0].0,
            found.sources[1].0,
            count(found.statistics.node_pairs, "node pair"),
            count(found.statistics.leaf_pairs, "leaf pair"),
            count(found.statistics.evaluations, "evaluation"),
        ))
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

/// The distance, for people.
fn sentence(found: &Distance, views: [&Placed<'_>; 2], semantics: Semantics) -> String {
    let unfinished = if found.complete { "" } else { " The budget ran out first." };
    if found.upper <= 0.0 {
        let untold = match semantics {
            Semantics::Thickened(_) => String::new(),
            _ => format!("; {}", untold(found.band)),
        };
        return format!("They touch ({}){untold}.{unfinished}", word(found.evidence));
    }
    let bracket = bracket(found, unit(views));
    match semantics {
        Semantics::Thickened(_) => format!("They are {bracket}.{unfinished}"),
        _ => format!(
            "They are {bracket} ({}), give or take the local spacing of {}.{unfinished}",
            word(found.evidence),
            rough(found.band)
        ),
    }
}

/// How far `a` and `b` are apart within a budget, to be told beside a separation.
pub(crate) fn beside(views: [&Placed<'_>; 2], semantics: Semantics, budget: &Budget) -> Option<Distance> {
    let options = DistanceOptions::default().with_semantics(semantics);
    let plan = DistancePlan::new(&options, views[0].scan(), views[1].scan()).ok()?;
    Some(Pair::new(*views[0], *views[1]).within(budget).distance(&plan, &mut Scratch::default()))
}

/// Reads a relative precision.
fn parse_relative(text: &str) -> Result<f64, String> {
    let relative = text.parse().ok().filter(|relative| (0.0..1.0).contains(relative));
    relative.ok_or_else(|| "expected a number from 0 to less than 1".into())
}
