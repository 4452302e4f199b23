//! `slices walk`: walks an avatar along a route.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use nearmiss::slices::{
    Back, CacheCounts, CacheOptions, Ended, Response, Route, SliceCache, Slide, Step, StoreError, Up,
    WalkError, Walker,
};
use serde::Serialize;

use super::avatar_args::AvatarArgs;
use super::refusal::misplaced;
use super::report::open;
use super::track::Track;
use super::walk_picture;
use crate::console::{self, Console, Results};
use crate::digits::{count, short};
use crate::error::CliError;
use crate::{output, picture};

/// Options of `slices walk`.
#[derive(Debug, Clone, Args)]
pub struct WalkArgs {
    /// Folder of the map
    pub folder: PathBuf,
    /// Route, as `{"start":[x,y,z],"points":[[x,y],…]}`
    ///
    /// The numbers of a point are its two horizontal coordinates, in the order of the input.
    #[arg(long, value_name = "FILE.json")]
    pub route: PathBuf,
    /// The avatar
    #[command(flatten)]
    pub avatar: AvatarArgs,
    /// Response to something in the way
    #[arg(long, value_enum, default_value_t = ResponseName::Back)]
    pub response: ResponseName,
    /// Slices kept in memory; by default 16
    ///
    /// A number that is too small for the height of the avatar is raised.
    #[arg(long, value_name = "N")]
    pub cache: Option<u32>,
    /// Load slices only when they are needed
    #[arg(long)]
    pub no_prefetch: bool,
    /// Draw the storeys from above with the route, and height over distance, as PNG
    #[arg(long, value_name = "OUT.png")]
    pub image: Option<PathBuf>,
    /// Write a line distance,x,y,z,blocked,falling for each step
    #[arg(long, value_name = "OUT.csv")]
    pub trace: Option<PathBuf>,
    /// Print one JSON object for each step
    ///
    /// The output is reproducible except for the stalls, which depend on the speed of loading
    /// ahead. With --no-prefetch they are reproducible too.
    #[arg(long)]
    pub json: bool,
    /// Show no progress
    #[arg(long)]
    pub quiet: bool,
}

/// The names of the responses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ResponseName {
    /// Stay at the last valid place, as in Anjos et al. 2012
    Back,
    /// Slide along the wall
    Slide,
}

/// A line of the JSON output.
#[derive(Debug, Serialize)]
struct StepLine {
    position: [f64; 3],
    blocked: bool,
    falling: bool,
    slices: [u32; 2],
    hits: u64,
    misses: u64,
    stalls: u64,
}

impl StepLine {
    fn new(step: &Step, counts: CacheCounts) -> Self {
        let Step { position, blocked, falling, slices } = *step;
        let CacheCounts { hits, misses, stalls } = counts;
        Self { position, blocked, falling, slices, hits, misses, stalls }
    }
}

pub(super) fn run(args: &WalkArgs) -> Result<(), CliError> {
    check_outputs(args)?;
    let route = read_route(args)?;
    let folder = open(&args.folder)?;
    let avatar = args.avatar.avatar(folder.grid())?;
    let cache =
        args.cache.map_or(CacheOptions::default(), |slices| CacheOptions::default().with_slices(slices));
    let cache = cache.with_prefetch(!args.no_prefetch);
    let mut cache = SliceCache::new(&folder, &cache, avatar.slices(folder.grid()));
    if let Some(asked) = args.cache.filter(|&asked| cache.capacity() > asked as usize) {
        let capacity = cache.capacity();
        console::warn(format_args!(
            "--cache {asked} is raised to {capacity}: the avatar needs as many slices at once"
        ));
    }
    let walker = match route.stand(&mut cache, &avatar) {
        Ok(walker) if !walker.is_falling() => walker,
        // The search for the nearest place may need any slice.
        Ok(_) | Err(StoreError::Walk(WalkError::Blocked { .. })) => {
            let (map, faults) = folder.load_all();
            faults.iter().for_each(console::warn);
            avatar
                .placed(&map, route.start)
                .map_err(|cause| misplaced(&args.route, "start", folder.grid(), &cause))?
        }
        Err(cause) => return Err(refused(args, cause)),
    };
    let (ended, tally, track) = walk(args, &route, &mut cache, walker)?;
    if let (Some(path), Some(track)) = (&args.image, &track) {
        let (map, faults) = folder.load_all();
        faults.iter().for_each(console::warn);
        let floors = map.storeys(&avatar).unwrap_or_default();
        output::save_picture(&walk_picture::paint(&map, track, &avatar, &floors), path)?;
    }
    if !args.json {
        let mut results = Results::new();
        results.line(sentence(ended, &route, &tally))?;
        let counts = cache.counts();
        results.line(format_args!(
            "{}, {} blocked, {} falling; slices: {}, {}, {}",
            count(tally.steps, "step"),
            tally.blocked,
            tally.falling,
            count(counts.hits, "hit"),
            format_args!("{} misses", counts.misses),
            count(counts.stalls, "stall"),
        ))?;
        results.flush()?;
    }
    Ok(())
}

/// Totals of a walk.
struct Tally {
    up: Up,
    /// The place of the feet, in the caller's coordinates.
    position: [f64; 3],
    /// Horizontal distance from the start.
    distance: f64,
    steps: u64,
    blocked: u64,
    falling: u64,
}

impl Tally {
    fn new(up: Up, start: [f64; 3]) -> Self {
        Self { up, position: start, distance: 0.0, steps: 0, blocked: 0, falling: 0 }
    }

    /// Returns the place of the feet, in the map's coordinates.
    fn place(&self) -> [f64; 3] {
        self.up.to_map(self.position)
    }

    fn add(&mut self, step: &Step) {
        let before = self.place();
        self.position = step.position;
        let now = self.place();
        self.distance += (now[0] - before[0]).hypot(now[1] - before[1]);
        self.steps += 1;
        self.blocked += u64::from(step.blocked);
        self.falling += u64::from(step.falling);
    }
}

/// Walks on and writes every step at once, as JSON and into the trace, if wanted. Keeps only the
/// steps that a picture needs.
fn walk(
    args: &WalkArgs,
    route: &Route,
    cache: &mut SliceCache,
    walker: Walker,
) -> Result<(Ended, Tally, Option<Track>), CliError> {
    let response: &dyn Response = match args.response {
        ResponseName::Back => &Back,
        ResponseName::Slide => &Slide,
    };
    let grid = *cache.map().grid();
    let mut tally = Tally::new(grid.up, walker.position(&grid));
    let mut track = args.image.as_ref().map(|_| Track::new(route, &grid, tally.place()));
    let mut results = Results::new();
    let _bar = Console::new(args.quiet).spinner("walking");
    let mut follow = |trace: &mut dyn FnMut(f64, &Step) -> Result<(), CliError>| {
        route.follow(cache, walker, response, |cache: &SliceCache, step| {
            let before = tally.position;
            tally.add(step);
            if let Some(track) = &mut track {
                track.add(tally.place(), tally.distance);
                // Sliding along something is no stop.
                if step.blocked && tally.position == before {
                    track.stop(tally.place(), tally.distance);
                }
            }
            if args.json {
                results.json(&StepLine::new(step, cache.counts()))?;
            }
            trace(tally.distance, step)
        })
    };
    let ended = match &args.trace {
        None => follow(&mut |_, _| Ok(()))?,
        Some(path) => output::replace(path, |out| {
            let failed = |cause| CliError::writing(path)(cause);
            writeln!(out, "distance,x,y,z,blocked,falling").map_err(failed)?;
            follow(&mut |distance, step| {
                let [x, y, z] = step.position;
                let [blocked, falling] = [step.blocked, step.falling].map(u8::from);
                writeln!(out, "{distance},{x},{y},{z},{blocked},{falling}").map_err(failed)
            })
        })?,
    };
    results.flush()?;
    if let Some(track) = &mut track {
        track.end(tally.place(), tally.distance);
    }
    Ok((ended, tally, track))
}

/// Fails if an output would overwrite an input, or two outputs name one file.
fn check_outputs(args: &WalkArgs) -> Result<(), CliError> {
    let mut inputs = vec![args.route.clone()];
    inputs.extend(std::fs::read_dir(&args.folder).into_iter().flatten().flatten().map(|file| file.path()));
    let inputs: Vec<&Path> = inputs.iter().map(PathBuf::as_path).collect();
    for path in args.image.iter().chain(&args.trace) {
        output::check_apart(path, &inputs)?;
    }
    if let (Some(image), Some(trace)) = (&args.image, &args.trace)
        && output::is_same(image, trace)
    {
        return Err(CliError::Usage("expected two files for --image and --trace, got the same file".into()));
    }
    if let Some(path) = &args.image {
        picture::check_name(path)?;
    }
    Ok(())
}

/// Returns the error of a walk: of the route, an option, or the map.
fn refused(args: &WalkArgs, cause: StoreError) -> CliError {
    match cause {
        StoreError::Walk(cause @ (WalkError::NotFinite { .. } | WalkError::FarOff { .. })) => {
            CliError::UnsuitableFile { path: args.route.clone(), what: cause.to_string() }
        }
        StoreError::Walk(cause @ WalkError::TooShort { .. }) => CliError::Usage(cause.to_string()),
        other => other.into(),
    }
}

fn read_route(args: &WalkArgs) -> Result<Route, CliError> {
    crate::input::check_there(&args.route)?;
    let text = std::fs::read_to_string(&args.route).map_err(CliError::reading(&args.route))?;
    let unsuitable = |what| CliError::UnsuitableFile { path: args.route.clone(), what };
    let route: Route = serde_json::from_str(&text)
        .map_err(|e| unsuitable(format!(r#"{e}; a route is {{"start":[x,y,z],"points":[[x,y],…]}}"#)))?;
    route.check().map_err(|e| unsuitable(e.to_string()))?;
    Ok(route)
}

/// Formats the end of a walk as text.
fn sentence(ended: Ended, route: &Route, tally: &Tally) -> String {
    let end = tally.position.map(short).join(", ");
    let far = short(tally.distance);
    let on_the_way = |point: usize| match route.points.len() {
        0 => String::new(),
        _ => format!(", on the way to point {}", point + 1),
    };
    match ended {
        Ended::Arrived => format!("Arrived at ({end}) after {far}."),
        Ended::Stuck { point } => {
            format!("Stopped at ({end}) after {far}{}: an obstacle is in the way.", on_the_way(point))
        }
        Ended::LeftMap { point } => {
            format!("Fell below the map at ({end}) after {far}{}.", on_the_way(point))
        }
    }
}
