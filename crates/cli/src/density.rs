//! `density`: finds the number of random points that `--method interpolation --flat` needs for an
//! error rate.
//!
//! The number is measured as in Klein & Zachmann 2005, section 5.1: the scan is tested against a
//! copy of itself over the sweep of `poses`, once for each density. An error is a contact that only
//! one of traversal and interpolation finds. The number is also derived from Lemma 1 of that paper,
//! the probability that each surfel gets a point, by inclusion and exclusion.

use std::path::PathBuf;

use clap::Args;
use nearmiss::query::points_for;
use nearmiss::{
    CollideOptions, CollidePlan, Density, Detail, GraphOptions, Interpolation, Method, Pair, Pose, Scan,
    Scratch, SurfelSize,
};
use rayon::prelude::*;
use serde::Serialize;

use crate::console::{Bar, Console, Results};
use crate::digits::count;
use crate::error::CliError;
use crate::input::{self, Opening};
use crate::poses;
use crate::preprocess::parse_threads;
use crate::threads::pool;

/// Options of `density`.
#[derive(Debug, Clone, Args)]
pub struct DensityArgs {
    /// Scan that was prepared with --graph, or a point cloud or mesh, which is prepared on the
    /// fly
    pub a: PathBuf,
    /// Largest share of wrong verdicts
    #[arg(long, value_name = "RATE", default_value_t = 0.001, value_parser = parse_rate)]
    pub error: f64,
    /// Number of surfels for a comparison with theory: the number of points that theory derives from it
    /// is reported beside the measured one
    #[arg(long, value_name = "A", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..=65_536))]
    pub surfels: u32,
    /// Poses at each of the 13 distances of `poses --sweep`
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..))]
    pub per_distance: u32,
    /// Measure brackets alone, as Klein & Zachmann 2005 do, without the further searches for contacts
    /// that brackets miss
    #[arg(long, conflicts_with = "store")]
    pub brackets_alone: bool,
    /// Keep the measured number in the file, for `collide --method interpolation --flat`
    #[arg(long)]
    pub store: bool,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Threads; 0 for all cores; the numbers do not depend on it
    #[arg(long, value_name = "N", value_parser = parse_threads, default_value = "0")]
    pub threads: usize,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
    /// Show no progress
    #[arg(long)]
    pub quiet: bool,
}

fn parse_rate(text: &str) -> Result<f64, String> {
    let rate = text.parse().ok().filter(|rate: &f64| *rate > 0.0 && *rate < 1.0);
    rate.ok_or_else(|| "expected a share of the tests of more than 0 and less than 1".into())
}

/// The largest number of surfels that is tried.
const FINEST: u32 = 8192;

#[derive(Debug, Serialize)]
struct Report {
    /// The measured number of points.
    samples: u32,
    /// The number of points derived from Lemma 1, for `--surfels`.
    derived: u32,
    /// The measured error rate with `samples` points.
    error: f64,
    surfels: u32,
    tests: usize,
    hits: usize,
}

pub(crate) fn run(args: &DensityArgs) -> Result<(), CliError> {
    let console = Console::new(args.quiet);
    if args.store && !input::is_prepared(&args.a) {
        let path = args.a.display();
        let what = format!(
            "{path}: expected a prepared scan for --store, got a raw input; run `preprocess --graph` first"
        );
        return Err(CliError::Usage(what));
    }
    let scan = Opening::new(true, console).open_with_graph(&args.a, &GraphOptions::default())?;
    let base = poses::normalised(&scan).ok_or_else(|| CliError::UnsuitableFile {
        path: args.a.clone(),
        what: "expected a scan with an extent, got points at one place only".into(),
    })?;
    let pool = pool(args.threads)?;
    let poses: Vec<Pose> = poses::sweep(args.per_distance, args.seed, &base).collect();
    let bar = console.steps("measuring", u64::from(FINEST.ilog2()) * poses.len() as u64);
    let tests = Tests { scan: &scan, base: &base, poses: &poses, bar: &bar };
    let (found, hits) = pool.install(|| tests.coarsest(args))?;
    drop(bar);
    let surfels = found.surfels;
    let report = Report {
        samples: points(surfels),
        derived: points_for(args.surfels, args.error),
        error: found.error,
        surfels,
        tests: poses.len(),
        hits,
    };
    if args.store {
        if found.error > args.error {
            let what = format!(
                "expected at most {} wrong verdicts, got {} at the largest number of points, so nothing is stored; \
                 raise --error",
                rate(args.error),
                rate(found.error)
            );
            return Err(CliError::UnsuitableFile { path: args.a.clone(), what });
        }
        scan.with_density(found).save(&args.a)?;
    }
    let mut results = Results::new();
    if args.json {
        results.json(&report)?;
        return results.flush();
    }
    results.line(format_args!(
        "measured   {} on {}: {} of {} wrong, {} with contact",
        count(u64::from(report.samples), "point"),
        count(u64::from(surfels), "surfel"),
        rate(report.error),
        count(report.tests as u64, "test"),
        report.hits
    ))?;
    if report.error > args.error {
        results
            .line(format_args!("           above {}, but more surfels are not tried", rate(args.error)))?;
    }
    results.line(format_args!(
        "derived    {} on {}: a surfel without a point in {} of the tests",
        count(u64::from(report.derived), "point"),
        count(u64::from(args.surfels), "surfel"),
        rate(args.error)
    ))?;
    results.flush()
}

/// Formats a small share.
fn rate(share: f64) -> String {
    format!("{:.2} %", 100.0 * share)
}

/// Returns the number of points that are drawn for a number of surfels.
fn points(surfels: u32) -> u32 {
    search(surfels).points().unwrap_or(0)
}

fn search(surfels: u32) -> Interpolation {
    Interpolation::default().with_flat(true).with_surfels(SurfelSize::Count(surfels))
}

/// Tests whose results are compared with those of the traversal.
struct Tests<'a> {
    scan: &'a Scan,
    base: &'a Pose,
    poses: &'a [Pose],
    bar: &'a Bar,
}

impl Tests<'_> {
    /// Returns the smallest number of surfels found with at most the error rate `--error`, and the
    /// number of tests with contact.
    fn coarsest(&self, args: &DensityArgs) -> Result<(Density, usize), CliError> {
        let touching = self.verdicts(Method::Traversal)?;
        let error = |surfels: u32| {
            let search = search(surfels).with_seed(args.seed);
            let search = if args.brackets_alone { search.with_approaches(0) } else { search };
            let found = self.verdicts(Method::Interpolation(search))?;
            let wrong = found.iter().zip(&touching).filter(|(a, b)| a != b).count();
            #[expect(clippy::cast_precision_loss, reason = "far fewer than 2⁵²")]
            let error = wrong as f64 / touching.len().max(1) as f64;
            Ok::<_, CliError>(Density { surfels, error })
        };
        let mut coarse = 0;
        let mut fine = error(1)?;
        while fine.error > args.error && fine.surfels < FINEST {
            coarse = fine.surfels;
            fine = error(2 * fine.surfels)?;
        }
        // The error is not monotonic. The result is sufficient, and the next smaller number tried
        // is not, but still smaller ones may be.
        while fine.error <= args.error && fine.surfels - coarse > 1 + fine.surfels / 16 {
            let middle = error(coarse + (fine.surfels - coarse) / 2)?;
            if middle.error <= args.error {
                fine = middle;
            } else {
                coarse = middle.surfels;
            }
        }
        Ok((fine, touching.iter().filter(|&&touch| touch).count()))
    }

    fn verdicts(&self, method: Method) -> Result<Vec<bool>, CliError> {
        let options = CollideOptions::estimated().with_detail(Detail::Verdict).with_method(method);
        let plan = CollidePlan::new(&options, self.scan, self.scan)?;
        let ask = |scratch: &mut Scratch, pose: &Pose| {
            let views = [self.scan.at(self.base), self.scan.at(pose)];
            self.bar.advance(1);
            let answer = Pair::new(views[0], views[1]).collide(&plan, scratch);
            answer.verdict.is_intersecting()
        };
        self.scan.make_ready();
        Ok(self.poses.par_iter().map_init(Scratch::default, ask).collect())
    }
}
