//! Scores verdicts against exact answers.
//!
//! Under a budget the best effort is scored.
//!
//! The check fails if a verdict outside the band |gap| ≤ r is wrong or missing, or a deep
//! separation is certified. With `--certified`, which asks for certificates, it also fails if fewer
//! than 95 % of the separations of at least 6 r are certified. A rival must be right on every pose,
//! because a mesh has no band of uncertainty.

use std::path::PathBuf;

use nearmiss::{BuildOptions, GraphOptions, Scan};
use nearmiss_benches::Failure;
use nearmiss_benches::asked::{Asking, Limits, best_effort};
use nearmiss_benches::clock::{nanoseconds, timed};
use nearmiss_benches::object::Object;
use nearmiss_benches::rivals::ours::Ours;
use nearmiss_benches::rivals::{self, Method};
use nearmiss_benches::sample::{Sample, count};
use nearmiss_benches::scorer::Score;
use nearmiss_benches::truth::{self, Question};

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The scan, which is compared with itself
    cloud: String,
    /// Poses with exact answers, one JSON object per line
    #[arg(value_name = "POSES.jsonl")]
    poses: PathBuf,
    /// A rival to score beside; repeatable
    #[arg(long = "rival", value_name = "NAME", value_parser = rivals::NAMES)]
    rivals: Vec<String>,
    /// Threads that preprocess the scan; 0 means all
    #[arg(long, value_name = "N", default_value_t = 0)]
    threads: usize,
    #[command(flatten)]
    asking: Asking,
    #[command(flatten)]
    limits: Limits,
}

/// Returns `true` if the check passes.
pub(crate) fn run(arguments: &Arguments) -> Result<bool, Failure> {
    let asked = arguments.asking.options();
    let object = Object::read(&arguments.cloud)?;
    let questions = truth::read(&arguments.poses, &object.cloud.bounds())?;
    println!("{}: {} points, r {:.6}, {} poses", object.name, object.cloud.len(), object.r, questions.len());

    let options = BuildOptions::default().with_threads(arguments.threads);
    let (scan, time) = timed(|| Scan::build(&object.cloud, &options));
    let mut scan = scan?;
    if matches!(asked.method, nearmiss::Method::Interpolation(_)) {
        scan = scan.with_graph(&object.cloud, &GraphOptions::default(), None)?;
    }
    println!("prepared in {time:.2?}, {:.2} % of the points usable", 100.0 * scan.usable());
    let score = score(&mut Ours::new(&scan, &asked)?.with_limits(arguments.limits), &questions, object.r);
    let mut clean = score.is_clean() && (!arguments.asking.certified || score.is_certified_enough());
    for name in &arguments.rivals {
        match rivals::rival(name, &object)? {
            Some(mut rival) => clean &= disagreements(rival.as_mut(), &questions, object.r) == 0,
            None => println!("expected a mesh for {name}, got none"),
        }
    }
    Ok(clean)
}

fn score(ours: &mut Ours<'_>, questions: &[Question], r: f64) -> Score {
    let mut score = Score::default();
    let mut times = Sample::default();
    let [mut node_pairs, mut leaf_pairs, mut evaluations] = [0; 3];
    for (index, question) in questions.iter().enumerate() {
        let (answer, time) = timed(|| ours.answer(&question.a, &question.b));
        times.push(nanoseconds(time));
        score.count(index, question, r, &best_effort(answer.verdict));
        node_pairs += answer.statistics.node_pairs;
        leaf_pairs += answer.statistics.leaf_pairs;
        evaluations += answer.statistics.evaluations;
    }
    println!("\n{}\n{score}", ours.name());
    let each = |total: u64| total / u64::try_from(questions.len().max(1)).unwrap_or(u64::MAX);
    let all = times.summary();
    println!(
        "mean {:.2} µs, p99 {:.2} µs; each {} node pairs, {} leaf pairs; {evaluations} evaluations in all",
        all.mean / 1e3,
        all.p99 / 1e3,
        each(node_pairs),
        each(leaf_pairs),
    );
    score
}

/// The number of answers that differ from the truth, inside the band or not.
fn disagreements(rival: &mut dyn Method, questions: &[Question], r: f64) -> usize {
    let mut times = Sample::default();
    println!("\n{}", rival.name());
    let mut wrong = 0;
    for (index, question) in questions.iter().enumerate() {
        let (reply, time) = timed(|| rival.ask(&question.a, &question.b));
        times.push(nanoseconds(time));
        if reply.hit != question.truth {
            wrong += 1;
            println!("  #{index} at {:+.3} r: {}", question.gap / r, reply.hit);
        }
    }
    let share = 100.0 * count(wrong) / count(questions.len().max(1));
    let mean = times.summary().mean / 1e3;
    println!("{wrong} of {} disagree ({share:.2} %), mean {mean:.2} µs", questions.len());
    wrong
}
