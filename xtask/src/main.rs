//! `cargo xtask …`: the commands of `nearmiss` on a fresh checkout, and repository chores.
//!
//! * `demo` — the main use on a real scan, with a table and a picture.
//! * `tidy` — checks that compilers do not make; `ci` — every check, as `test` without names.
//! * `tables` — Table 1 and the plots of Klein & Zachmann 2004, those of Klein & Zachmann 2005, and
//!   tables and plots of dos Anjos et al. 2012, measured.
//! * `test [tidy|format|lints|docs|features|packages|tests|verify|determinism …]` — every check, or
//!   the named ones.
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
mod inventory;
mod level;
mod readers;
mod repository;
mod tables;
mod tidy;

use std::process::ExitCode;

const USAGE: &str = "\
usage: cargo xtask COMMAND

of the repository
  demo           prepare a real scan, sweep two copies past each other; a table and a picture
  test [CHECK…]  every check, or: tidy, format, tests, verify, lints, docs, features, packages, determinism
  tidy, ci       the first of them; all of them
  geodesic [SCAN] [--from POINT] [-o FILE.png]
                 a picture of its graph, coloured by the distance from a point along it
  inventory [COMMIT]
                 the size of the libraries: files, lines, circles, public items, descents; beside that of a commit
  level [SCAN] [--depth L]… [-o FILE.png]
                 a picture of levels of its hierarchy: samples and the balls that cover their nodes
  check-proof PROOF A B [--poses F]
                 whether what `collide A B --prove PROOF` wrote holds, by means of its own
  field SCAN [--noise 0.1] -o OUT.png
                 a picture of f over a slice of a noisy scan; --table counts where its normal flips
  tables -o FOLDER [--data FOLDER] [--2005] [--2012] [--only NUMBER] [--quick]
                 Table 1 and Figs 8 to 12 of Klein & Zachmann 2004, their paper of 2005, dos Anjos et al. 2012, measured
  readers        install readers of other people, whose points a test then compares with ours
  fuzz [TARGET] [SECONDS]
                 inputs made up by a fuzzer: container, slices, lines, ply, pcd, obj, xyz, las, e57, npy, stl, off, gltf; 60 s each

of nearmiss (`cargo xtask COMMAND --help` says more)
  preprocess, convert, inspect, eval, collide, curve, poses, export, sample, slices";

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = args.iter().map(String::as_str).collect();
    let outcome = match words.as_slice() {
        [] => {
            eprintln!("{USAGE}");
            return ExitCode::from(2);
        }
        ["--help" | "-h" | "help"] => {
            println!("{USAGE}");
            Ok(())
        }
        ["demo"] => demo::run(),
        ["tidy"] => checks::run(&["tidy"]),
        ["ci"] => checks::run(&[]),
        ["check-proof", words @ ..] => checks::check_proof(words),
        ["field", ..] => field::run(std::env::args_os().skip(1)),
        ["geodesic", words @ ..] => geodesic::run(words),
        ["inventory", words @ ..] => inventory::run_with(words),
        ["level", words @ ..] => level::run(words),
        ["readers"] => readers::run(),
        ["fuzz", words @ ..] => fuzz::run(words),
        ["tables", words @ ..] => tables::run(words),
        ["test", names @ ..] => checks::run(names),
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
