//! The storeys of a building: heights at which much floor lies with room to stand above it.

use crate::avatar::Avatar;
use crate::map::{SliceMap, Unloaded};

/// A storey.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Storey {
    /// Median height of its floor, in the map's coordinates ([`Up::coordinate`](crate::Up::coordinate)
    /// returns the caller's).
    pub height: f64,
    /// Area of its floor that has headroom, in square units of the input.
    pub area: f64,
    /// Heights of feet that belong to it, in the map's coordinates; half open. Those of all storeys cover
    /// every height: stairs belong to the storey that they leave upwards.
    pub heights: [f64; 2],
}

/// Steps that a climb is divided into.
const FINE: f64 = 16.0;

/// The greatest number of bins of height.
const MOST_BINS: f64 = 4_194_304.0;

/// A storey has at least this share of the area of the largest one.
const LEAST_SHARE: f64 = 0.1;

/// A level above the lowest is a storey if what rises from it, per slice, covers at least this share of it: on
/// a roof, or on a ceiling that was scanned from below, nothing does.
const LEAST_ABOVE: f64 = 0.001;

impl SliceMap {
    /// Finds the storeys, lowest first, with the headroom that the avatar's height needs.
    ///
    /// Floor is what is no obstacle and has nothing above it up to the height of the avatar. The height with
    /// the most floor within one climb is a storey; so is, in turn, the next one that is at least the
    /// avatar's height away from all others and has a tenth of the area of the largest or more. Levels from
    /// which nothing rises are roofs, not storeys. Looks at every pixel of every slice once.
    ///
    /// # Errors
    /// When a slice is not loaded.
    pub fn storeys(&self, avatar: &Avatar) -> Result<Vec<Storey>, Unloaded> {
        let grid = self.grid();
        let rise = f64::from(grid.counts[2]) * grid.slice_height;
        let (headroom, climb) = (avatar.options().height, avatar.options().climb);
        let fine = (climb / FINE).max(rise / MOST_BINS);
        let mut bins = self.floor_by_height(headroom, fine)?;
        let height = |bin: usize| grid.origin[2] + (to_f64(bin) + 0.5) * fine;
        let half = whole(0.5 * climb / fine);
        let mut found: Vec<Storey> = Vec::new();
        let mut largest = 0;
        while let Some((middle, _)) = fullest(&bins, half) {
            let window = middle.saturating_sub(half)..(middle + half + 1).min(bins.len());
            let median = median(&bins[window.clone()]) + window.start;
            let near = median.saturating_sub(2 * half)..(median + 2 * half + 1).min(bins.len());
            let area: u64 = bins[near].iter().sum();
            largest = largest.max(area);
            #[expect(clippy::cast_precision_loss, reason = "pixels, below 2^53")]
            let (area, most) = (area as f64, largest as f64);
            if area < LEAST_SHARE * most {
                break;
            }
            let level = height(median);
            found.push(Storey { height: level, area: area * grid.pixel * grid.pixel, heights: [0.0; 2] });
            let apart = whole(headroom / fine).max(2 * half);
            let end = (median + apart + 1).min(bins.len());
            bins[median.saturating_sub(apart)..end].fill(0);
        }
        found.sort_by(|a, b| a.height.total_cmp(&b.height));
        let mut storeys: Vec<Storey> = Vec::new();
        for storey in found {
            if storeys.is_empty() || self.rises_from(&storey, [climb, headroom])? {
                storeys.push(storey);
            }
        }
        let floors: Vec<f64> = storeys.iter().map(|storey| storey.height).collect();
        for (i, storey) in storeys.iter_mut().enumerate() {
            let low = if i == 0 { f64::NEG_INFINITY } else { floors[i] - climb };
            storey.heights = [low, floors.get(i + 1).map_or(f64::INFINITY, |next| next - climb)];
        }
        Ok(storeys)
    }

    /// Counts the pixels of floor with headroom by their height, in bins of `fine`.
    fn floor_by_height(&self, headroom: f64, fine: f64) -> Result<Vec<u64>, Unloaded> {
        let grid = self.grid();
        let [columns, rows, slices] = grid.counts;
        let count = whole(f64::from(slices) * grid.slice_height / fine) + 1;
        let mut bins = vec![0_u64; count];
        let mut ceilings = vec![f64::INFINITY; columns as usize];
        for row in 0..rows {
            ceilings.fill(f64::INFINITY);
            for s in (0..slices).rev() {
                let slice = self.slice(s)?;
                if !slice.any(&(0..=columns - 1), &(row..=row)) {
                    continue;
                }
                for (column, ceiling) in (0..columns).zip(&mut ceilings) {
                    let Some(content) = slice.pixel(column, row) else { continue };
                    let top = grid.height(s, content.top);
                    if !content.is_obstacle && *ceiling - top >= headroom {
                        let bin = whole((top - grid.origin[2]) / fine).min(count - 1);
                        bins[bin] += 1;
                    }
                    *ceiling = grid.height(s, content.bottom);
                }
            }
        }
        Ok(bins)
    }

    /// Returns `true` if something rises from a storey, between these heights above it.
    fn rises_from(&self, storey: &Storey, [low, high]: [f64; 2]) -> Result<bool, Unloaded> {
        let grid = self.grid();
        let Some(slices) = grid.range(2, [storey.height + low, storey.height + high]) else {
            return Ok(false);
        };
        let (mut pixels, mut count) = (0_u64, 0_u64);
        for s in slices {
            pixels += self.slice(s)?.counts()[0];
            count += 1;
        }
        #[expect(clippy::cast_precision_loss, reason = "pixels, below 2^53")]
        let mean = pixels as f64 / count.max(1) as f64;
        Ok(mean * grid.pixel * grid.pixel >= LEAST_ABOVE * storey.area)
    }
}

/// Returns the index of the storey that feet at this height of the map's coordinates belong to.
#[must_use]
pub fn storey_of(storeys: &[Storey], feet: f64) -> Option<usize> {
    storeys.iter().position(|storey| storey.heights[0] <= feet && feet < storey.heights[1])
}

/// Returns the middle of the window of `2·half + 1` bins that holds most, and what it holds; `None` if all
/// bins are empty. Of several the lowest.
fn fullest(bins: &[u64], half: usize) -> Option<(usize, u64)> {
    let mut sum: u64 = bins.iter().take(half).sum();
    let mut best = None;
    for middle in 0..bins.len() {
        sum += bins.get(middle + half).copied().unwrap_or(0);
        if sum > best.map_or(0, |(_, most)| most) {
            best = Some((middle, sum));
        }
        if let Some(first) = middle.checked_sub(half) {
            sum -= bins[first];
        }
    }
    best
}

/// Returns the bin that half of what bins hold lies below.
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
