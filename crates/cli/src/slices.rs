//! `slices`: a building as a stack of images, and what is asked of it.

mod build;
mod export;
mod inspect;
mod labels;
mod query;
mod track;
mod walk;
mod walk_picture;

use std::path::Path;
use std::time::Duration;

use clap::Subcommand;
use nearmiss::slices::{About, Obstacle, SliceFolder};
use serde::Serialize;

pub use build::{BuildArgs, PixelArgs};
pub use export::SlicesExportArgs;
pub use inspect::SlicesInspectArgs;
pub use query::{FloorName, QueryArgs};
pub use walk::{AvatarBox, ResponseName, WalkArgs};

use crate::console::Results;
use crate::digits::{count, short};
use crate::error::CliError;

const BUILD_EXAMPLES: &str = "\
Examples:
  nearmiss slices build building.ply -o building.slices --pixel 0.04
  nearmiss slices build atrium.obj -o atrium.slices --resolution 700 --up y --max-slope 35";

const QUERY_EXAMPLES: &str = "\
Example, with a line {\"min\":[x,y,z],\"max\":[x,y,z]} a box in boxes.jsonl:
  nearmiss slices query building.slices --boxes boxes.jsonl --json";

const WALK_EXAMPLES: &str = "\
Example, with {\"start\":[x,y,z],\"points\":[[x,y],…]} in route.json:
  nearmiss slices walk building.slices --route route.json --image walk.png --trace walk.csv";

/// What can be done with slice maps.
#[derive(Debug, Clone, Subcommand)]
pub enum SlicesCommand {
    /// Make a slice map of a point cloud or mesh
    #[command(after_long_help = BUILD_EXAMPLES)]
    Build(BuildArgs),
    /// Say what a slice map holds
    Inspect(SlicesInspectArgs),
    /// Whether boxes, or another map in some poses, meet anything, and how high the floor is
    #[command(after_long_help = QUERY_EXAMPLES)]
    Query(QueryArgs),
    /// Walk an avatar along a route
    #[command(after_long_help = WALK_EXAMPLES)]
    Walk(WalkArgs),
    /// Write the slices as images, as the paper encodes them
    Export(SlicesExportArgs),
}

pub(crate) fn run(command: &SlicesCommand) -> Result<(), CliError> {
    match command {
        SlicesCommand::Build(args) => build::run(args),
        SlicesCommand::Inspect(args) => inspect::run(args),
        SlicesCommand::Query(args) => query::run(args),
        SlicesCommand::Walk(args) => walk::run(args),
        SlicesCommand::Export(args) => export::run(args),
    }
}

/// What `build` and `inspect` say of a map.
#[derive(Debug, Serialize)]
struct Report {
    slices: u32,
    distinct: usize,
    width: u32,
    height: u32,
    pixel: f64,
    slice_height: f64,
    points: u64,
    dropped: u64,
    obstacle: f64,
    noise: f64,
    noise_estimated: bool,
    bytes: u64,
    seconds: f64,
}

impl Report {
    fn new(folder: &SliceFolder, took: Duration) -> Self {
        let (grid, about) = (folder.grid(), folder.about());
        let [width, height, slices] = grid.counts;
        Self {
            slices,
            distinct: folder.distinct(),
            width,
            height,
            pixel: grid.pixel,
            slice_height: grid.slice_height,
            points: about.points,
            dropped: about.left_out,
            obstacle: about.share,
            noise: about.noise,
            noise_estimated: about.is_noise_estimated(),
            bytes: folder.bytes(),
            seconds: took.as_secs_f64(),
        }
    }

    /// As JSON, or for people.
    fn tell(&self, folder: &SliceFolder, json: bool) -> Result<(), CliError> {
        let mut results = Results::new();
        if json {
            results.json(self)?;
            return results.flush();
        }
        let (grid, about) = (folder.grid(), folder.about());
        results.line(format_args!(
            "slices     {} of {} × {} pixels, {} distinct; up is {}",
            self.slices, self.width, self.height, self.distinct, grid.up
        ))?;
        results.line(format_args!(
            "voxels     {} wide, {} high",
            short(self.pixel),
            short(self.slice_height)
        ))?;
        results.line(format_args!(
            "obstacles  what spans more than {} upwards in a pixel ({:.1} % of a slice){}",
            short(about.share * grid.slice_height),
            100.0 * about.share,
            of_noise(about)
        ))?;
        #[expect(clippy::cast_precision_loss, reason = "for people")]
        let megabytes = self.bytes as f64 / 1e6;
        let left_out = match self.dropped {
            0 => String::new(),
            n => format!(", {} left out", count(n, "other")),
        };
        results.line(format_args!(
            "files      {megabytes:.2} MB, of {}{left_out}",
            count(self.points, "point")
        ))?;
        results.line(format_args!("seconds    {:.2}", self.seconds))?;
        results.flush()
    }
}

/// How the rule of a map reckons with noise, for people.
fn of_noise(about: &About) -> String {
    let noise = short(about.noise);
    match about.rule {
        Obstacle::Share(_) => String::new(),
        Obstacle::Slope { noise: Some(_), .. } => format!("; noise {noise}"),
        Obstacle::Slope { .. } if about.is_noise_capped() => {
            format!("; noise {noise}, estimated, of which no more is allowed for: give higher slices")
        }
        Obstacle::Slope { .. } => format!("; noise {noise}, estimated"),
    }
}

fn open(folder: &Path) -> Result<SliceFolder, CliError> {
    Ok(SliceFolder::open(folder)?)
}

/// A length above zero.
fn parse_length(text: &str) -> Result<f64, String> {
    let length = text.parse().ok().filter(|l: &f64| *l > 0.0 && l.is_finite());
    length.ok_or_else(|| "expected a length, more than zero, in the units of the input".into())
}
