//! `slices route`: finds a short walkable route between two places.

use std::path::{Path, PathBuf};

use clap::Args;
use nearmiss::slices::{Avatar, Back, FoundRoute, Grid, Reach, Route, RouteError, SliceMap, WalkError};
use serde::Serialize;

use super::avatar_args::{AvatarArgs, Spot, check_outputs, load, parse_spot};
use super::reach_picture::{Marks, paint};
use super::refusal::{no_route, refused};
use super::searching::watch;
use super::track::Track;
use super::walk_picture;
use crate::console::{Console, Results, now};
use crate::digits::{count, place, short};
use crate::error::CliError;
use crate::output;
use crate::progress::Counter;

/// Options of `slices route`.
#[derive(Debug, Clone, Args)]
pub struct RouteArgs {
    /// Folder of the map
    pub folder: PathBuf,
    /// Place of the feet at the start, at most --climb above or below something that supports the
    /// avatar
    #[arg(long, value_name = "x,y,z", allow_hyphen_values = true, value_parser = parse_spot)]
    pub from: Spot,
    /// Place of the feet at the goal, at most --climb above or below something that supports the
    /// avatar
    ///
    /// The avatar may arrive higher or lower than this place, by at most --climb.
    #[arg(long, value_name = "x,y,z", allow_hyphen_values = true, value_parser = parse_spot)]
    pub to: Spot,
    /// The avatar
    #[command(flatten)]
    pub avatar: AvatarArgs,
    /// Let the avatar fall on the way
    #[arg(long)]
    pub falls: bool,
    /// Write the route for `slices walk --route`, which then needs the same --avatar, --climb and
    /// --step
    #[arg(short, long, value_name = "ROUTE.json")]
    pub output: Option<PathBuf>,
    /// Draw the walk along the route, or, if there is no route, the places within reach, as PNG
    #[arg(long, value_name = "OUT.png")]
    pub image: Option<PathBuf>,
    /// Print one JSON object instead of a sentence
    #[arg(long)]
    pub json: bool,
    /// Show no progress
    #[arg(long)]
    pub quiet: bool,
}

/// The JSON output.
#[derive(Debug, Default, Serialize)]
struct RouteReport<'a> {
    found: bool,
    route: Option<&'a Route>,
    /// Horizontal length of the route.
    length: Option<f64>,
    /// Horizontal length of the shortest path on the lattice.
    lattice_length: Option<f64>,
    /// The place where the feet end.
    end: Option<[f64; 3]>,
    /// Without a route, the place within reach that is nearest to the goal, and its distance from
    /// the goal.
    nearest: Option<[f64; 3]>,
    away: Option<f64>,
    seconds: f64,
}

pub(super) fn run(args: &RouteArgs) -> Result<(), CliError> {
    let begin = now();
    let outputs = [("--output", args.output.as_deref()), ("--image", args.image.as_deref())];
    check_outputs(&args.folder, &outputs, args.image.as_deref())?;
    let (folder, map) = load(&args.folder, args.quiet)?;
    let grid = folder.grid();
    let avatar = args.avatar.avatar(grid)?;
    let count = Counter::default();
    let bar = watch(Console::new(args.quiet), "looking for a route", (&map, &avatar), &count);
    let told = &mut |places| count.set(places as u64);
    let found = Route::find_watched(&map, &avatar, [args.from.0, args.to.0], args.falls, told);
    drop(bar);
    let seconds = begin.elapsed().as_secs_f64();
    match found {
        Ok(found) => {
            if let Some(path) = &args.output {
                write(path, &found.route)?;
            }
            if let Some(path) = &args.image {
                paint_walk(args, &map, &avatar, &found.route, path)?;
            }
            tell(args, grid, &found, seconds)
        }
        Err(cause) => {
            if let RouteError::NoRoute { nearest, away, .. } = cause {
                if let Some(path) = &args.image {
                    paint_reach(args, &map, &avatar, nearest, path)?;
                }
                if args.json {
                    let (nearest, away) = (Some(nearest), Some(away));
                    let mut results = Results::new();
                    results.json(&RouteReport { nearest, away, seconds, ..RouteReport::default() })?;
                    results.flush()?;
                }
            }
            Err(no_route(&args.folder, grid, &cause))
        }
    }
}

fn write(path: &Path, route: &Route) -> Result<(), CliError> {
    output::replace_plain(path, |out| {
        serde_json::to_writer(&mut *out, route)?;
        std::io::Write::write_all(out, b"\n")
    })
}

fn tell(args: &RouteArgs, grid: &Grid, found: &FoundRoute, seconds: f64) -> Result<(), CliError> {
    let mut results = Results::new();
    if args.json {
        results.json(&RouteReport {
            found: true,
            route: Some(&found.route),
            length: Some(found.length),
            lattice_length: Some(found.lattice_length),
            end: Some(found.end),
            seconds,
            ..RouteReport::default()
        })?;
    } else {
        results.line(format_args!(
            "A route of length {} over {} to {}; the shortest path on the lattice has length {}. Searched {} in {seconds:.2} s.",
            short(found.length),
            count(found.route.points.len() as u64, "point"),
            place(found.end, grid.pixel),
            short(found.lattice_length),
            count(found.visited as u64, "place"),
        ))?;
    }
    results.flush()
}

/// Draws the walk along the route.
fn paint_walk(
    args: &RouteArgs,
    map: &SliceMap,
    avatar: &Avatar,
    route: &Route,
    path: &Path,
) -> Result<(), CliError> {
    let failed = |cause: WalkError| refused(&args.folder, &cause);
    let (grid, mut building) = (map.grid(), map);
    let walker = route.stand(&mut building, avatar).map_err(failed)?;
    let mut before = grid.up.to_map(walker.position(grid));
    let (mut track, mut distance) = (Track::new(route, grid, before), 0.0);
    let walked = route.follow(&mut building, walker, &Back, |_, step| {
        let now = grid.up.to_map(step.position);
        distance += (now[0] - before[0]).hypot(now[1] - before[1]);
        track.add(now, distance);
        if step.blocked {
            track.stop(now, distance);
        }
        before = now;
        Ok::<(), WalkError>(())
    });
    walked.map_err(failed)?;
    track.end(before, distance);
    let storeys = map.storeys(avatar).map_err(|cause| failed(cause.into()))?;
    output::save_picture(&walk_picture::paint(map, &track, avatar, &storeys), path)
}

/// Draws the places within reach, if there is no route.
fn paint_reach(
    args: &RouteArgs,
    map: &SliceMap,
    avatar: &Avatar,
    nearest: [f64; 3],
    path: &Path,
) -> Result<(), CliError> {
    let failed = |cause: WalkError| refused(&args.folder, &cause);
    let start = avatar
        .placed(map, args.from.0)
        .map_err(|cause| super::refusal::misplaced(&args.folder, "start", map.grid(), &cause))?;
    let reach = Reach::new(map, &start, args.falls).map_err(failed)?;
    let storeys = map.storeys(avatar).map_err(|cause| failed(cause.into()))?;
    let others = [(args.to.0, "goal"), (nearest, "nearest")];
    let marks = Marks { start: start.position(map.grid()), others: &others };
    output::save_picture(&paint(map, avatar, &storeys, &reach, &marks), path)
}
