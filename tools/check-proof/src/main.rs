//! Checks the proofs of `nearmiss collide --prove` with none of the code that found them.
//!
//! * Separated: the node pairs cover all pairs of points, and their enclosures are disjoint, in
//!   interval arithmetic. For obstacles, the parts about their points that contain the obstacle may
//!   be disjoint instead: balls, cut by slabs on sheets.
//! * Intersecting: the witness is a zero of both functions, summed over all points in double
//!   precision. For obstacles, it is a zero in a cell, a place in a ball, or a measured point.
//! * Each scan: a million points of its surface are in the enclosures of the nodes of their nearest
//!   points; those in cells, and the balls, are in the enclosures of the obstacle. This is a test,
//!   not a proof; the proofs are in docs/theory/certificates.md and docs/theory/obstacle.md.
#![expect(clippy::print_stdout, clippy::print_stderr, reason = "a program for people")]

mod boxes;
mod claim;
mod cover;
mod interval;
mod neighbour;
mod placement;
mod proof;
mod sample;
mod subject;
mod surface;
mod witness;

#[cfg(test)]
mod trial;

use std::collections::BTreeSet;
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use clap::Parser;
use rayon::prelude::*;

use claim::{Checker, Finding, Kind};
use proof::{Line, Lines, Poses};
use subject::Subject;
use surface::Sampled;

/// Lines that are read before they are checked, on all threads.
const BATCH: usize = 256;

/// The maximum number of faults that are printed.
const NAMED: usize = 10;

/// Check the output of `nearmiss collide A B --prove PROOF`; exit status 0 only if everything holds
#[derive(Debug, Parser)]
#[command(name = "check-proof")]
struct Args {
    /// The file written by `--prove`
    proof: PathBuf,
    /// The first scan: preprocessed, or a raw input, preprocessed on the fly
    a: PathBuf,
    /// The second scan
    b: PathBuf,
    /// The file of poses of the queries, to check that the proof is about them
    #[arg(long, value_name = "FILE.jsonl")]
    poses: Option<PathBuf>,
    /// Points of each surface to look for in the enclosures
    #[arg(long, default_value_t = 1_000_000)]
    points: u64,
    /// Seed of the random places from which these points are projected
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Number of threads; 0 for all cores
    #[arg(long, default_value_t = 0)]
    threads: usize,
}

/// The result of a check.
type Outcome<T = ()> = Result<T, Box<dyn std::error::Error>>;

fn main() -> ExitCode {
    match run(&Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(args: &Args) -> Outcome {
    rayon::ThreadPoolBuilder::new().num_threads(args.threads).build_global()?;
    let faults = check(args)?;
    if faults > 0 {
        return Err(format!("expected a valid proof, got {faults} violations").into());
    }
    println!("every certified answer is proven");
    Ok(())
}

/// Prints the findings; returns the number of faults.
fn check(args: &Args) -> Outcome<usize> {
    let a = Subject::open(&args.a)?;
    let other = if args.a == args.b { None } else { Some(Subject::open(&args.b)?) };
    let b = other.as_ref().unwrap_or(&a);
    let poses = args.poses.as_deref().map(proof::read_poses).transpose()?;
    let checker = Checker { subjects: [&a, b], poses: poses.as_ref() };
    let mut faults = Faults::default();
    Tally::of(&args.proof, &checker, &mut faults)?.print(poses.as_ref());
    let scans = [(&args.a, Some(&a)), (&args.b, other.as_ref())];
    for (path, subject) in scans {
        if let Some(subject) = subject.filter(|_| args.points > 0) {
            let sampled = sample(path, subject, args);
            print_sampled(path, &sampled);
            faults.extend(&path.display().to_string(), sampled.faults);
        }
    }
    Ok(faults.count)
}

/// Faults: all are counted, some printed.
#[derive(Debug, Default)]
struct Faults {
    count: usize,
}

impl Faults {
    fn extend(&mut self, place: &str, faults: Vec<String>) {
        for fault in faults {
            if self.count < NAMED {
                println!("VIOLATION {place}: {fault}");
            }
            self.count += 1;
        }
    }
}

/// The findings of all lines.
#[derive(Debug, Default)]
struct Tally {
    lines: usize,
    separated: usize,
    intersecting: usize,
    pairs: usize,
    by_points: usize,
    claimed: f64,
    between: usize,
    off: f64,
    on_the_brink: usize,
    mended: f64,
    queries: BTreeSet<u64>,
}

impl Tally {
    /// Checks the lines of the file at `path`.
    fn of(path: &Path, checker: &Checker<'_>, faults: &mut Faults) -> Outcome<Self> {
        let mut lines = Lines::open(path)?;
        let mut tally = Self::default();
        loop {
            let batch = lines.batch(BATCH)?;
            if batch.is_empty() {
                break;
            }
            let check =
                |(_, text): &(u64, String)| Line::parse(text).map(|line| (line.query, checker.check(&line)));
            let found: Vec<Result<(u64, Finding), String>> = batch.par_iter().map(check).collect();
            for ((number, _), found) in batch.iter().zip(found) {
                let place = format!("line {number}");
                tally.lines += 1;
                match found {
                    Ok((query, finding)) => faults.extend(&place, tally.count(query, finding)),
                    Err(what) => faults.extend(&place, vec![what]),
                }
            }
        }
        if tally.lines == 0 {
            return Err(format!("{}: expected the lines of a proof, got none", path.display()).into());
        }
        Ok(tally)
    }

    /// Counts a line about this query; returns its faults.
    fn count(&mut self, query: u64, finding: Finding) -> Vec<String> {
        let mut faults = finding.faults;
        if !self.queries.insert(query) {
            faults.push(format!("expected one answer to query {query}, got two"));
        }
        self.separated += usize::from(finding.kind == Kind::Separated);
        self.intersecting += usize::from(finding.kind == Kind::Intersecting);
        self.pairs += finding.pairs;
        self.by_points += finding.by_points;
        self.claimed = self.claimed.max(finding.claimed);
        self.between += usize::from(finding.between);
        self.off = self.off.max(finding.off);
        self.on_the_brink += usize::from(finding.on_the_brink);
        self.mended = self.mended.max(finding.mended);
        faults
    }

    fn print(&self, poses: Option<&Poses>) {
        let Self { lines, separated, intersecting, pairs, by_points, claimed, .. } = self;
        let Self { between, off, on_the_brink, mended, .. } = self;
        let unproven = lines - separated - intersecting;
        println!("{lines} answers, {unproven} of them not certified");
        println!(
            "{separated} certified separations, proven by {pairs} node pairs, {by_points} of them by their points; a claimed gap is at \
             most {:.4} % of the proven one",
            100.0 * claimed
        );
        println!(
            "{intersecting} certified contacts, {between} of them by two surface points within the margin; points are at most \
             {off:.1e} bandwidths off the surface; {on_the_brink} meet a condition only up to rounding"
        );
        if let Some(poses) = poses {
            let unanswered = poses.keys().filter(|query| !self.queries.contains(query)).count();
            println!(
                "{} poses, {unanswered} without an answer; the poses of certified answers were corrected by at most {mended:.1e} \
                 sampling radii",
                poses.len()
            );
        }
    }
}

fn print_sampled(path: &Path, sampled: &Sampled) {
    let Sampled { starts, points, places, in_cells, fill, far, .. } = sampled;
    println!(
        "{}: {points} surface points from {starts} starts, and {places} starts with status ok; {in_cells} of them are in \
         the cell of a point; they reach at most {:.2} % of the half extent of an enclosure, and are at most {far:.3} local \
         radii from the nearest point",
        path.display(),
        100.0 * fill
    );
}

/// Checks points of a surface, with progress on a terminal.
fn sample(path: &Path, subject: &Subject, args: &Args) -> Sampled {
    let (done, ended) = (AtomicU64::new(0), AtomicBool::new(false));
    std::thread::scope(|scope| {
        let watcher = scope.spawn(|| watch(path, args.points, &done, &ended));
        let sampled = surface::check(subject, args.points, args.seed, &done);
        ended.store(true, Ordering::Relaxed);
        watcher.thread().unpark();
        sampled
    })
}

/// Shows the progress until the end; on a terminal only.
fn watch(path: &Path, points: u64, done: &AtomicU64, ended: &AtomicBool) {
    let mut out = std::io::stderr();
    let shown = out.is_terminal();
    while shown && !ended.load(Ordering::Relaxed) {
        // Progress is optional, so failing to show it is ignored.
        let _ =
            write!(out, "\r{}: {} of {points} surface points", path.display(), done.load(Ordering::Relaxed));
        std::thread::park_timeout(Duration::from_millis(200));
    }
    if shown {
        let _ = write!(out, "\r\x1b[K");
    }
}
