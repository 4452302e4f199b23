//! `slices start`: a place where an avatar can stand.

use std::path::PathBuf;

use clap::Args;
use nearmiss::slices::{Standing, storey_of};
use serde::Serialize;

use super::avatar_args::{AvatarArgs, Spot, load, parse_spot};
use super::refusal::{refused, told_place};
use super::searching::watch;
use crate::console::{Console, Results};
use crate::digits::short;
use crate::error::CliError;
use crate::progress::Counter;

/// Options of `slices start`.
#[derive(Debug, Clone, Args)]
pub struct StartArgs {
    /// Folder of the map
    pub folder: PathBuf,
    /// Find the place nearest to this one
    ///
    /// By default, the result is the middle of the largest connected part of the lowest floor.
    #[arg(long, value_name = "x,y,z", allow_hyphen_values = true, value_parser = parse_spot)]
    pub near: Option<Spot>,
    /// The avatar
    #[command(flatten)]
    pub avatar: AvatarArgs,
    /// Print one JSON object instead of a sentence
    #[arg(long)]
    pub json: bool,
    /// Show no progress
    #[arg(long)]
    pub quiet: bool,
}

/// The JSON output.
#[derive(Debug, Serialize)]
struct StartReport {
    position: [f64; 3],
    /// The distance from `--near`.
    distance: Option<f64>,
    /// The storey, counted from 0, the lowest.
    floor: Option<usize>,
}

pub(super) fn run(args: &StartArgs) -> Result<(), CliError> {
    let (folder, map) = load(&args.folder, args.quiet)?;
    let grid = folder.grid();
    let avatar = args.avatar.avatar(grid)?;
    let failed = |cause| refused(&args.folder, &cause);
    let count = Counter::default();
    let bar = watch(Console::new(args.quiet), "looking for a place to stand", (&map, &avatar), &count);
    let storeys = map.storeys(&avatar).map_err(|cause| failed(cause.into()))?;
    let found = match args.near {
        Some(Spot(near)) => avatar.nearest_standing(&map, near),
        None => avatar.roomy_start_watched(&map, &storeys, &mut |places| count.set(places as u64)),
    };
    drop(bar);
    let Some(Standing { position, distance }) = found.map_err(failed)? else {
        let what = "this avatar can stand nowhere on the map; give a smaller one".to_owned();
        return Err(CliError::UnsuitableFile { path: args.folder.clone(), what });
    };
    let floor = storey_of(&storeys, grid.up.to_map(position)[2]);
    let mut results = Results::new();
    if args.json {
        let distance = args.near.map(|_| distance);
        results.json(&StartReport { position, distance, floor })?;
    } else {
        let place = told_place(position, grid);
        results.line(match args.near {
            Some(_) => format!("Nearest place to stand: {place}, {} away.", short(distance)),
            None => format!("A place to start: {place}."),
        })?;
    }
    results.flush()
}
