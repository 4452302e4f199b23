//! Overruns of queries with a deadline, compared with a loop that only reads the clock until the
//! deadline.
//!
//! The loop and the queries take turns, so both run under the same load. Only queries that a
//! deadline ended count.

use std::time::{Duration, Instant};

use nearmiss::{
    Budget, BuildOptions, CollideOptions, CollidePlan, Deadline, Evidence, Method, Order, Pair, Pose, Reason,
    Sampling, Scan, Scratch, Verdict,
};
use nearmiss_benches::clock::now;
use nearmiss_benches::object::Object;
use nearmiss_benches::sample::{count, quantile};
use nearmiss_benches::{Failure, machine, poses};

/// Deadlines, in microseconds from the start of the query.
const MICROS: [u64; 6] = [20, 50, 100, 200, 500, 1000];

/// Runs per pose; the least stretch counts.
const REPEATS: usize = 5;

/// Poses whose stretch is measured.
const STRETCHED: usize = 100;

/// Deadline of a run whose stretch is measured. Longer runs would always be interrupted by other load.
const LONG: Duration = Duration::from_millis(1);

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Object to measure: a file, `dragon-5k`, `dragon-23k` or `bumpy:POINTS`
    #[arg(default_value = "dragon-23k")]
    object: String,
    /// Queries per row of the table
    #[arg(long, value_name = "N", default_value_t = 4000)]
    queries: usize,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 4)]
    seed: u64,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let &Arguments { ref object, queries, seed } = arguments;
    let object = Object::read(object)?.scaled()?;
    println!("{}", machine::description());
    println!("{}, poses near contact, {queries} queries a row\n", object.name);
    let scan = Scan::build(&object.cloud, &BuildOptions::default())?;
    let poses: Vec<Pose> = poses::near(&object, 500, seed)?.iter().map(|near| near.pose).collect();
    let certified = CollideOptions::estimated().with_evidence(Evidence::Certified);
    let sampling = Method::Sampling(Sampling::default().with_test_points(1024));
    let margin = 8.0 * object.r;
    let asked = [
        ("traversal, certified, witness", certified),
        ("the same with a margin of 8 r", certified.with_margin(margin)),
        ("sampling", CollideOptions::estimated().with_method(sampling)),
        ("flat sampling", CollideOptions::estimated().with_method(flat(sampling))),
        ("order by sides", certified.with_order(Order::Sides)),
    ];
    println!(
        "| query | deadline µs | ended by it | late: median µs | p99 | p99.9 | a spin: p99 | p99.9 |\n| --- |{}",
        " --: |".repeat(7)
    );
    for (name, options) in asked {
        let plan = CollidePlan::new(&options, &scan, &scan)?;
        for micros in MICROS {
            let time = Duration::from_micros(micros);
            let mut scratch = Scratch::default();
            let (mut late, mut spun) = (Vec::new(), Vec::new());
            for i in 0..queries {
                let views = [scan.at(&Pose::IDENTITY), scan.at(&poses[i % poses.len()])];
                let end = now() + time;
                let budget = Budget::UNLIMITED.with_deadline(Deadline::at(end));
                let answer = Pair::new(views[0], views[1]).within(&budget).collide(&plan, &mut scratch);
                let after = micros_since(end);
                if matches!(answer.verdict, Verdict::Undecided(Reason::Budget { .. })) {
                    late.push(after);
                }
                let end = now() + time;
                while now() < end {}
                spun.push(micros_since(end));
            }
            let ended = late.len();
            if ended < queries / 20 {
                continue;
            }
            let of = |sorted: &[f64], share| quantile(sorted, share);
            for times in [&mut late, &mut spun] {
                times.sort_unstable_by(f64::total_cmp);
            }
            println!(
                "| {name} | {micros} | {:.0} % | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} |",
                100.0 * count(ended) / count(queries),
                of(&late, 0.5),
                of(&late, 0.99),
                of(&late, 0.999),
                of(&spun, 0.99),
                of(&spun, 0.999),
            );
        }
    }
    println!(
        "\nLongest stretch of a query between two looks at the clock, the least of {REPEATS} runs of a millisecond, which leaves out \
         what the machine takes away\n\n| query | median µs | p99 | p99.9 | longest |\n| --- |{}",
        " --: |".repeat(4)
    );
    for (name, options) in asked {
        let plan = CollidePlan::new(&options, &scan, &scan)?;
        let mut stretches: Vec<f64> =
            poses.iter().take(STRETCHED).map(|pose| stretch(&scan, &plan, pose)).collect();
        stretches.sort_unstable_by(f64::total_cmp);
        let [median, most, more, longest] = [0.5, 0.99, 0.999, 1.0].map(|share| quantile(&stretches, share));
        println!("| {name} | {median:.2} | {most:.2} | {more:.2} | {longest:.2} |");
    }
    Ok(())
}

/// The longest time between two clock reads of a query, in microseconds.
fn stretch(scan: &Scan, plan: &CollidePlan, pose: &Pose) -> f64 {
    let mut scratch = Scratch::default();
    let ask = |scratch: &mut Scratch| {
        let views = [scan.at(&Pose::IDENTITY), scan.at(pose)];
        let budget = Budget::UNLIMITED.with_deadline(Deadline::within(LONG));
        Pair::new(views[0], views[1]).within(&budget).collide(plan, scratch);
        1e6 * scratch.longest_stretch().as_secs_f64()
    };
    (0..REPEATS).map(|_| ask(&mut scratch)).fold(f64::INFINITY, f64::min)
}

fn flat(method: Method) -> Method {
    match method {
        Method::Sampling(sampling) => Method::Sampling(sampling.with_flat(true)),
        other => other,
    }
}

/// Microseconds since an instant; negative if the instant is in the future.
fn micros_since(then: Instant) -> f64 {
    let now = now();
    let late = now.saturating_duration_since(then).as_secs_f64();
    let early = then.saturating_duration_since(now).as_secs_f64();
    1e6 * (late - early)
}
