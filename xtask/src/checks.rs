//! `cargo xtask test`: all checks, each with a name and its running time.

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::repository::{Outcome, cargo, members, root, run, run_cargo};
use crate::{integrations, tidy};

type Check = fn() -> Outcome;

/// The checks, the quickest first.
const CHECKS: [(&str, Check); 10] = [
    ("tidy", tidy::run),
    ("format", || run_cargo(&["fmt", "--all", "--check"])),
    ("tests", || run_cargo(&["test", "--workspace", "--quiet"])),
    ("integrations", integrations::run),
    ("verify", verify),
    ("lints", || run_cargo(&["clippy", "--workspace", "--all-targets", "--quiet", "--", "-D", "warnings"])),
    ("docs", docs),
    ("features", features),
    ("packages", tidy::packages),
    ("determinism", determinism),
];

/// Runs the named checks, or all.
pub(crate) fn run_named(names: &[&str]) -> Outcome<Vec<(&'static str, Duration)>> {
    if let Some(unknown) = names.iter().find(|name| CHECKS.iter().all(|(known, _)| known != *name)) {
        let known: Vec<&str> = CHECKS.iter().map(|(name, _)| *name).collect();
        return Err(format!("expected one of {}, got `{unknown}`", known.join(", ")).into());
    }
    let mut times = Vec::new();
    for (name, check) in CHECKS {
        if names.is_empty() || names.contains(&name) {
            println!("— {name}");
            let start = now();
            check().map_err(|error| format!("check `{name}`: {error}"))?;
            times.push((name, start.elapsed()));
        }
    }
    Ok(times)
}

pub(crate) fn run_and_report(names: &[&str]) -> Outcome {
    let times = run_named(names)?;
    for (name, time) in &times {
        println!("{name:12} {:6.1} s", time.as_secs_f64());
    }
    println!("all {} checks passed", times.len());
    Ok(())
}

#[expect(clippy::disallowed_methods, reason = "a program may read the clock")]
fn now() -> Instant {
    Instant::now()
}

/// Checks the output of `collide --prove` with these arguments of `check-proof`.
pub(crate) fn check_proof(words: &[&str]) -> Outcome {
    run_cargo(&[&["run", "--release", "--quiet", "-p", "check-proof", "--"], words].concat())
}

/// Returns a command of a release program that is built already, beside this one.
fn beside(name: &str) -> Outcome<Command> {
    let program = format!("{name}{}", std::env::consts::EXE_SUFFIX);
    Ok(Command::new(std::env::current_exe()?.with_file_name(program)))
}

/// Verifies answers, counts and shapes with known answers; then the proofs of a scan near itself.
fn verify() -> Outcome {
    // Together with the command line, since they then have the features of this program and share its
    // libraries.
    let packages = ["-p", "nearmiss-benches", "-p", "check-proof", "-p", "nearmiss-cli"];
    let programs = ["--bin", "verify", "--bin", "check-proof"];
    run_cargo(&[&["build", "--release", "--quiet"][..], &packages, &programs].concat())?;
    run(beside("verify")?.arg("--quick"), "verify")?;
    let folder = root().join("target").join("proofs");
    std::fs::create_dir_all(&folder)?;
    let path = |name: &str| folder.join(name).to_string_lossy().into_owned();
    let (scan, poses, proof) = (path("dragon.nm"), path("poses.jsonl"), path("proofs.jsonl"));
    let cloud = root().join("testdata/data/dragon-5k.ply").to_string_lossy().into_owned();
    for words in [
        &["preprocess", &cloud, "-o", &scan, "--quiet"][..],
        &["poses", &scan, &scan, "--near", "--per-distance", "200", "-o", &poses, "--quiet"],
        &["collide", &scan, &scan, "--poses", &poses, "--prove", &proof, "--json"],
    ] {
        // This program has the commands of `nearmiss`; building that as well would take a minute.
        run(Command::new(std::env::current_exe()?).args(words).stdout(Stdio::null()), "nearmiss")?;
    }
    let words = [&proof, &scan, &scan, "--poses", &poses, "--points", "100000"];
    run(beside("check-proof")?.args(words), "check-proof")
}

/// Builds the published docs, whose links must not lead to private items.
fn docs() -> Outcome {
    let mut command = cargo();
    command.args(["doc", "--workspace", "--no-deps", "--quiet"]).env("RUSTDOCFLAGS", "-D warnings");
    run(&mut command, "cargo doc")
}

/// Lints the published libraries without features; then the one that users add, with its default
/// ones. The lints of the workspace see all features, all of which the command line needs.
fn features() -> Outcome {
    let members = members()?;
    let published = members.iter().filter(|member| member.published && member.name != "nearmiss-cli");
    let packages = published.flat_map(|member| ["-p", member.name.as_str()]);
    let without = ["--quiet", "--no-default-features", "--", "-D", "warnings"];
    run_cargo(&["clippy"].into_iter().chain(packages).chain(without).collect::<Vec<_>>())?;
    run_cargo(&["clippy", "-p", "nearmiss", "--quiet", "--", "-D", "warnings"])
}

/// Checks that one thread and two, a debug and a release build (that of the tests, and this
/// program) write the same file.
fn determinism() -> Outcome {
    if cfg!(debug_assertions) {
        return Err("expected a release build, got a debug build; run it with `cargo xtask`".into());
    }
    run_cargo(&["test", "--workspace", "--no-run", "--quiet"])?;
    let release = std::env::current_exe()?;
    let target = release.ancestors().nth(2).ok_or("expected this program in a target folder")?;
    let debug = target.join("debug").join(format!("nearmiss{}", std::env::consts::EXE_SUFFIX));
    let folder = target.join("determinism");
    std::fs::create_dir_all(&folder)?;
    let scan = nearmiss_testdata::dragon::dragon_path(nearmiss_testdata::dragon::Dragon::Points5k);
    let mut files: Vec<(String, Vec<u8>)> = Vec::new();
    for (build, program) in [("debug", &debug), ("release", &release)] {
        for threads in ["1", "2"] {
            let file = folder.join(format!("{build}-{threads}.nm"));
            let mut command = Command::new(program);
            command.arg("preprocess").arg(&scan).arg("-o").arg(&file);
            command.args(["--threads", threads, "--quiet", "--json"]).stdout(Stdio::null());
            run(&mut command, "nearmiss preprocess")?;
            files.push((format!("{build}, {threads} threads"), std::fs::read(&file)?));
        }
    }
    let (first, bytes) = &files[0];
    match files.iter().find(|(_, other)| other != bytes) {
        Some((other, _)) => {
            Err(format!("expected identical files, got different ones from {first} and from {other}").into())
        }
        None => Ok(()),
    }
}
