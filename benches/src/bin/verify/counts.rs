//! Compares instruction counts with those on record.

use std::fs;
use std::path::Path;

use nearmiss_benches::Failure;
use nearmiss_benches::guard::counts::{self, Scenario};
use rayon::prelude::*;

/// Greatest ratio of a count to that on record which passes.
const MOST: f64 = 1.03;

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Only these scenarios
    scenarios: Vec<String>,
    /// Rewrite the record
    #[arg(long)]
    record: bool,
    /// Run these scenarios, for valgrind to count
    #[arg(long, conflicts_with = "record", hide = true)]
    run: bool,
}

/// The ratio of two counts.
#[expect(clippy::cast_precision_loss, reason = "a ratio for people")]
fn ratio(count: u64, before: u64) -> f64 {
    count as f64 / before as f64
}

/// Returns `true` if no scenario exceeds its count on record by too much, and no vector instruction is
/// called as a function.
pub(crate) fn run(arguments: &Arguments) -> Result<bool, Failure> {
    if arguments.run {
        for name in &arguments.scenarios {
            Scenario::named(name)?.run()?;
        }
        return Ok(true);
    }
    let (only, record) = (&arguments.scenarios, arguments.record);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("record/counts.csv");
    let old = fs::read_to_string(&path).unwrap_or_default();
    let on_record = |name: &str| {
        let count = old.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(','));
        count.and_then(|count| count.parse::<u64>().ok())
    };
    let program = std::env::current_exe()?;
    let is_wanted = |name: &str| only.is_empty() || only.iter().any(|wanted| wanted == name);
    // Counts depend little on what else runs: opening a file may take a few more. The least of three is
    // compared with a count on record that is exceeded.
    let count = |(scenario, name): (Scenario, &str)| -> Result<Option<u64>, String> {
        let counted = || {
            let count = counts::count(scenario, &program, &["counts", "--run", name]);
            count.map_err(|cause| cause.to_string())
        };
        let first = is_wanted(name).then(counted).transpose()?;
        match (first, on_record(name)) {
            (Some(first), Some(before)) if ratio(first, before) > MOST => {
                Ok(Some(first.min(counted()?).min(counted()?)))
            }
            _ => Ok(first),
        }
    };
    let counts: Vec<Option<u64>> = Scenario::ALL.into_par_iter().map(count).collect::<Result<_, _>>()?;
    let (mut is_clean, mut new) = (true, String::from("scenario,instructions\n"));
    println!("| scenario | instructions | on record | ratio |\n| --- | --: | --: | --: |");
    for ((_, name), count) in Scenario::ALL.into_iter().zip(counts) {
        let before = on_record(name);
        if let Some(count) = count.or(before) {
            new += &format!("{name},{count}\n");
        }
        let Some(count) = count else { continue };
        match before {
            Some(before) => {
                let ratio = ratio(count, before);
                println!("| {name} | {count} | {before} | {ratio:.3} |");
                is_clean &= ratio <= MOST;
            }
            None => println!("| {name} | {count} | | |"),
        }
    }
    if record {
        fs::write(&path, new)?;
    }
    let called = counts::called_instructions(&program)?;
    for name in &called {
        println!("called as a function, by code without its instruction set: {name}");
    }
    Ok((record || is_clean) && called.is_empty())
}
