//! Checks of the answers of nearmiss, and of their cost.
//!
//! The status is 1 if a check fails. `verify --quick` runs every check that needs no data beyond
//! the repository's, as CI does.
#![expect(clippy::print_stdout, reason = "a program for people")]

mod agreement;
mod analytic;
mod answers;
mod calibration;
mod counts;
mod scans;
mod truth;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use nearmiss_benches::{Failure, guard};

/// Checks of the answers of nearmiss, and of their cost.
///
/// An object is a file, or `dragon-5k`, `dragon-23k` (shipped with the tests), or one of these
/// generated ones: `bumpy:POINTS`, `hall` (a frame of a laser scanner), `house` (a scanned building).
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
    /// Verdicts near contact, against the exact test of the mesh
    Agreement(agreement::Arguments),
    /// Verdicts on shapes with known answers, by family and noise
    Analytic(analytic::Arguments),
    /// Answers, against those on record: verdicts, evidence, distances, curves, shapes
    Answers(answers::Arguments),
    /// Likelihoods, against the frequency of contact where a budget ended the search
    Calibration(calibration::Arguments),
    /// Counts of instructions, by valgrind, against those on record
    Counts(counts::Arguments),
    /// Evidence and bounds of an object at random poses in scans of rooms
    Scans(scans::Arguments),
    /// Verdicts, against exact answers in a file
    Truth(truth::Arguments),
}

/// The arguments of the checks that `--quick` runs.
const QUICK: [&[&str]; 6] = [
    &["answers"],
    &["counts"],
    &["analytic"],
    &["analytic", "--certified"],
    &["agreement", "dragon-5k", "--poses", "300"],
    &["scans", "hall", "house"],
];

fn main() -> Result<ExitCode, Failure> {
    let is_clean = match Arguments::parse().command {
        None => quick()?,
        Some(command) => run(&command)?,
    };
    Ok(if is_clean { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Runs one check; returns `true` if it passes.
fn run(command: &Command) -> Result<bool, Failure> {
    match command {
        Command::Agreement(arguments) => agreement::run(arguments),
        Command::Analytic(arguments) => analytic::run(arguments),
        Command::Answers(arguments) => answers::run(arguments),
        Command::Calibration(arguments) => calibration::run(arguments),
        Command::Counts(arguments) => counts::run(arguments),
        Command::Scans(arguments) => scans::run(arguments),
        Command::Truth(arguments) => truth::run(arguments),
    }
}

/// Runs the checks of `--quick`; returns `true` if all pass.
fn quick() -> Result<bool, Failure> {
    let mut is_clean = true;
    for words in QUICK {
        println!("## {}", words.join(" "));
        let arguments = Arguments::try_parse_from([&["verify"], words].concat())?;
        let command = arguments.command.ok_or("expected a check, got none")?;
        if let (Command::Counts(_), Some(obstacle)) = (&command, guard::counts::obstacle()) {
            println!("skipped: {obstacle}");
            continue;
        }
        is_clean &= run(&command)?;
    }
    Ok(is_clean)
}
