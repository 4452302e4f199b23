//! `cargo xtask …`: the commands of `nearmiss` on a fresh checkout, and repository chores.
//!
//! * `demo` — the main use on a real scan, with a table and a picture.
//! * `tidy` — checks that compilers do not make; `ci` — every check, as `test` without names.
//! * `tables` — Table 1 and the plots of Klein & Zachmann 2004, those of Klein & Zachmann 2005, and
//!   tables and plots of dos Anjos et al. 2012, measured.
//! * `test [tidy|format|tests|integrations|verify|lints|docs|features|packages|determinism …]` — every
//!   check, or the named ones.
//! * `wheel` — the wheel of the Python package; `c-library FOLDER` — the C library, ready to link with.
//! * `geodesic` — a picture of the graph of a scan, coloured by the distance from a point along it.
//! * `inventory [COMMIT]` — the size of the libraries, compared with an earlier commit.
//! * `level` — a picture of levels of a hierarchy: samples and the balls that cover their nodes.
//! * `check-proof` — check the output of `collide --prove`.
//! * `field` — f over a slice of a noisy scan, and how often its normal changes sides.
//! * `readers` — install third-party readers, whose points a test compares with ours.
//! * `fuzz [TARGET] [SECONDS]` — run the readers on inputs from a fuzzer; see fuzz/README.md.
//! * anything else — the command of `nearmiss`: `cargo xtask preprocess scan.ply -o scan.nm`.
#![expect(clippy::print_stdout, clippy::print_stderr, reason = "a program for people")]

mod checks;
mod circles;
mod demo;
mod field;
mod fuzz;
mod geodesic;
mod integrations;
mod inventory;
mod level;
mod readers;
mod repository;
mod tables;
mod tidy;
mod words;

use std::process::ExitCode;

/// A chore of the repository: name, arguments, description.
type Chore = (&'static str, &'static str, &'static str);

const CHORES: [Chore; 14] = [
    (
        "demo",
        "",
        "Preprocess a real scan and sweep two copies past each other; prints a table, draws a picture",
    ),
    (
        "test",
        "[CHECK…]",
        "Run all checks, or these: tidy, format, tests, integrations, verify, lints, docs, features, packages, \
         determinism",
    ),
    ("tidy", "", "Run the check `tidy`"),
    ("ci", "", "Run all checks"),
    (
        "geodesic",
        "[SCAN] [--from POINT] [-o FILE.png]",
        "Draw the graph of a scan, coloured by the distance along it from a point",
    ),
    (
        "inventory",
        "[COMMIT]",
        "Count files, lines, circles, public items and loops of the libraries, beside those of a commit",
    ),
    (
        "level",
        "[SCAN] [--depth L]… [-o FILE.png]",
        "Draw levels of the hierarchy of a scan: samples, and the balls that cover their nodes",
    ),
    ("check-proof", "PROOF A B [--poses F]", "Check the output of `collide A B --prove PROOF` independently"),
    (
        "field",
        "SCAN [--noise 0.1] [--table] -o OUT.png",
        "Draw f over a slice of a noisy scan; --table counts where its normal flips",
    ),
    (
        "tables",
        "-o FOLDER [--data FOLDER] [--2005] [--2012] [--only NUMBER] [--poses N] [--quick]",
        "Measure the tables and figures of Klein & Zachmann 2004 and 2005 and of Anjos et al. 2012",
    ),
    ("wheel", "[-o FOLDER]", "Build the wheel of the Python package, into target/wheels by default"),
    (
        "c-library",
        "FOLDER",
        "Build the C library: its header, shared and static library, pkg-config and CMake files, in a folder",
    ),
    ("readers", "", "Install independent readers, whose points a test compares with ours"),
    (
        "fuzz",
        "[TARGET] [SECONDS]",
        "Fuzz a target, or all of them, 60 seconds each by default: container, slices, lines, ply, pcd, obj, xyz, \
         las, e57, npy, stl, off, gltf",
    ),
];

fn usage() -> String {
    let mut text = "Usage: cargo xtask COMMAND\n\nCommands of nearmiss:\n".to_owned();
    let mut row = |name: &str, about: &str| {
        text += &format!("  {name:<12} {about}\n");
    };
    for (name, about) in nearmiss_cli::commands() {
        row(&name, &about);
    }
    text += "\nChores of the repository:\n";
    for (name, _, about) in CHORES {
        text += &format!("  {name:<12} {about}\n");
    }
    text + "\n`cargo xtask COMMAND --help` explains a command."
}

/// Returns the help of a chore, or `None` if it was not asked for.
fn help(words: &[&str]) -> Option<String> {
    let [name, .., "--help" | "-h"] = words else { return None };
    let (name, arguments, about) = CHORES.iter().find(|(chore, ..)| chore == name)?;
    Some(format!("{about}\n\nUsage: cargo xtask {name} {arguments}"))
}

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = args.iter().map(String::as_str).collect();
    if let Some(help) = help(&words) {
        println!("{help}");
        return ExitCode::SUCCESS;
    }
    let outcome = match words.as_slice() {
        [] => {
            eprintln!("{}", usage());
            return ExitCode::from(2);
        }
        ["--help" | "-h" | "help"] => {
            println!("{}", usage());
            Ok(())
        }
        ["demo"] => demo::run(),
        ["tidy"] => checks::run_and_report(&["tidy"]),
        ["ci"] => checks::run_and_report(&[]),
        ["check-proof", words @ ..] => checks::check_proof(words),
        ["field", ..] => field::run(std::env::args_os().skip(1)),
        ["geodesic", words @ ..] => geodesic::run(words),
        ["inventory", words @ ..] => inventory::run_with(words),
        ["level", words @ ..] => level::run(words),
        ["readers"] => readers::run(),
        ["wheel", words @ ..] => integrations::wheel(words),
        ["c-library", words @ ..] => integrations::c_library(words),
        ["fuzz", words @ ..] => fuzz::run(words),
        ["tables", words @ ..] => tables::run(words),
        ["test", names @ ..] => checks::run_and_report(names),
        _ => return nearmiss_cli::run(std::env::args_os()),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
