//! `animate`: asks about a mesh or scan that deforms from frame to frame.

mod body;
mod film;
mod frames;
mod kinetic;
mod moment;
mod page;
mod solid;

use std::path::{Path, PathBuf};

pub use self::body::AnimateMethod;
use self::body::{Asking, Body, Following, Partner, Still};
use self::frames::Frames;
use self::kinetic::KineticMeshes;
use self::moment::{Moment, Summary};
use crate::console::{Console, Results, now};
use crate::digits::short;
use crate::error::CliError;
use crate::input::Opening;
use crate::mesh::two_meshes::micros_since;
use crate::parse::parse_threads;
use crate::threads::pool;
use crate::viewpoint::ViewArgs;
use crate::{output, picture};
use clap::Args;
use nearmiss::Renewal;

/// Options of `animate`.
#[derive(Debug, Clone, Args)]
pub struct AnimateArgs {
    /// Frames, one file each: meshes if the first file has faces, otherwise scans
    ///
    /// All frames have the same number of vertices or points, in the same order. Later frames of a
    /// mesh may be files without faces. Files are a second apart.
    #[arg(required = true)]
    pub frames: Vec<PathBuf>,
    /// Test against this scan or mesh: prepared (.nm), or a file, which is prepared on the fly
    ///
    /// Without --against and --against-frames, a mesh is tested against itself; a scan is only moved,
    /// not tested.
    #[arg(long, value_name = "SCAN", conflicts_with = "against_frames")]
    pub against: Option<PathBuf>,
    /// Test against these frames; their number must be that of the FRAMES
    #[arg(long, value_name = "F", num_args = 1..)]
    pub against_frames: Vec<PathBuf>,
    /// Method by which bounding volumes follow the motion
    #[arg(long, value_enum, default_value_t = AnimateMethod::Auto)]
    pub method: AnimateMethod,
    /// Queries per second; between two files, positions are interpolated linearly
    #[arg(long, value_name = "HZ", default_value_t = 1.0, allow_hyphen_values = true, value_parser = parse_rate)]
    pub rate: f64,
    /// Threads; 0 for all cores
    #[arg(long, value_name = "N", value_parser = parse_threads, help_heading = "Advanced", hide_short_help = true)]
    pub threads: Option<usize>,
    /// Check a prepared scan or mesh of --against in full before use: checksums and all values
    #[arg(long, help_heading = "Advanced", hide_short_help = true)]
    pub verify: bool,
    /// Draw the bodies at up to eight query times, coloured by their clearance, as PNG
    #[arg(long, value_name = "OUT.png", help_heading = "Output")]
    pub image: Option<PathBuf>,
    /// From where the pictures are taken
    #[command(flatten)]
    pub view: ViewArgs,
    /// Write an HTML page with the same pictures, and plots of events, update time and query time
    #[arg(long, value_name = "OUT.html", help_heading = "Output")]
    pub html: Option<PathBuf>,
    /// Print one JSON object for each query time
    #[arg(long, help_heading = "Output")]
    pub json: bool,
    /// Show no progress
    #[arg(long, help_heading = "Output")]
    pub quiet: bool,
}

/// The greatest number of query times.
const MOST_TIMES: f64 = 1e9;

/// The least number of query times between two files at which kinetic trees are considered: every file
/// is a knot of all plans, at which all certificates are computed again.
const OFTEN: f64 = 8.0;

pub(crate) fn run(args: &AnimateArgs) -> Result<(), CliError> {
    // All of it on a thread of the pool, so that each move wakes only the others.
    pool(args.threads.unwrap_or(0))?.install(|| run_here(args))
}

fn run_here(args: &AnimateArgs) -> Result<(), CliError> {
    let console = Console::new(args.quiet);
    let inputs: Vec<&Path> =
        args.frames.iter().chain(&args.against).chain(&args.against_frames).map(PathBuf::as_path).collect();
    for path in args.image.iter().chain(&args.html) {
        output::check_apart(path, &inputs)?;
    }
    args.image.as_deref().map(picture::check_name).transpose()?;
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
    let partner = match (&others, &still) {
        (Some(others), _) => Partner::Moving(others),
        (None, Some(still)) => Partner::Still(still),
        (None, None) => Partner::Nothing,
    };
    let following = if is_kinetic(args, &frames, partner, console)? { None } else { args.method.following() };
    let mut told = Told::new(args);
    let times = times(args.rate, frames.last());
    match following {
        None => told.follow_events(&frames, partner, times)?,
        Some(following) => told.follow_frames(&frames, partner, following, times)?,
    }
    told.finish(&frames, partner, console)
}

/// Returns `true` if kinetic trees follow the motion: if they are asked for, or by default if a trial of
/// both shows that they take less time than refitting. Verdicts are the same.
fn is_kinetic(
    args: &AnimateArgs,
    frames: &Frames,
    partner: Partner<'_>,
    console: Console,
) -> Result<bool, CliError> {
    if args.method != AnimateMethod::Auto {
        return Ok(args.method == AnimateMethod::Kinetic);
    }
    let are_meshes = frames.triangles.is_some()
        && match partner {
            Partner::Moving(others) => others.triangles.is_some(),
            Partner::Still(still) => matches!(still, Still::Mesh(_)),
            Partner::Nothing => true,
        };
    if !are_meshes || args.rate < OFTEN || frames.len() < 2 {
        return Ok(false);
    }
    let mut refitting = Told { is_quiet: true, ..Told::new(args) };
    let moments = [0.0, 1.0 / args.rate].into_iter();
    refitting.follow_frames(frames, partner, Following::Refit, moments)?;
    let per_time: f64 = refitting.summary.last().iter().sum();
    // From the first file to the second, the knot between them included, unless that takes longer.
    let kinetic = KineticMeshes::new(frames, partner)?.first_second(args.rate * per_time)?;
    // Moving by events takes a time for each second, everything else for each query time.
    let crossover = kinetic.and_then(|kinetic| {
        let saved = per_time - kinetic.query_micros;
        (saved > 0.0).then(|| kinetic.update_micros / saved)
    });
    let is_kinetic = crossover.is_some_and(|crossover| args.rate > crossover);
    console.note(format_args!(
        "{} at {} query times a second; kinetic trees take less time {}",
        if is_kinetic { "kinetic trees" } else { "refitting" },
        short(args.rate),
        match (crossover, kinetic) {
            (Some(crossover), _) => format!("from about {} on", short(crossover)),
            (None, Some(_)) => "at no rate".into(),
            (None, None) => "at higher rates, if at all".into(),
        }
    ));
    Ok(is_kinetic)
}

/// The results about the query times.
struct Told<'a> {
    args: &'a AnimateArgs,
    results: Results,
    summary: Summary,
    /// The query times, if they are shown later.
    moments: Vec<Moment>,
    /// `true` for a trial, about which nothing is told.
    is_quiet: bool,
}

impl<'a> Told<'a> {
    fn new(args: &'a AnimateArgs) -> Self {
        Self {
            args,
            results: Results::new(),
            summary: Summary::default(),
            moments: Vec::new(),
            is_quiet: false,
        }
    }

    /// Moves meshes through all query times by events.
    fn follow_events(
        &mut self,
        frames: &Frames,
        partner: Partner<'_>,
        mut times: impl Iterator<Item = f64>,
    ) -> Result<(), CliError> {
        let mut meshes = KineticMeshes::new(frames, partner)?;
        times.try_for_each(|t| {
            let moment = meshes.at(t)?;
            self.tell(moment)
        })
    }

    /// Moves the bodies through all query times frame by frame.
    fn follow_frames(
        &mut self,
        frames: &Frames,
        partner: Partner<'_>,
        following: Following,
        times: impl Iterator<Item = f64>,
    ) -> Result<(), CliError> {
        let mut body = Body::first(frames)?;
        let mut other = partner.frames().map(Body::first).transpose()?;
        let (mut asking, mut vertices) = (Asking::default(), Vec::new());
        for t in times {
            let (mut bv_updates, mut rebuilt, mut update_micros) = (0, 0, 0.0);
            for (body, frames) in [(Some(&mut body), Some(frames)), (other.as_mut(), partner.frames())] {
                let (Some(body), Some(frames)) = (body, frames) else { continue };
                frames.at(t, &mut vertices);
                let start = now();
                let renewal = body.move_to(&vertices, following);
                let renewal = renewal.map_err(|cause| frames.fault(t, &cause))?;
                update_micros += micros_since(start);
                bv_updates += body.nodes() as u64;
                rebuilt += usize::from(renewal == Renewal::Rebuilt);
            }
            let start = now();
            let found = match (&other, partner) {
                (Some(other), _) => Some(asking.of_two(&body, other)?),
                (None, Partner::Still(still)) => Some(asking.against(&body, still)?),
                _ => asking.of_itself(&body),
            };
            let query_micros = micros_since(start);
            self.tell(Moment { t, bv_updates, events: 0, rebuilt, update_micros, query_micros, found })?;
        }
        Ok(())
    }

    fn tell(&mut self, moment: Moment) -> Result<(), CliError> {
        self.summary.add(&moment);
        if self.is_quiet {
            return Ok(());
        }
        if self.args.image.is_some() || self.args.html.is_some() {
            self.moments.push(moment);
        }
        moment.print(self.args.json, &mut self.results)
    }

    /// Writes the summary, the pictures and the page.
    fn finish(mut self, frames: &Frames, partner: Partner<'_>, console: Console) -> Result<(), CliError> {
        let Self { args, moments, .. } = &self;
        if args.image.is_some() || args.html.is_some() {
            let bar = console.spinner("painting the motion");
            let film = film::paint(frames, partner, moments, &args.view)?;
            if let Some(path) = &args.image {
                output::save_picture(&film, path)?;
            }
            if let Some(path) = &args.html {
                let name = frames
                    .first()
                    .0
                    .file_name()
                    .map_or_else(String::new, |name| name.to_string_lossy().into());
                let text = self.summary.text();
                output::replace_plain(path, |out| page::write(&name, &text, &film, moments, out))?;
            }
            drop(bar);
        }
        if !args.json {
            self.results.line(self.summary.text())?;
        }
        self.results.flush()
    }
}

/// Returns the query times up to `last`.
#[expect(clippy::cast_precision_loss, reason = "the last frame is found exactly")]
fn times(rate: f64, last: f64) -> impl Iterator<Item = f64> {
    (0_u64..).map(move |i| i as f64 / rate).take_while(move |t| *t <= last)
}

/// Parses a number of query times a second.
fn parse_rate(text: &str) -> Result<f64, String> {
    let rate = text.parse().ok().filter(|rate: &f64| *rate > 0.0 && *rate <= MOST_TIMES);
    rate.ok_or_else(|| format!("expected a number above 0 and at most {MOST_TIMES:e}, got `{text}`"))
}
