//! `slices walk`: an avatar along a route.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use nearmiss::slices::{
    Avatar, AvatarOptions, Back, CacheOptions, Ended, Response, Route, SliceCache, Slide, Step, StoreError,
    WalkError,
};
use serde::Serialize;

use super::{open, parse_length, walk_picture};
use crate::console::{self, Console, Results};
use crate::digits::{count, short};
use crate::error::CliError;
use crate::input::pieces;
use crate::{output, picture};

/// Options of `slices walk`.
#[derive(Debug, Clone, Args)]
pub struct WalkArgs {
    /// Folder of the map
    pub folder: PathBuf,
    /// The route: `{"start":[x,y,z],"points":[[x,y],…]}`, the points by the two coordinates across the axis that points up
    #[arg(long, value_name = "FILE.json")]
    pub route: PathBuf,
    /// Width, depth and height of the avatar
    #[arg(long, value_name = "W,D,H", default_value = "0.4,0.4,1.6", value_parser = parse_avatar)]
    pub avatar: AvatarBox,
    /// How far it climbs at once, and falls in a step
    #[arg(long, value_name = "C", default_value = "0.35", allow_hyphen_values = true, value_parser = parse_length)]
    pub climb: f64,
    /// Length of a step; by default a pixel's side
    #[arg(long, value_name = "L", allow_hyphen_values = true, value_parser = parse_length)]
    pub step: Option<f64>,
    /// What it does where something is in the way
    #[arg(long, value_enum, default_value_t = ResponseName::Back)]
    pub response: ResponseName,
    /// Slices kept in memory, by default 16; raised to what the avatar spans
    #[arg(long, value_name = "N")]
    pub cache: Option<u32>,
    /// Load slices only when they are needed
    #[arg(long)]
    pub no_prefetch: bool,
    /// Picture, as PNG: the storeys from above with the route, and height over distance
    #[arg(long, value_name = "OUT.png")]
    pub image: Option<PathBuf>,
    /// A line a step: distance,x,y,z,blocked,falling
    #[arg(long, value_name = "OUT.csv")]
    pub trace: Option<PathBuf>,
    /// One object of JSON a step instead of sentences
    #[arg(long)]
    pub json: bool,
    /// No progress on the terminal
    #[arg(long)]
    pub quiet: bool,
}

/// Width, depth and height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AvatarBox(
    /// The lengths.
    pub [f64; 3],
);

/// A response, by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ResponseName {
    /// Back to the last valid place, as in the paper
    Back,
    /// Along the wall
    Slide,
}

fn parse_avatar(text: &str) -> Result<AvatarBox, String> {
    let lengths: Vec<f64> = pieces(text).map_while(|piece| parse_length(piece).ok()).collect();
    match <[f64; 3]>::try_from(lengths) {
        Ok(lengths) if pieces(text).count() == 3 => Ok(AvatarBox(lengths)),
        _ => Err("expected three lengths, width,depth,height".into()),
    }
}

/// A line of the output.
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

pub(super) fn run(args: &WalkArgs) -> Result<(), CliError> {
    let mut inputs = vec![args.route.clone()];
    inputs.extend(std::fs::read_dir(&args.folder).into_iter().flatten().flatten().map(|file| file.path()));
    let inputs: Vec<&Path> = inputs.iter().map(PathBuf::as_path).collect();
    for path in args.image.iter().chain(&args.trace) {
        output::check_apart(path, &inputs)?;
    }
    if args.image.is_some() && args.image == args.trace {
        return Err(CliError::Usage("--image and --trace name the same file; name two".into()));
    }
    if let Some(path) = &args.image {
        picture::check_name(path)?;
    }
    let route = read_route(args)?;
    let folder = open(&args.folder)?;
    let AvatarBox([width, depth, height]) = args.avatar;
    let options = AvatarOptions::default()
        .with_box([width, depth], height)
        .with_climb(args.climb)
        .with_step(args.step.unwrap_or(folder.grid().pixel));
    let avatar = Avatar::new(&options).map_err(|e| CliError::Usage(e.to_string()))?;
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
    let response: &dyn Response = match args.response {
        ResponseName::Back => &Back,
        ResponseName::Slide => &Slide,
    };

    let mut results = Results::new();
    let mut steps: Vec<Step> = Vec::new();
    let bar = Console::new(args.quiet).spinner("walking");
    let mut closed = Ok(());
    let ended = route.walk(&mut cache, &avatar, response, |cache: &SliceCache, step| {
        steps.push(*step);
        if args.json && closed.is_ok() {
            let counts = cache.counts();
            let Step { position, blocked, falling, slices } = *step;
            let (hits, misses, stalls) = (counts.hits, counts.misses, counts.stalls);
            closed = results.json(&StepLine { position, blocked, falling, slices, hits, misses, stalls });
        }
        Ok::<(), StoreError>(())
    });
    drop(bar);
    closed?;
    results.flush()?;
    let ended = ended.map_err(|cause| match cause {
        StoreError::Walk(cause @ (WalkError::Blocked { .. } | WalkError::NotFinite { .. })) => {
            CliError::Unfit { path: args.route.clone(), what: cause.to_string() }
        }
        other => other.into(),
    })?;

    let track = Track::new(&route, &steps, &folder);
    if let Some(path) = &args.trace {
        output::replace_plain(path, |out| out.write_all(track.csv(&steps).as_bytes()))?;
    }
    if let Some(path) = &args.image {
        let (map, faults) = folder.load_all();
        faults.iter().for_each(console::warn);
        walk_picture::paint(&map, &track, height).save(path)?;
    }
    if !args.json {
        results.line(sentence(ended, &route, &steps, &track))?;
        let counts = cache.counts();
        results.line(format_args!(
            "{}, {} blocked, {} falling; slices: {}, {}, {}",
            count(steps.len() as u64, "step"),
            steps.iter().filter(|step| step.blocked).count(),
            steps.iter().filter(|step| step.falling).count(),
            count(counts.hits, "hit"),
            format_args!("{} misses", counts.misses),
            count(counts.stalls, "stall"),
        ))?;
    }
    results.flush()
}

fn read_route(args: &WalkArgs) -> Result<Route, CliError> {
    crate::input::check_there(&args.route)?;
    let text = std::fs::read_to_string(&args.route).map_err(CliError::reading(&args.route))?;
    let unfit = |what| CliError::Unfit { path: args.route.clone(), what };
    let route: Route = serde_json::from_str(&text)
        .map_err(|e| unfit(format!(r#"{e}; a route is {{"start":[x,y,z],"points":[[x,y],…]}}"#)))?;
    route.check().map_err(|e| unfit(e.to_string()))?;
    Ok(route)
}

/// Where it went, in the map's coordinates, and how far that was.
pub(super) struct Track {
    /// The start first.
    pub(super) places: Vec<[f64; 3]>,
    /// Along the ground, for each place.
    pub(super) distances: Vec<f64>,
    /// The points of the route, in the map's coordinates.
    pub(super) targets: Vec<[f64; 2]>,
}

impl Track {
    fn new(route: &Route, steps: &[Step], folder: &nearmiss::slices::SliceFolder) -> Self {
        let up = folder.grid().up;
        let all = std::iter::once(route.start).chain(steps.iter().map(|step| step.position));
        let places: Vec<[f64; 3]> = all.map(|p| up.to_map(p)).collect();
        let mut distances = vec![0.0];
        let mut so_far = 0.0;
        for pair in places.windows(2) {
            so_far += (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
            distances.push(so_far);
        }
        Self { places, distances, targets: route.points.iter().map(|p| up.across(*p)).collect() }
    }

    fn csv(&self, steps: &[Step]) -> String {
        let mut text = String::from("distance,x,y,z,blocked,falling\n");
        for (step, distance) in steps.iter().zip(&self.distances[1..]) {
            let [x, y, z] = step.position;
            let [blocked, falling] = [step.blocked, step.falling].map(u8::from);
            let _ = writeln!(text, "{distance},{x},{y},{z},{blocked},{falling}");
        }
        text
    }
}

/// For people.
fn sentence(ended: Ended, route: &Route, steps: &[Step], track: &Track) -> String {
    let place = |p: [f64; 3]| format!("({})", p.map(short).join(", "));
    let end = steps.last().map_or(route.start, |step| step.position);
    let walked = track.distances.last().copied().unwrap_or(0.0);
    let far = format!("after {}", short(walked));
    match ended {
        Ended::Arrived => format!("Arrived at {} {far}.", place(end)),
        Ended::Stuck { point } => {
            format!(
                "Stopped at {} {far}, on the way to point {}: something is in the way.",
                place(end),
                point + 1
            )
        }
        Ended::LeftMap { point } => {
            format!("Fell below the map at {} {far}, on the way to point {}.", place(end), point + 1)
        }
    }
}
