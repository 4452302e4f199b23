//! The grid of pixels and slices.

use std::ops::RangeInclusive;

use nearmiss_geometry::Aabb;
use serde::{Deserialize, Serialize};

use crate::Up;

/// Number of levels of height in a slice; with a value for empty, they fill a byte.
pub const LEVELS: u32 = 255;

/// Limit of levels, 2^53: beyond all maps, since a `u32` counts slices.
const FARTHEST: f64 = 9_007_199_254_740_992.0;

/// The lattice of a map: pixels of side t and slices of height σ, counted from a corner.
///
/// A place p of the map's coordinates ([`Up::to_map`]) is in column ⌊(p₀ − o₀)/t⌋, row ⌊(p₁ −
/// o₁)/t⌋ and slice s = ⌊(p₂ − o₂)/σ⌋, at level ⌊255·((p₂ − o₂)/σ − s)⌋, in double precision.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Grid {
    /// The axis that points up.
    pub up: Up,
    /// o, the corner of the first voxel, in the map's coordinates.
    pub origin: [f64; 3],
    /// t, side of a pixel, in the caller's units.
    pub pixel: f64,
    /// σ, height of a slice, in the caller's units.
    pub slice_height: f64,
    /// Columns, rows, slices.
    pub counts: [u32; 3],
}

/// A voxel of the lattice, and a level in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Voxel {
    pub(crate) slice: usize,
    /// Row times columns plus column.
    pub(crate) pixel: usize,
    /// Below [`LEVELS`].
    pub(crate) level: u8,
}

/// A block of voxels, ends included.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Block {
    /// Columns.
    pub columns: RangeInclusive<u32>,
    /// Rows.
    pub rows: RangeInclusive<u32>,
    /// Slices.
    pub slices: RangeInclusive<u32>,
}

impl Grid {
    /// Returns the number of pixels of a slice.
    #[must_use]
    pub fn area(&self) -> usize {
        self.counts[0] as usize * self.counts[1] as usize
    }

    fn size(&self, axis: usize) -> f64 {
        if axis == 2 { self.slice_height } else { self.pixel }
    }

    /// Returns the voxel of a place of the map's coordinates. Returns `None` outside the map, and
    /// for NaN.
    #[inline]
    pub(crate) fn voxel(&self, p: [f64; 3]) -> Option<Voxel> {
        let q = [0, 1, 2].map(|k| (p[k] - self.origin[k]) / self.size(k));
        if !(0..3).all(|k| q[k] >= 0.0 && q[k] < f64::from(self.counts[k])) {
            return None;
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "within the counts, a u32"
        )]
        let [column, row, slice] = q.map(|x| x as u32);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "below 255 but for rounding"
        )]
        let level = ((q[2] - f64::from(slice)) * f64::from(LEVELS)) as u8;
        let pixel = row as usize * self.counts[0] as usize + column as usize;
        Some(Voxel { slice: slice as usize, pixel, level: level.min(254) })
    }

    /// Returns the columns (`axis` 0), rows (1) or slices (2) of the map that the closed interval
    /// meets.
    #[must_use]
    pub fn range(&self, axis: usize, [low, high]: [f64; 2]) -> Option<RangeInclusive<u32>> {
        let [from, to] = [low, high].map(|x| ((x - self.origin[axis]) / self.size(axis)).floor());
        let last = f64::from(self.counts[axis]) - 1.0;
        // The form of the condition also rejects NaN.
        if !(from <= to && from <= last && to >= 0.0) {
            return None;
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "within the counts, a u32"
        )]
        let [from, to] = [from.max(0.0), to.min(last)].map(|x| x as u32);
        Some(from..=to)
    }

    /// Returns the voxels of the map that a closed box of the map's coordinates meets.
    #[must_use]
    pub fn block(&self, min: [f64; 3], max: [f64; 3]) -> Option<Block> {
        let range = |axis: usize| self.range(axis, [min[axis], max[axis]]);
        Some(Block { columns: range(0)?, rows: range(1)?, slices: range(2)? })
    }

    /// Returns the height of the middle of a level of a slice, in the map's coordinates.
    #[must_use]
    pub fn height(&self, slice: u32, level: u8) -> f64 {
        let share = (f64::from(level) + 0.5) / f64::from(LEVELS);
        self.origin[2] + (f64::from(slice) + share) * self.slice_height
    }

    /// Returns the greatest level, counted through all slices, whose height is at most `height`;
    /// negative below the map. Clamped to ±2^53, so that levels can be added.
    #[must_use]
    pub(crate) fn level_at(&self, height: f64) -> i64 {
        let level = (height - self.origin[2]) / self.slice_height * f64::from(LEVELS) - 0.5;
        #[expect(clippy::cast_possible_truncation, reason = "whole and at most 2^53")]
        let level = level.floor().clamp(-FARTHEST, FARTHEST) as i64;
        level
    }

    /// Returns the slice of a height of the map's coordinates, which may be below or above the map.
    #[must_use]
    pub(crate) fn slice_at(&self, height: f64) -> i64 {
        #[expect(clippy::cast_possible_truncation, reason = "the cast saturates")]
        let slice = ((height - self.origin[2]) / self.slice_height).floor() as i64;
        slice
    }

    /// Returns the bounds of all voxels, in the caller's coordinates.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        let end = [0, 1, 2].map(|k| self.origin[k] + f64::from(self.counts[k]) * self.size(k));
        Aabb::of([self.origin, end].map(|corner| self.up.from_map(corner)))
    }

    /// Returns the centre of a pixel, in the map's coordinates.
    #[must_use]
    pub fn middle(&self, column: u32, row: u32) -> [f64; 2] {
        [(0, column), (1, row)].map(|(k, i)| self.origin[k] + (f64::from(i) + 0.5) * self.pixel)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid =
        Grid { up: Up::Z, origin: [1.0, -2.0, 0.5], pixel: 0.25, slice_height: 0.5, counts: [4, 3, 2] };

    #[test]
    fn places_lie_in_voxels_and_ranges_are_closed() {
        let voxel = |p| GRID.voxel(p);
        assert_eq!(voxel([1.0, -2.0, 0.5]), Some(Voxel { slice: 0, pixel: 0, level: 0 }));
        assert_eq!(voxel([1.3, -1.3, 1.0]), Some(Voxel { slice: 1, pixel: 9, level: 0 }));
        assert_eq!(voxel([1.3, -1.3, 1.0_f64.next_down()]), Some(Voxel { slice: 0, pixel: 9, level: 254 }));
        for outside in
            [[0.999, -2.0, 0.5], [2.0, -2.0, 0.5], [1.0, -1.25, 0.5], [1.0, -2.0, 1.5], [f64::NAN; 3]]
        {
            assert_eq!(voxel(outside), None, "{outside:?}");
        }
        assert_eq!(
            GRID.range(0, [1.25, 1.5]),
            Some(1..=2),
            "a box that ends on a line meets what is behind it"
        );
        assert_eq!(GRID.range(0, [-9.0, 9.0]), Some(0..=3));
        assert_eq!(GRID.range(2, [1.5, 2.0]), None);
        assert_eq!(GRID.range(2, [f64::NAN, 2.0]), None);
        assert_eq!(GRID.range(1, [0.0, -2.0]), None, "nothing lies between");
    }

    #[test]
    fn heights_and_levels_agree() {
        for slice in 0..2 {
            for level in [0, 1, 127, 253, 254] {
                let height = GRID.height(slice, level);
                let counted = i64::from(slice) * 255 + i64::from(level);
                assert_eq!(GRID.level_at(height + 1e-9), counted);
                assert_eq!(GRID.level_at(height - 1e-9), counted - 1);
                let voxel = GRID.voxel([1.1, -1.9, height]).unwrap();
                assert_eq!((voxel.slice, voxel.level), (slice as usize, level));
            }
        }
        assert!(GRID.level_at(0.0) < 0 && GRID.slice_at(0.0) == -1);
        let [lowest, highest] = [-1e300, f64::INFINITY].map(|height| GRID.level_at(height));
        assert!(lowest < -i64::from(u32::MAX) * 255 && highest > i64::from(u32::MAX) * 255, "beyond all");
        assert!(lowest.checked_sub(highest).is_some(), "and can be added");
    }
}
