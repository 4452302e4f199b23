//! `animate`: asks about a mesh or scan that deforms from frame to frame.

mod body;
mod frames;
mod kinetic;
mod moment;

use std::path::PathBuf;

pub use self::body::AnimateMethod;
use self::body::{Asking, Body, Still};
use self::frames::Frames;
use self::kinetic::KineticMeshes;
use self::moment::{Moment, Summary};
use crate::console::{Console, Results, now};
use crate::error::CliError;
use crate::input::Opening;
use crate::mesh::two_meshes::micros_since;
use crate::parse::parse_threads;
use crate::threads::pool;
use clap::Args;
use nearmiss::Renewal;

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

/// Parses a number of query times a second.
fn parse_rate(text: &str) -> Result<f64, String> {
    let rate = text.parse().ok().filter(|rate: &f64| *rate > 0.0 && *rate <= MOST_TIMES);
    rate.ok_or_else(|| format!("expected a number above 0 and at most {MOST_TIMES:e}, got `{text}`"))
}
