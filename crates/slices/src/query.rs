//! Queries of boxes: collision, obstacles and the floor below.
//!
//! A query looks at the pixels under the box in every slice between its bottom and its top (Anjos
//! et al. 2012, §3.1), which takes O(pixels · slices) time. The paper uses size/t pixels about the
//! centre. Here it is every pixel that the closed box meets.

use std::ops::RangeInclusive;

use nearmiss_geometry::Aabb;
use nearmiss_lanes::parallel::change_each;
use serde::{Deserialize, Serialize};

use crate::bits::Run;
use crate::map::{SliceMap, Unloaded};
use crate::{Block, Grid};

/// Queries that a thread takes at a time.
const CHUNK: usize = 64;

/// Number of rows that are searched together for floors. A slice that is empty in all of them costs
/// only a look at its tiles.
const BAND: u32 = 32;

/// The floor under a base that is not level (Anjos et al. 2012, §3.1).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Floor {
    /// The highest pixel.
    #[default]
    Max,
    /// The mean of the pixels that have a floor.
    Mean,
}

/// The content of a box.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Occupancy {
    /// `true` if any pixel is occupied.
    pub collides: bool,
    /// `true` if any pixel is an obstacle.
    pub obstacle: bool,
    /// The floor under the base, as the caller's coordinate along the axis that points up.
    pub floor: Option<f64>,
    /// The number of occupied pixels.
    pub pixels: u64,
}

impl Grid {
    /// Returns the voxels that a closed box of the caller's coordinates meets. Returns `None` if
    /// the box is empty, has a NaN bound, or is outside the map.
    #[must_use]
    pub fn block_of(&self, bounds: &Aabb) -> Option<Block> {
        let [min, max] = self.turned(bounds)?;
        self.block(min, max)
    }

    /// Returns the box in the map's coordinates; `None` if it is empty.
    fn turned(&self, bounds: &Aabb) -> Option<[[f64; 3]; 2]> {
        // The form of the condition also rejects NaN.
        if !(0..3).all(|k| bounds.min[k] <= bounds.max[k]) {
            return None;
        }
        let Aabb { min, max } = Aabb::of([bounds.min, bounds.max].map(|corner| self.up.to_map(corner)));
        Some([min, max])
    }
}

impl SliceMap {
    /// Returns `true` if a box, in the caller's coordinates, meets an occupied pixel. An empty box
    /// meets none.
    ///
    /// Equal adjacent slices are tested once (Anjos et al. 2012, §5). Takes some hundred
    /// nanoseconds for an avatar of 15 × 15 × 15 pixels.
    ///
    /// # Errors
    /// If a required slice is not loaded.
    pub fn touches(&self, bounds: &Aabb) -> Result<bool, Unloaded> {
        let Some(block) = self.grid().block_of(bounds) else { return Ok(false) };
        for run in self.runs(&block) {
            let (_, slice, is_again) = run?;
            if !is_again && slice.any(&block.columns, &block.rows) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Returns the content of a box of the caller's coordinates, and the height of the floor below
    /// it.
    ///
    /// The floor of a pixel under the base is the highest occupied voxel of its column in the slice
    /// of the base or lower, unless that is an obstacle.
    ///
    /// # Errors
    /// If a required slice is not loaded; the floor may require any slice below the box.
    pub fn query(&self, bounds: &Aabb, floor: Floor) -> Result<Occupancy, Unloaded> {
        let mut found = Occupancy::default();
        let Some([min, max]) = self.grid().turned(bounds) else { return Ok(found) };
        if let Some(block) = self.grid().block(min, max) {
            let mut counts = [0; 2];
            for run in self.runs(&block) {
                let (_, slice, is_again) = run?;
                if !is_again {
                    counts = slice.count(&block.columns, &block.rows);
                }
                found.pixels += counts[0];
                found.obstacle |= counts[1] > 0;
            }
            found.collides = found.pixels > 0;
        }
        let grid = self.grid();
        let [columns, rows] = [0, 1].map(|axis| grid.range(axis, [min[axis], max[axis]]));
        let (Some(columns), Some(rows)) = (columns, rows) else { return Ok(found) };
        let mut floors = Floors::default();
        self.floors_below(&columns, rows, min[2], &mut floors)?;
        found.floor = floors.height(floor).map(|height| grid.up.coordinate(height));
        Ok(found)
    }

    /// Answers every query, on all cores with the feature `rayon`.
    ///
    /// # Panics
    /// If there are not as many answers as boxes.
    pub fn query_each(&self, boxes: &[Aabb], floor: Floor, answers: &mut [Result<Occupancy, Unloaded>]) {
        assert_eq!(boxes.len(), answers.len(), "expected an answer for each box");
        change_each(answers, CHUNK, |i, answer| *answer = self.query(&boxes[i], floor));
    }

    /// Adds the floor of each column: the height of its highest occupied voxel in the slice of
    /// `base` or lower, in the map's coordinates, unless that is an obstacle.
    pub(crate) fn floors_below(
        &self,
        columns: &RangeInclusive<u32>,
        rows: RangeInclusive<u32>,
        base: f64,
        floors: &mut Floors,
    ) -> Result<(), Unloaded> {
        let grid = self.grid();
        let slices = grid.slice_at(base).saturating_add(1).clamp(0, i64::from(grid.counts[2]));
        let slices = u32::try_from(slices).unwrap_or(0);
        let (first, last) = (*rows.start(), *rows.end());
        for from in (first..=last).step_by(BAND as usize) {
            let band = from..=last.min(from.saturating_add(BAND - 1));
            for word in (columns.start() / 64)..=(columns.end() / 64) {
                let within = (*columns.start()).max(64 * word)..=(*columns.end()).min(64 * word + 63);
                self.floors_of_band(slices, &within, &band, floors)?;
            }
        }
        Ok(())
    }

    /// Adds the floors among the lowest `slices`, for some rows and the columns of one word.
    fn floors_of_band(
        &self,
        slices: u32,
        columns: &RangeInclusive<u32>,
        band: &RangeInclusive<u32>,
        floors: &mut Floors,
    ) -> Result<(), Unloaded> {
        let word = columns.start() / 64;
        // Columns whose highest occupied voxel has not been found yet.
        let mut open = [Run::new(columns).mask(word as usize); BAND as usize];
        let open = &mut open[..band.clone().count()];
        for s in (0..slices).rev() {
            let slice = self.slice(s)?;
            if !slice.any(columns, band) {
                continue;
            }
            for (row, open) in band.clone().zip(&mut *open) {
                let mut found = slice.occupied().row(row)[word as usize] & *open;
                *open &= !found;
                while found != 0 {
                    let column = 64 * word + found.trailing_zeros();
                    found &= found - 1;
                    let content = slice.pixel(column, row).filter(|content| !content.is_obstacle);
                    floors.add(content.map(|content| self.grid().height(s, content.top)));
                }
            }
            if open.iter().all(|&open| open == 0) {
                break;
            }
        }
        Ok(())
    }
}

/// Maximum and mean of heights of floors.
#[derive(Debug, Default)]
pub(crate) struct Floors {
    sum: f64,
    count: u32,
    greatest: Option<f64>,
}

impl Floors {
    pub(crate) fn add(&mut self, height: Option<f64>) {
        let Some(height) = height else { return };
        self.sum += height;
        self.count += 1;
        self.greatest = Some(self.greatest.map_or(height, |greatest| greatest.max(height)));
    }

    pub(crate) fn height(&self, floor: Floor) -> Option<f64> {
        match floor {
            Floor::Max => self.greatest,
            Floor::Mean => self.greatest.map(|_| self.sum / f64::from(self.count)),
        }
    }
}
