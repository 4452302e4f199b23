//! `distance`: how far two scans are apart.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use nearmiss::{
    Budget, Deadline, Distance, DistanceOptions, DistancePlan, DistanceScratch, Evidence, Pose, Scan,
    ScanView, Semantics, distance_with,
};
use serde::Serialize;

use crate::collide::{parse_duration, parse_radius};
use crate::console::{Console, Results, now};
use crate::digits::{count, rounded, rounded_down, short};
use crate::error::CliError;
use crate::eval::KernelName;
use crate::input;
use crate::posing::{self, PairArgs};
use crate::preprocess::parse_threads;
use crate::report::word;
use crate::sentence::world_radius;
use crate::units::SizeCheck;

/// Options of `distance`.
#[derive(Debug, Clone, Args)]
pub struct DistanceArgs {
    /// What is asked about
    #[command(flatten)]
    pub pair: PairArgs,
    /// A query a line, {"a":[16 numbers],"b":[16 numbers]}, as `poses` makes them; an answer a line, in order
    #[arg(long, value_name = "FILE.jsonl", conflicts_with_all = ["pose_a", "pose_b"])]
    pub poses: Option<PathBuf>,
    /// Which distances define the surfaces; by default as prepared, else straight ones. By the geodesic kernel no lower bound is
    /// proven
    #[arg(long, value_enum, conflicts_with = "thickened")]
    pub kernel: Option<KernelName>,
    /// Between balls of this radius about the points, in world units, instead of surfaces: exact
    #[arg(long, value_name = "RADIUS", allow_hyphen_values = true, value_parser = parse_radius)]
    pub thickened: Option<f64>,
    /// Time for each query, often 50us to 1ms: a number with ns, us, ms or s. The bounds are then further apart
    #[arg(long, value_name = "200us", allow_hyphen_values = true, value_parser = parse_duration)]
    pub budget: Option<Duration>,
    /// Work units for each query, evaluations of f and node pairs, often 1000 to 20000; reproducible, unlike time
    #[arg(long, value_name = "N")]
    pub work: Option<u64>,
    /// Threads to prepare raw inputs, 0 for all cores
    #[arg(long, value_name = "N", value_parser = parse_threads)]
    pub threads: Option<usize>,
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
    let matrices = args.pair.matrices()?;
    let mut poses = args.pair.pose_file(args.poses.as_ref())?;
    let inputs = args.pair.inputs();
    let threads = args.threads.unwrap_or(0);
    let [a, b] = if args.thickened.is_some() {
        let a = input::open(inputs[0], threads, console)?;
        let b = if inputs[0] == inputs[1] { a.clone() } else { input::open(inputs[1], threads, console)? };
        [a, b]
    } else {
        input::open_both(args.kernel.map(KernelName::metric), inputs, threads, console)?
    };
    let semantics = args.thickened.map_or(Semantics::Surface, Semantics::Thickened);
    let options = DistanceOptions::default().with_semantics(semantics);
    let plan = DistancePlan::new(&options, &a, &b)?;
    let question = Question { scans: [&a, &b], plan, args, sizes: args.pair.size_check(console) };
    let mut scratch = DistanceScratch::default();
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
        scratch: &mut DistanceScratch,
        results: &mut Results,
    ) -> Result<(), CliError> {
        let start = now();
        let [a, b] = [self.scans[0].at(&poses[0]), self.scans[1].at(&poses[1])];
        let mut budget = Budget::UNLIMITED;
        (budget.work, budget.deadline) =
            (self.args.work, self.args.budget.and_then(|time| start.checked_add(time)).map(Deadline::at));
        let found = distance_with(&a, &b, &self.plan, &budget, scratch);
        #[expect(clippy::cast_precision_loss, reason = "nanoseconds of less than a month are exact")]
        let micros = start.elapsed().as_nanos() as f64 / 1e3;
        self.sizes.compare([&a, &b]);
        if self.args.json {
            return results.json(&report(&found, micros));
        }
        let sentence = sentence(&found, [&a, &b]);
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
fn sentence(found: &Distance, views: [&ScanView<'_>; 2]) -> String {
    let [ra, rb] = views.map(world_radius);
    let unit = ra.min(rb) / 100.0;
    let unfinished = if found.complete { "" } else { " The budget ran out first." };
    if found.upper <= 0.0 {
        return format!("They touch ({}).{unfinished}", word(found.evidence));
    }
    let upper = rounded(found.upper + 0.5 * unit, unit);
    if found.lower.to_bits() == found.upper.to_bits() {
        return format!("They are {} apart.{unfinished}", short(found.upper));
    }
    let estimated = if found.evidence == Evidence::Estimated { ", as far as can be told" } else { "" };
    let lower = if found.lower > 0.0 {
        format!("at least {} and ", rounded_down(found.lower, unit))
    } else {
        String::new()
    };
    format!("They are {lower}at most {upper} apart{estimated}.{unfinished}")
}
