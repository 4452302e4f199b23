//! `slices reach`: finds all places that an avatar can walk to.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use nearmiss::Aabb;
use nearmiss::slices::{Covered, Grid, Reach, Storey};
use serde::Serialize;

use super::avatar_args::{AvatarArgs, Spot, check_outputs, load, parse_spot};
use super::reach_picture::{Marks, paint};
use super::refusal::{misplaced, refused};
use super::searching::watch;
use crate::console::{Console, Results, now};
use crate::digits::{count, place, rounded, short};
use crate::error::CliError;
use crate::output;
use crate::progress::Counter;

/// Options of `slices reach`.
#[derive(Debug, Clone, Args)]
pub struct ReachArgs {
    /// Folder of the map
    pub folder: PathBuf,
    /// Place of the feet, at most --climb above or below something that supports the avatar
    #[arg(long, visible_alias = "from", value_name = "x,y,z", allow_hyphen_values = true, value_parser = parse_spot)]
    pub start: Spot,
    /// The avatar
    #[command(flatten)]
    pub avatar: AvatarArgs,
    /// Let the avatar fall on the way, if it lands on something
    #[arg(long)]
    pub falls: bool,
    /// Draw the storeys from above with the places within reach, as PNG
    #[arg(long, value_name = "OUT.png")]
    pub image: Option<PathBuf>,
    /// Write the places of the feet, a line x,y,z for each
    #[arg(long, value_name = "OUT.csv")]
    pub csv: Option<PathBuf>,
    /// Print one JSON object instead of sentences
    #[arg(long)]
    pub json: bool,
    /// Show no progress
    #[arg(long)]
    pub quiet: bool,
}

/// The JSON output.
#[derive(Debug, Serialize)]
struct ReachReport {
    /// The place of the feet at the start.
    start: [f64; 3],
    places: usize,
    area: f64,
    bounds: Option<[[f64; 3]; 2]>,
    floors: Vec<FloorReach>,
    step: f64,
    seconds: f64,
}

/// A storey of the map.
#[derive(Debug, Serialize)]
struct FloorReach {
    /// Height of its floor, in the frame of the input; `None` if the map has no floor.
    height: Option<f64>,
    places: u64,
    area: f64,
}

impl FloorReach {
    fn all(grid: &Grid, storeys: &[Storey], covered: &[Covered]) -> Vec<Self> {
        let heights = storeys.iter().map(|storey| Some(grid.up.coordinate(storey.height)));
        let heights = heights.chain(std::iter::repeat(None));
        covered
            .iter()
            .zip(heights)
            .map(|(covered, height)| Self { height, places: covered.places, area: covered.area })
            .collect()
    }
}

pub(super) fn run(args: &ReachArgs) -> Result<(), CliError> {
    let begin = now();
    let outputs = [("--image", args.image.as_deref()), ("--csv", args.csv.as_deref())];
    check_outputs(&args.folder, &outputs, args.image.as_deref())?;
    let (folder, map) = load(&args.folder, args.quiet)?;
    let grid = folder.grid();
    let avatar = args.avatar.avatar(grid)?;
    let count = Counter::default();
    let bar = watch(Console::new(args.quiet), "looking for places within reach", (&map, &avatar), &count);
    let start =
        avatar.placed(&map, args.start.0).map_err(|cause| misplaced(&args.folder, "start", grid, &cause))?;
    let failed = |cause| refused(&args.folder, &cause);
    let reach = Reach::new_watched(&map, &start, args.falls, &mut |places| count.set(places as u64));
    let reach = reach.map_err(failed)?;
    let storeys = map.storeys(&avatar).map_err(|cause| failed(cause.into()))?;
    drop(bar);
    let covered = reach.by_storey(&storeys);
    let bounds = reach.bounds().map(|Aabb { min, max }| [min, max]);
    let report = ReachReport {
        start: start.position(grid),
        places: reach.len(),
        area: covered.iter().map(|covered| covered.area).sum(),
        bounds,
        floors: FloorReach::all(grid, &storeys, &covered),
        step: reach.lattice().spacing,
        seconds: begin.elapsed().as_secs_f64(),
    };
    if let Some(path) = &args.csv {
        write_csv(path, &reach)?;
    }
    if let Some(path) = &args.image {
        let marks = Marks { start: report.start, others: &[] };
        output::save_picture(&paint(&map, &avatar, &storeys, &reach, &marks), path)?;
    }
    tell(&report, grid, args.json)
}

fn write_csv(path: &Path, reach: &Reach) -> Result<(), CliError> {
    output::replace_plain(path, |out| {
        writeln!(out, "x,y,z")?;
        reach.positions().try_for_each(|[x, y, z]| writeln!(out, "{x},{y},{z}"))
    })
}

fn tell(report: &ReachReport, grid: &Grid, json: bool) -> Result<(), CliError> {
    let mut results = Results::new();
    if json {
        results.json(report)?;
        return results.flush();
    }
    results.line(format_args!(
        "Within reach of {}: {}, area {}.",
        place(report.start, grid.pixel),
        count(report.places as u64, "place"),
        short(report.area)
    ))?;
    if let Some([min, max]) = report.bounds {
        let [min, max] = [min, max].map(|corner| place(corner, grid.pixel));
        results.line(format_args!("bounds     from {min} to {max}"))?;
    }
    for floor in &report.floors {
        let at = floor.height.map_or_else(String::new, |height| {
            format!("at {} = {}: ", grid.up, rounded(height, 0.1 * grid.pixel))
        });
        let places = count(floor.places, "place");
        results.line(format_args!("floor      {at}{places}, area {}", short(floor.area)))?;
    }
    results.line(format_args!("seconds    {:.2}", report.seconds))?;
    results.flush()
}
