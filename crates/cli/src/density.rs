//! `density`: how many points `--method interpolation --flat` has to draw for a wanted error rate.
//!
//! Measured as in S1 §5.1: the scan against a copy of itself over the sweep of `poses`, once for each
//! density; an error is a hit of the traversal that is not found, or the other way round. Derived from Lemma
//! 1: that each surfel gets a point, by inclusion and exclusion.

use std::path::PathBuf;

use clap::Args;
use nearmiss::query::points_for;
use nearmiss::{
    CollideOptions, CollidePlan, Density, Detail, Interpolation, Method, Pair, Pose, Scan, Scratch,
    SurfelSize,
};
use rayon::prelude::*;
use serde::Serialize;

use crate::console::{Bar, Console, Results};
use crate::digits::count;
use crate::error::CliError;
use crate::input::{self, Opening};
use crate::poses;
use crate::preprocess::parse_threads;

/// Options of `density`.
#[derive(Debug, Clone, Args)]
pub struct DensityArgs {
    /// Scan that was prepared with --graph, or a point cloud or mesh, which is prepared on the
    /// fly
    pub a: PathBuf,
    /// Largest share of wrong verdicts
    #[arg(long, value_name = "RATE", default_value_t = 0.001, value_parser = parse_rate)]
    pub error: f64,
    /// Number of surfels for the derived number of points
    #[arg(long, value_name = "A", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..=65_536))]
    pub surfels: u32,
    /// Poses at each of the 13 distances of the sweep
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..))]
    pub per_distance: u32,
    /// Measure brackets alone, as Klein & Zachmann 2005 do, without the searches that find what
    /// brackets miss
    #[arg(long, conflicts_with = "store")]
    pub brackets_alone: bool,
    /// Keep the measured number in the file, for `collide --method interpolation --flat`
    #[arg(long)]
    pub store: bool,
    /// Seed of everything random
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
    rate.ok_or_else(|| "expected a share of all tests, more than 0 and less than 1".into())
}

/// Finer than this no surface is cut.
const FINEST: u32 = 8192;

#[derive(Debug, Serialize)]
struct Report {
    /// Points to draw, measured.
    samples: u32,
    /// And for the wanted rate, derived.
    derived: u32,
    /// Of what was measured.
    error: f64,
    surfels: u32,
    tests: usize,
    hits: usize,
}

pub(crate) fn run(args: &DensityArgs) -> Result<(), CliError> {
    let console = Console::new(args.quiet);
    if args.store && !input::is_prepared(&args.a) {
        let what = "--store keeps the density in a prepared scan; prepare it first";
        return Err(CliError::Usage(what.into()));
    }
    let scan = Opening::new(true, console).open_with_graph(&args.a)?;
    let base = poses::normalised(&scan).ok_or_else(|| CliError::Unfit {
        path: args.a.clone(),
        what: "all points lie in one place, so it cannot be scaled to a size of 2".into(),
    })?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.threads).build();
    let pool = pool.or(Err(CliError::Threads(args.threads)))?;
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
                "{} of all tests are wrong however many points are drawn; nothing is stored",
                rate(found.error)
            );
            return Err(CliError::Unfit { path: args.a.clone(), what });
        }
        scan.with_density(found).save(&args.a)?;
    }
    let mut results = Results::new();
    if args.json {
        results.json(&report)?;
        return results.flush();
    }
    results.line(format_args!(
        "measured   {}, of {}, for {} wrong of {}, {} of which touch",
        count(u64::from(report.samples), "point"),
        count(u64::from(surfels), "surfel"),
        rate(report.error),
        count(report.tests as u64, "test"),
        report.hits
    ))?;
    if report.error > args.error {
        results
            .line(format_args!("           more than {}: finer surfels are not tried", rate(args.error)))?;
    }
    results.line(format_args!(
        "derived    {} for {} of which none is empty but in {}",
        count(u64::from(report.derived), "point"),
        count(u64::from(args.surfels), "surfel"),
        rate(args.error)
    ))?;
    results.flush()
}

/// A small share.
fn rate(share: f64) -> String {
    format!("{:.2} %", 100.0 * share)
}

/// Points that are drawn for so many surfels.
fn points(surfels: u32) -> u32 {
    search(surfels).points().unwrap_or(0)
}

fn search(surfels: u32) -> Interpolation {
    Interpolation::default().with_flat(true).with_surfels(SurfelSize::Count(surfels))
}

/// Questions whose answers the traversal knows.
struct Tests<'a> {
    scan: &'a Scan,
    base: &'a Pose,
    poses: &'a [Pose],
    bar: &'a Bar,
}

impl Tests<'_> {
    /// The fewest surfels, and with them points, that err no more than is wanted; and how many tests touch.
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
        // Errors do not fall evenly; what is found is one of the densities that suffice, and the last tried
        // below does not.
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
        let options = CollideOptions::default().with_detail(Detail::Verdict).with_method(method);
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
