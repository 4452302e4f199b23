//! The storeys of a building: heights with much floor and headroom above it.

use std::ops::Range;

use crate::avatar::Avatar;
use crate::grid::Grid;
use crate::map::{SliceMap, Unloaded};
use crate::slice::Slice;
use crate::store::{SliceFolder, StoreError};

/// A storey.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Storey {
    /// Median height of its floor, in the map's coordinates
    /// ([`Up::coordinate`](crate::Up::coordinate) returns the caller's).
    pub height: f64,
    /// Area of its floor with headroom, in square units of the input.
    pub area: f64,
    /// Range of the heights of feet that belong to it, in the map's coordinates, without the upper
    /// end. The ranges of all storeys cover every height. Stairs belong to the storey below them.
    pub heights: [f64; 2],
}

/// Number of bins in the height of a climb.
const FINE: f64 = 16.0;

/// The greatest number of bins of height.
const MOST_BINS: f64 = 4_194_304.0;

/// A storey has at least this share of the area of the largest one.
const LEAST_SHARE: f64 = 0.1;

/// A level above the lowest is a storey only if things rise from it. They must cover at least this
/// share of its area, on average over the slices between a climb and the headroom above it. Nothing
/// rises from a roof, or from a ceiling that was scanned from below.
const LEAST_ABOVE: f64 = 0.001;

impl SliceMap {
    /// Finds the storeys, lowest first, with the headroom that the avatar's height needs.
    ///
    /// A pixel is floor if it is no obstacle and has nothing above it up to the height of the
    /// avatar. The storeys are found one by one, the largest first. Each is the height range of one
    /// climb with the most floor, at least the avatar's height away from the storeys found before.
    /// The search ends below a tenth of the largest area. Levels from which nothing rises are
    /// roofs, not storeys. Visits every pixel of every slice once.
    ///
    /// # Errors
    /// If a slice is not loaded.
    pub fn storeys(&self, avatar: &Avatar) -> Result<Vec<Storey>, Unloaded> {
        let mut floor = FloorCount::new(self.grid(), avatar);
        for s in (0..self.grid().counts[2]).rev() {
            floor.add(s, self.slice(s)?);
        }
        Ok(floor.storeys())
    }
}

impl SliceFolder {
    /// Finds the storeys as [`SliceMap::storeys`] does, with one slice in memory at a time and 8
    /// bytes a pixel.
    ///
    /// # Errors
    /// If a slice cannot be loaded; the error names its file.
    pub fn storeys(&self, avatar: &Avatar) -> Result<Vec<Storey>, StoreError> {
        let mut floor = FloorCount::new(self.grid(), avatar);
        for s in (0..self.grid().counts[2]).rev() {
            floor.add(s, &self.load(s)?);
        }
        Ok(floor.storeys())
    }
}

/// Pixels of floor by their height.
struct FloorCount {
    grid: Grid,
    headroom: f64,
    climb: f64,
    /// Height of a bin.
    fine: f64,
    /// Pixels of floor with headroom.
    bins: Vec<u64>,
    /// Height of the lowest thing above, for each pixel.
    ceilings: Vec<f64>,
    /// Number of occupied pixels of each slice.
    filled: Vec<u64>,
}

impl FloorCount {
    fn new(grid: &Grid, avatar: &Avatar) -> Self {
        let rise = f64::from(grid.counts[2]) * grid.slice_height;
        let (headroom, climb) = (avatar.options().height, avatar.options().climb);
        let fine = (climb / FINE).max(rise / MOST_BINS);
        Self {
            grid: *grid,
            headroom,
            climb,
            fine,
            bins: vec![0; whole(rise / fine) + 1],
            ceilings: vec![f64::INFINITY; grid.area()],
            filled: vec![0; grid.counts[2] as usize],
        }
    }

    /// Adds a slice; the highest must come first.
    fn add(&mut self, s: u32, slice: &Slice) {
        let [columns, rows, _] = self.grid.counts;
        self.filled[s as usize] = slice.counts()[0];
        for row in 0..rows {
            if !slice.any(&(0..=columns - 1), &(row..=row)) {
                continue;
            }
            let first = row as usize * columns as usize;
            for (column, ceiling) in (0..columns).zip(&mut self.ceilings[first..]) {
                let Some(content) = slice.pixel(column, row) else { continue };
                let top = self.grid.height(s, content.top);
                if !content.is_obstacle && *ceiling - top >= self.headroom {
                    let bin = whole((top - self.grid.origin[2]) / self.fine).min(self.bins.len() - 1);
                    self.bins[bin] += 1;
                }
                *ceiling = self.grid.height(s, content.bottom);
            }
        }
    }

    /// Returns the storeys, once all slices are added.
    fn storeys(mut self) -> Vec<Storey> {
        let half = whole(0.5 * self.climb / self.fine);
        let apart = whole(self.headroom / self.fine).max(2 * half);
        let mut found: Vec<Storey> = Vec::new();
        let mut largest = 0.0_f64;
        while let Some(middle) = fullest(&self.bins, half) {
            let window = self.about(middle, half);
            let median = median(&self.bins[window.clone()]) + window.start;
            let pixels: u64 = self.bins[self.about(median, 2 * half)].iter().sum();
            #[expect(clippy::cast_precision_loss, reason = "pixels, below 2^53")]
            let area = pixels as f64 * self.grid.pixel * self.grid.pixel;
            largest = largest.max(area);
            if area < LEAST_SHARE * largest {
                break;
            }
            let height = self.grid.origin[2] + (to_f64(median) + 0.5) * self.fine;
            found.push(Storey { height, area, heights: [0.0; 2] });
            let around = self.about(median, apart);
            self.bins[around].fill(0);
        }
        found.sort_by(|a, b| a.height.total_cmp(&b.height));
        let kept = found.iter().enumerate().filter(|(i, storey)| *i == 0 || self.rises_from(storey));
        let mut storeys: Vec<Storey> = kept.map(|(_, storey)| *storey).collect();
        let floors: Vec<f64> = storeys.iter().map(|storey| storey.height).collect();
        for (i, storey) in storeys.iter_mut().enumerate() {
            let low = if i == 0 { f64::NEG_INFINITY } else { floors[i] - self.climb };
            storey.heights = [low, floors.get(i + 1).map_or(f64::INFINITY, |next| next - self.climb)];
        }
        storeys
    }

    /// Returns the bins from `half` below `middle` to `half` above it, as far as they exist.
    fn about(&self, middle: usize, half: usize) -> Range<usize> {
        middle.saturating_sub(half)..(middle + half + 1).min(self.bins.len())
    }

    /// Returns `true` if there are things on a storey, between a climb and the headroom above it.
    fn rises_from(&self, storey: &Storey) -> bool {
        let heights = [storey.height + self.climb, storey.height + self.headroom];
        let Some(slices) = self.grid.range(2, heights) else { return false };
        let filled = &self.filled[*slices.start() as usize..=*slices.end() as usize];
        #[expect(clippy::cast_precision_loss, reason = "pixels and slices, below 2^53")]
        let mean = filled.iter().sum::<u64>() as f64 / filled.len() as f64;
        mean * self.grid.pixel * self.grid.pixel >= LEAST_ABOVE * storey.area
    }
}

/// Returns the index of the storey that feet at this height of the map's coordinates belong to.
#[must_use]
pub fn storey_of(storeys: &[Storey], feet: f64) -> Option<usize> {
    storeys.iter().position(|storey| storey.heights[0] <= feet && feet < storey.heights[1])
}

/// Returns the middle of the fullest window of `2·half + 1` bins; `None` if all bins are empty. Of
/// several windows the lowest wins.
fn fullest(bins: &[u64], half: usize) -> Option<usize> {
    let mut sum: u64 = bins.iter().take(half).sum();
    let (mut best, mut most) = (None, 0);
    for middle in 0..bins.len() {
        sum += bins.get(middle + half).copied().unwrap_or(0);
        if sum > most {
            (best, most) = (Some(middle), sum);
        }
        if let Some(first) = middle.checked_sub(half) {
            sum -= bins[first];
        }
    }
    best
}

/// Returns the bin of the median.
fn median(bins: &[u64]) -> usize {
    let all: u64 = bins.iter().sum();
    let mut below = 0;
    bins.iter()
        .position(|bin| {
            below += bin;
            2 * below >= all
        })
        .unwrap_or(0)
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the cast saturates")]
fn whole(x: f64) -> usize {
    x as usize
}

#[expect(clippy::cast_precision_loss, reason = "a bin, below 2^53")]
fn to_f64(bin: usize) -> f64 {
    bin as f64
}
