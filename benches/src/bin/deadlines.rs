//! How late queries with a deadline come back, beside a loop that does nothing but look at the clock until then.
//!
//! `deadlines [OBJECT] [--queries N] [--seed N]`
//!
//! The spin and the queries take turns, so that both have the same machine. Only queries that a deadline ended count.
#![expect(clippy::print_stdout, reason = "a program for people")]

use std::time::{Duration, Instant};

use nearmiss::{
    Budget, BuildOptions, CollideOptions, CollidePlan, CollideScratch, Deadline, Evidence, Method, Order,
    Pose, Reason, Sampling, Scan, Verdict, collide_with,
};
use nearmiss_benches::arguments::Arguments;
use nearmiss_benches::clock::now;
use nearmiss_benches::object::Object;
use nearmiss_benches::sample::{count, quantile};
use nearmiss_benches::{Failure, machine, poses};

/// Deadlines, in microseconds from the start of the query.
const MICROS: [u64; 6] = [20, 50, 100, 200, 500, 1000];

fn main() -> Result<(), Failure> {
    let mut arguments = Arguments::of_process();
    let queries = arguments.value("--queries")?.unwrap_or(4000);
    let seed = arguments.value("--seed")?.unwrap_or(4);
    let words = arguments.words()?;
    let object = Object::read(words.first().map_or("dragon-23k", String::as_str))?.scaled()?;
    println!("{}", machine::description());
    println!("{}, poses near contact, {queries} queries a row\n", object.name);
    let scan = Scan::build(&object.cloud, &BuildOptions::default())?;
    let poses: Vec<Pose> = poses::near(&object, 500, seed)?.iter().map(|near| near.pose).collect();
    let certified = CollideOptions::default().with_evidence(Evidence::Certified);
    let sampling = Method::Sampling(Sampling::default().with_test_points(4096));
    let margin = 8.0 * object.r;
    let asked = [
        ("traversal, certified, witness", certified),
        ("the same with a margin of 8 r", certified.with_margin(margin)),
        ("sampling", CollideOptions::default().with_method(sampling)),
        ("flat sampling", CollideOptions::default().with_method(flat(sampling))),
        ("order by sides", certified.with_order(Order::Sides)),
    ];
    println!(
        "| query | deadline µs | ended by it | late: median µs | p99 | p99.9 | a spin: p99 | p99.9 | longest stretch between \
         looks: median µs | p99.9 |\n| --- |{}",
        " --: |".repeat(9)
    );
    for (name, options) in asked {
        let plan = CollidePlan::new(&options, &scan, &scan)?;
        for micros in MICROS {
            let time = Duration::from_micros(micros);
            let mut scratch = CollideScratch::default();
            let (mut late, mut spun, mut stretches) = (Vec::new(), Vec::new(), Vec::new());
            for i in 0..queries {
                let views = [scan.at(&Pose::IDENTITY), scan.at(&poses[i % poses.len()])];
                let end = now() + time;
                let budget = Budget::UNLIMITED.with_deadline(Deadline::at(end));
                let answer = collide_with(&views[0], &views[1], &plan, &budget, &mut scratch);
                let after = micros_since(end);
                if matches!(answer.verdict, Verdict::Undecided(Reason::Budget { .. })) {
                    late.push(after);
                }
                stretches.push(scratch.longest_stretch().as_secs_f64() * 1e6);
                let end = now() + time;
                while now() < end {}
                spun.push(micros_since(end));
            }
            let ended = late.len();
            if ended < queries / 20 {
                continue;
            }
            let of = |sorted: &[f64], share| quantile(sorted, share);
            for times in [&mut late, &mut spun, &mut stretches] {
                times.sort_unstable_by(f64::total_cmp);
            }
            println!(
                "| {name} | {micros} | {:.0} % | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} |",
                100.0 * count(ended) / count(queries),
                of(&late, 0.5),
                of(&late, 0.99),
                of(&late, 0.999),
                of(&spun, 0.99),
                of(&spun, 0.999),
                of(&stretches, 0.5),
                of(&stretches, 0.999),
            );
        }
    }
    Ok(())
}

fn flat(method: Method) -> Method {
    match method {
        Method::Sampling(sampling) => Method::Sampling(sampling.with_flat(true)),
        other => other,
    }
}

/// Microseconds since an instant, negative before it.
fn micros_since(then: Instant) -> f64 {
    let now = now();
    let late = now.saturating_duration_since(then).as_secs_f64();
    let early = then.saturating_duration_since(now).as_secs_f64();
    1e6 * (late - early)
}
