//! Reports on slice maps.

use std::path::Path;
use std::time::Duration;

use nearmiss::Aabb;
use nearmiss::slices::{About, Grid, Obstacle, SliceFolder, Storey};
use serde::Serialize;

use crate::console::Results;
use crate::digits::{count, place, rounded, short};
use crate::error::CliError;

/// A storey of a report.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct FloorReport {
    /// Height along the axis that points up, in the caller's coordinates.
    height: f64,
    /// Area in square units.
    area: f64,
}

/// The part of a report that `inspect` adds.
#[derive(Debug, Serialize)]
pub(super) struct Detail {
    bounds: [[f64; 3]; 2],
    up: String,
    /// Lowest first; `None` if a slice cannot be loaded.
    floors: Option<Vec<FloorReport>>,
}

impl Detail {
    pub(super) fn new(grid: &Grid, storeys: Option<&[Storey]>) -> Self {
        let Aabb { min, max } = grid.bounds();
        let floor =
            |storey: &Storey| FloorReport { height: grid.up.coordinate(storey.height), area: storey.area };
        let floors = storeys.map(|storeys| storeys.iter().map(floor).collect());
        Self { bounds: [min, max], up: grid.up.to_string(), floors }
    }
}

/// The report of `build` and `inspect` on a map.
#[derive(Debug, Serialize)]
pub(super) struct Report {
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
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    detail: Option<Detail>,
    seconds: f64,
}

impl Report {
    pub(super) fn new(folder: &SliceFolder, took: Duration) -> Self {
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
            detail: None,
            seconds: took.as_secs_f64(),
        }
    }

    /// Adds bounds and storeys.
    pub(super) fn with_detail(self, detail: Detail) -> Self {
        Self { detail: Some(detail), ..self }
    }

    /// Prints the report as JSON or as text.
    pub(super) fn tell(&self, folder: &SliceFolder, json: bool) -> Result<(), CliError> {
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
            "obstacles  pixels whose points span more than {} upwards ({:.1} % of a slice){}",
            short(about.share * grid.slice_height),
            100.0 * about.share,
            of_noise(about)
        ))?;
        if let Some(Detail { bounds: [min, max], up, floors }) = &self.detail {
            let [min, max] = [min, max].map(|corner| place(*corner, self.pixel));
            results.line(format_args!("bounds     from {min} to {max}"))?;
            for floor in floors.iter().flatten() {
                let height = rounded(floor.height, 0.1 * self.pixel);
                results.line(format_args!("floor      at {up} = {height}, area {}", short(floor.area)))?;
            }
        }
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

/// Describes the noise that the rule of a map allows for.
fn of_noise(about: &About) -> String {
    let noise = short(about.noise);
    match about.rule {
        Obstacle::Share(_) => String::new(),
        Obstacle::Slope { noise: Some(_), .. } => format!("; noise {noise}"),
        Obstacle::Slope { .. } if about.is_noise_capped() => {
            format!("; noise {noise} (estimated), more than the slices allow for; give higher slices")
        }
        Obstacle::Slope { .. } => format!("; noise {noise} (estimated)"),
    }
}

pub(super) fn open(folder: &Path) -> Result<SliceFolder, CliError> {
    Ok(SliceFolder::open(folder)?)
}
