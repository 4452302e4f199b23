//! Wrong answers by budget: the same leaf test in every order.
//!
//! If the budget ends the search, the best effort (the likelier verdict) counts. It is compared
//! with the meshes or, if an object has none, with the unlimited search. Poses are within 10 r of
//! first touch.

use std::time::Duration;

use nearmiss::{BuildOptions, CollideOptions, Detail, Pose, Scan};
use nearmiss_benches::asked::{Limits, ORDERS, best_effort};
use nearmiss_benches::clock::{nanoseconds, timed};
use nearmiss_benches::object::Object;
use nearmiss_benches::questions::{self, Asked, interval};
use nearmiss_benches::rivals::ours::Ours;
use nearmiss_benches::sample::count;
use nearmiss_benches::{Failure, machine};

/// Units of work. An evaluation of f′ counts as one unit too.
const WORK: [u64; 9] = [1, 4, 16, 32, 64, 128, 256, 1024, 4096];

/// Times, in microseconds.
const MICROS: [u64; 9] = [1, 2, 4, 8, 16, 32, 100, 400, 1600];

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Objects to measure: files, `dragon-5k`, `dragon-23k` or `bumpy:POINTS`
    #[arg(required = true, value_name = "OBJECT")]
    objects: Vec<String>,
    /// Poses near contact
    #[arg(long, value_name = "N", default_value_t = 1000)]
    near: usize,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 3)]
    seed: u64,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    println!("{}", machine::description());
    for source in &arguments.objects {
        let object = Object::read(source)?.scaled()?;
        let scan = Scan::build(&object.cloud, &BuildOptions::default())?;
        let questions = questions::asked(&object, &scan, arguments.near, 0, arguments.seed)?;
        println!(
            "## {}: {} points, {} poses near contact, {} of which meet\n",
            object.name,
            object.cloud.len(),
            questions.len(),
            questions.iter().filter(|asked| asked.meets).count()
        );
        println!("Wrong best-effort answers in percent, with their 95 % interval, by units of work\n");
        table(&scan, &questions, &WORK, |work| Limits { work: Some(work), ..Limits::default() })?;
        println!("\nThe same by time in µs\n");
        table(&scan, &questions, &MICROS, |micros| Limits {
            time: Some(Duration::from_micros(micros)),
            ..Limits::default()
        })?;
        println!();
    }
    Ok(())
}

fn table(
    scan: &Scan,
    questions: &[Asked],
    budgets: &[u64],
    limits: impl Fn(u64) -> Limits,
) -> Result<(), Failure> {
    let names: Vec<&str> = ORDERS.iter().map(|(name, _)| *name).collect();
    println!(
        "| budget | {} | mean µs of each |\n| --: |{} --: |",
        names.join(" | "),
        " --: |".repeat(names.len())
    );
    for budget in budgets.iter().map(|&budget| Some(budget)).chain([None]) {
        let limits = budget.map_or_else(Limits::default, &limits);
        let (mut cells, mut times) = (Vec::new(), Vec::new());
        for (_, order) in ORDERS {
            let options = CollideOptions::estimated().with_detail(Detail::Verdict).with_order(order);
            let mut ours = Ours::new(scan, &options)?.with_limits(limits);
            let (mut wrong, mut total) = (0, 0.0);
            for asked in questions {
                let (answer, time) = timed(|| ours.answer(&Pose::IDENTITY, &asked.pose));
                let verdict = best_effort(answer.verdict);
                wrong += usize::from(verdict.is_intersecting() != asked.meets);
                total += nanoseconds(time);
            }
            let share = 100.0 * count(wrong) / count(questions.len());
            let [low, high] = interval(wrong, questions.len()).map(|x| 100.0 * x);
            cells.push(format!("{share:.1} ({low:.1}–{high:.1})"));
            times.push(format!("{:.1}", total / 1e3 / count(questions.len())));
        }
        let budget = budget.map_or_else(|| String::from("none"), |budget| budget.to_string());
        println!("| {budget} | {} | {} |", cells.join(" | "), times.join(", "));
    }
    Ok(())
}
