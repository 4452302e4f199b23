//! Checks of what nearmiss answers, and of what that takes.
//!
//! `verify answers` and `verify counts` compare with what is on record; `--record` writes the record anew.
//! `verify --quick` runs every check that needs no data beyond the repository's, as CI does.
#![expect(clippy::print_stdout, reason = "a program for people")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use nearmiss_benches::Failure;
use nearmiss_benches::guard::counts::Scenario;
use nearmiss_benches::guard::{answers, cases, counts};

/// Of more instructions than this share of those on record is told as a fault.
const MOST: f64 = 1.03;

/// Checks of what nearmiss answers, and of what that takes.
#[derive(Debug, Parser)]
#[command(arg_required_else_help = true, args_conflicts_with_subcommands = true)]
struct Arguments {
    /// Run every check that needs no data beyond the repository's
    #[arg(long)]
    quick: bool,
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Compare answers with those on record: verdicts, evidence, distances, curves, shapes
    Answers {
        /// Ask also about the scans in this folder
        #[arg(long, value_name = "FOLDER")]
        data: Option<PathBuf>,
        /// Write the record anew
        #[arg(long)]
        record: bool,
    },
    /// Compare counts of instructions, by valgrind, with those on record
    Counts {
        /// Only these scenarios
        scenarios: Vec<String>,
        /// Write the record anew
        #[arg(long)]
        record: bool,
        /// Run one scenario, for valgrind to count
        #[arg(long, conflicts_with = "record", hide = true)]
        run: bool,
    },
}

fn main() -> Result<ExitCode, Failure> {
    let is_clean = match Arguments::parse().command {
        None => quick()?,
        Some(Command::Answers { data, record }) => compare_answers(data.as_deref(), record)?,
        Some(Command::Counts { scenarios, run: true, .. }) => {
            for name in &scenarios {
                Scenario::named(name)?.run()?;
            }
            true
        }
        Some(Command::Counts { scenarios, record, run: false }) => compare_counts(&scenarios, record)?,
    };
    Ok(if is_clean { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn quick() -> Result<bool, Failure> {
    let mut is_clean = compare_answers(None, false)?;
    match counts::obstacle() {
        None => is_clean &= compare_counts(&[], false)?,
        Some(obstacle) => println!("no counts: {obstacle}"),
    }
    Ok(is_clean)
}

/// Where records are.
fn records() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("record")
}

fn compare_answers(data: Option<&Path>, record: bool) -> Result<bool, Failure> {
    let mut all = cases::shipped()?;
    if let Some(folder) = data {
        all.extend(cases::of_folder(folder)?);
    }
    let mut is_clean = true;
    for case in &all {
        let path = records().join("answers").join(format!("{}.csv", case.name));
        let rows = answers::ask(case)?;
        if record {
            fs::write(&path, answers::written(&rows))?;
            println!("{}: {} answers recorded", case.name, rows.len());
            continue;
        }
        let text = fs::read_to_string(&path).map_err(|cause| format!("{}: {cause}", path.display()))?;
        let old = answers::read(&text).map_err(|cause| format!("{}: {cause}", path.display()))?;
        let faults = answers::faults(&rows, &old);
        println!("{}: {} answers, {} faults", case.name, rows.len(), faults.len());
        for fault in &faults {
            println!("  {fault}");
        }
        is_clean &= faults.is_empty();
    }
    Ok(is_clean)
}

fn compare_counts(only: &[String], record: bool) -> Result<bool, Failure> {
    let path = records().join("counts.csv");
    let old = fs::read_to_string(&path).unwrap_or_default();
    let on_record = |name: &str| {
        let count = old.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(','));
        count.and_then(|count| count.parse::<u64>().ok())
    };
    let program = std::env::current_exe()?;
    let (mut is_clean, mut new) = (true, String::from("scenario,instructions\n"));
    println!("| scenario | instructions | on record | ratio |\n| --- | --: | --: | --: |");
    for (scenario, name) in Scenario::ALL {
        if !only.is_empty() && !only.iter().any(|wanted| wanted == name) {
            if let Some(count) = on_record(name) {
                new += &format!("{name},{count}\n");
            }
            continue;
        }
        let count = counts::count(scenario, &program, &["counts", "--run", name])?;
        new += &format!("{name},{count}\n");
        match on_record(name) {
            Some(before) => {
                #[expect(clippy::cast_precision_loss, reason = "a ratio for people")]
                let ratio = count as f64 / before as f64;
                println!("| {name} | {count} | {before} | {ratio:.3} |");
                is_clean &= ratio <= MOST;
            }
            None => println!("| {name} | {count} | | |"),
        }
    }
    if record {
        fs::write(&path, new)?;
    }
    Ok(record || is_clean)
}
