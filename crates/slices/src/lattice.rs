//! The lattice of places on which reach and routes are searched.

use crate::{Avatar, Grid};

/// A base that is a whole number of pixels long, up to this share of a pixel, counts as that
/// number.
const TOLERANCE: f64 = 0.01;

/// Equidistant places along both horizontal axes, as far as a base there meets the map.
///
/// A base of side `b` over pixels of side `t` covers `⌊b/t⌋ + 1` of them along an axis or one more,
/// depending on its position. The places are the centres of blocks with the lesser number of
/// pixels. So an avatar passes every gap that it can pass at all, provided that the spacing is a
/// pixel or a whole part of it. The places depend on the map and the avatar alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepGrid {
    /// The place of column 0 and row 0, in the map's horizontal coordinates.
    pub origin: [f64; 2],
    /// Distance between neighbours along an axis.
    pub spacing: f64,
    /// Columns and rows.
    pub counts: [u64; 2],
}

impl StepGrid {
    /// Returns the lattice of an avatar over a map, with this spacing, which must be above zero.
    #[must_use]
    pub fn new(grid: &Grid, avatar: &Avatar, spacing: f64) -> Self {
        let base = grid.up.across(avatar.options().base);
        let axis = |k: usize| {
            let covered = (base[k] / grid.pixel + TOLERANCE).floor() + 1.0;
            let phase = 0.5 * covered * grid.pixel;
            let end = f64::from(grid.counts[k]) * grid.pixel;
            let first = ((-0.5 * base[k] - phase) / spacing).ceil();
            let last = ((end + 0.5 * base[k] - phase) / spacing).floor();
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the cast saturates")]
            let count = (last - first + 1.0) as u64;
            (grid.origin[k] + phase + first * spacing, count)
        };
        let [(x, columns), (y, rows)] = [axis(0), axis(1)];
        Self { origin: [x, y], spacing, counts: [columns, rows] }
    }

    /// Returns the place of a column and a row, in the map's horizontal coordinates.
    #[must_use]
    pub fn place(&self, cell: [u32; 2]) -> [f64; 2] {
        [0, 1].map(|k| self.origin[k] + f64::from(cell[k]) * self.spacing)
    }

    /// Returns the column and the row of the place nearest to `place`, in the map's horizontal
    /// coordinates.
    pub(crate) fn nearest(&self, place: [f64; 2]) -> [u32; 2] {
        [0, 1].map(|k| self.clamped(k, ((place[k] - self.origin[k]) / self.spacing).round()))
    }

    /// Returns the corners of the cell that holds `place`, as far as they are on the lattice.
    pub(crate) fn corners(&self, place: [f64; 2]) -> impl Iterator<Item = [u32; 2]> + use<> {
        let low = [0, 1].map(|k| ((place[k] - self.origin[k]) / self.spacing).floor());
        let lattice = *self;
        [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].into_iter().filter_map(move |off| {
            let cell = [0, 1].map(|k| lattice.clamped(k, low[k] + off[k]));
            (0..2).all(|k| f64::from(cell[k]) == low[k] + off[k]).then_some(cell)
        })
    }

    /// Returns the neighbour of a place in a direction, if it is on the lattice.
    pub(crate) fn neighbour(&self, cell: [u32; 2], [dx, dy]: [i32; 2]) -> Option<[u32; 2]> {
        let next = [cell[0].checked_add_signed(dx)?, cell[1].checked_add_signed(dy)?];
        (0..2).all(|k| u64::from(next[k]) < self.counts[k]).then_some(next)
    }

    #[expect(clippy::cast_precision_loss, reason = "a count of places, far below 2^53 where it is used")]
    fn clamped(&self, axis: usize, index: f64) -> u32 {
        let last = (self.counts[axis].saturating_sub(1) as f64).min(f64::from(u32::MAX));
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within 0 and u32::MAX")]
        let index = index.clamp(0.0, last) as u32;
        index
    }
}
