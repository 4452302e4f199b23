//! `animate`: asks about a mesh or scan that deforms from frame to frame.

mod body;
mod frames;
mod kinetic;

use std::path::PathBuf;

use clap::Args;
use nearmiss::Renewal;
use serde::Serialize;

pub use self::body::AnimateMethod;
use self::body::{Asking, Body, Found, Still};
use self::frames::Frames;
use self::kinetic::KineticMeshes;
use crate::console::{Console, Results, now};
use crate::digits::{count, short};
use crate::error::CliError;
use crate::input::Opening;
use crate::mesh::two_meshes::micros_since;
use crate::parse::parse_threads;
use crate::threads::pool;

/// Options of `animate`.
#[derive(Debug, Clone, Args)]
pub struct AnimateArgs {
    /// Frames, one file each: a mesh if the first one has faces, otherwise a scan
    ///
    /// All frames have the same number of vertices or points, in the same order. Later frames of a
    /// mesh may be files without faces. Files are a second apart.
    #[arg(required = true)]
    pub frames: Vec<PathBuf>,
    /// Test against this scan or mesh: prepared (.nm), or a file, which is prepared on the fly
    ///
    /// Without --against and --against-frames, a mesh is tested against itself, and a scan is moved
    /// without a test.
    #[arg(long, value_name = "SCAN", conflicts_with = "against_frames")]
    pub against: Option<PathBuf>,
    /// Test against these frames, as many as the others
    #[arg(long, value_name = "F", num_args = 1..)]
    pub against_frames: Vec<PathBuf>,
    /// How bounds follow the motion
    #[arg(long, value_enum, default_value_t = AnimateMethod::Auto)]
    pub method: AnimateMethod,
    /// Number of query times a second; between two files, positions are interpolated linearly
    #[arg(long, value_name = "HZ", default_value_t = 1.0, allow_hyphen_values = true, value_parser = parse_rate)]
    pub rate: f64,
    /// Threads; 0 for all cores
    #[arg(long, value_name = "N", value_parser = parse_threads, help_heading = "Advanced", hide_short_help = true)]
    pub threads: Option<usize>,
    /// Check a prepared --against in full before use: checksums, and every number
    #[arg(long, help_heading = "Advanced", hide_short_help = true)]
    pub verify: bool,
    /// Print one JSON object for each query time
    #[arg(long, help_heading = "Output")]
    pub json: bool,
    /// Show no progress
    #[arg(long, help_heading = "Output")]
    pub quiet: bool,
}

/// The JSON output of `animate`.
#[derive(Debug, Serialize)]
struct AnimateReport {
    t: f64,
    bv_updates: u64,
    events: u64,
    update_micros: f64,
    query_micros: f64,
    verdict: Option<&'static str>,
    evidence: Option<&'static str>,
}

/// The greatest number of query times.
const MOST_TIMES: f64 = 1e9;

pub(crate) fn run(args: &AnimateArgs) -> Result<(), CliError> {
    let console = Console::new(args.quiet);
    let frames = Frames::read(&args.frames, console)?;
    let others = match args.against_frames.as_slice() {
        [] => None,
        others => Some(Frames::read(others, console)?),
    };
    if let Some(others) = others.as_ref().filter(|others| others.len() != frames.len()) {
        return Err(CliError::Usage(format!(
            "--against-frames: expected as many frames as the others, {}, got {}; give a file for each",
            frames.len(),
            others.len()
        )));
    }
    let opening = Opening { threads: args.threads.unwrap_or(0), verify: args.verify, console };
    let still = args.against.as_deref().map(|path| Still::open(opening, path)).transpose()?;
    let pool = pool(opening.threads)?;
    let mut results = Results::new();
    animate(args, &pool, (&frames, others.as_ref(), still.as_ref()), &mut results)?;
    results.flush()
}

/// Moves the bodies through all query times.
fn animate(
    args: &AnimateArgs,
    pool: &rayon::ThreadPool,
    (frames, others, still): (&Frames, Option<&Frames>, Option<&Still>),
    results: &mut Results,
) -> Result<(), CliError> {
    let mut summary = Summary::default();
    let last = frames.last();
    #[expect(clippy::cast_precision_loss, reason = "the last frame is found exactly")]
    let times = (0_u64..).map(|i| i as f64 / args.rate).take_while(|t| *t <= last);
    let Some(following) = args.method.following() else {
        let mut meshes = KineticMeshes::new(frames, others, still)?;
        for t in times {
            let moment = meshes.at(t)?;
            summary.add(&moment);
            moment.print(args.json, results)?;
        }
        return if args.json { Ok(()) } else { results.line(summary.text()) };
    };
    let mut body = Body::first(frames)?;
    let mut other = others.map(Body::first).transpose()?;
    let (mut asking, mut vertices) = (Asking::default(), Vec::new());
    for t in times {
        let (mut bv_updates, mut rebuilt, mut update_micros) = (0, 0, 0.0);
        for (body, frames) in [(Some(&mut body), Some(frames)), (other.as_mut(), others)] {
            let (Some(body), Some(frames)) = (body, frames) else { continue };
            frames.at(t, &mut vertices);
            let start = now();
            let renewal = pool.install(|| body.move_to(&vertices, following));
            let renewal = renewal.map_err(|cause| frames.fault(t, &cause))?;
            update_micros += micros_since(start);
            bv_updates += body.nodes() as u64;
            rebuilt += usize::from(renewal == Renewal::Rebuilt);
        }
        let start = now();
        let found = match (&other, still) {
            (Some(other), _) => Some(asking.of_two(&body, other)?),
            (None, Some(still)) => Some(asking.against(&body, still)?),
            (None, None) => asking.of_itself(&body),
        };
        let query_micros = micros_since(start);
        let moment = Moment { t, bv_updates, events: 0, rebuilt, update_micros, query_micros, found };
        summary.add(&moment);
        moment.print(args.json, results)?;
    }
    if args.json { Ok(()) } else { results.line(summary.text()) }
}

/// One query time.
#[derive(Debug)]
struct Moment {
    t: f64,
    bv_updates: u64,
    events: u64,
    /// The number of bodies that were prepared anew.
    rebuilt: usize,
    update_micros: f64,
    query_micros: f64,
    found: Option<Found>,
}

impl Moment {
    fn print(&self, json: bool, results: &mut Results) -> Result<(), CliError> {
        let Self { t, bv_updates, events, update_micros, query_micros, found, .. } = *self;
        if json {
            let verdict = found.map(|found| found.verdict);
            let evidence = found.and_then(|found| found.evidence);
            let report =
                AnimateReport { t, bv_updates, events, update_micros, query_micros, verdict, evidence };
            return results.json(&report);
        }
        let said = found.map_or("moved".to_owned(), Found::words);
        results.line(format_args!(
            "{} s: {said} (moved in {} µs, asked in {} µs)",
            short(t),
            short(update_micros),
            short(query_micros)
        ))
    }
}

/// The verdicts and times of all query times.
#[derive(Debug, Default)]
struct Summary {
    verdicts: Vec<&'static str>,
    rebuilt: usize,
    events: u64,
    updates: Vec<f64>,
    queries: Vec<f64>,
}

impl Summary {
    fn add(&mut self, moment: &Moment) {
        self.verdicts.extend(moment.found.map(|found| found.verdict));
        self.rebuilt += moment.rebuilt;
        self.events += moment.events;
        self.updates.push(moment.update_micros);
        self.queries.push(moment.query_micros);
    }

    fn text(mut self) -> String {
        let times = count(self.updates.len() as u64, "query time");
        let of = |word: &str| self.verdicts.iter().filter(|verdict| **verdict == word).count();
        let verdicts = ["intersecting", "separated", "undecided"];
        let verdicts: Vec<String> = verdicts
            .map(|word| (of(word), word))
            .into_iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, word)| format!("{count} {word}"))
            .collect();
        let verdicts = if verdicts.is_empty() { "no test".to_owned() } else { verdicts.join(", ") };
        let (update, query) = (median(&mut self.updates), median(&mut self.queries));
        format!(
            "{times}: {verdicts}; {}; medians: moved in {} µs, asked in {} µs",
            if self.events > 0 {
                count(self.events, "event")
            } else {
                format!("prepared anew {}", count(self.rebuilt as u64, "time"))
            },
            short(update),
            short(query)
        )
    }
}

/// Returns the middle value; 0 if there is none.
fn median(values: &mut [f64]) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or_default()
}

/// Parses a number of query times a second.
fn parse_rate(text: &str) -> Result<f64, String> {
    let rate = text.parse().ok().filter(|rate: &f64| *rate > 0.0 && *rate <= MOST_TIMES);
    rate.ok_or_else(|| format!("expected a number above 0 and at most {MOST_TIMES:e}, got `{text}`"))
}
