//! A grid over the blocks of a tree: a small sphere begins at the blocks near the cell of its centre instead
//! of at the root.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, mask32x16};
use nearmiss_lanes::id32;
use nearmiss_lanes::wide::{Bits, bits, load, squared};

use super::{BlockTree, Bounds};

/// A cell takes eight bytes.
const CELLS_A_POINT: f64 = 1.0;

/// Blocks are named by the cells that are so near, in cells: about a local radius where scans are of
/// surfaces.
const MARGIN: f64 = 0.5;

/// A cell names no more blocks; where there are more, the tree is as fast. On surfaces there are some six.
const MOST_NAMED: u32 = 24;

/// What single precision makes of a coordinate and of a difference of two, relatively, on either side.
const ROUNDING: f64 = 5e-7;

/// In the place of a number of blocks: more than that.
const CROWDED: u32 = u32::MAX;

/// For each cell of a grid the blocks of a [`BlockTree`] that are near: some twenty bytes a point.
#[derive(Debug, Clone)]
pub struct Cells {
    min: [f64; 3],
    per_cell: f64,
    size: [usize; 3],
    /// Of a place in a cell no point of a block that the cell does not name is within this distance.
    margin: f64,
    /// The first name of each cell, and how many it has.
    ranges: Vec<[u32; 2]>,
    named: Vec<u32>,
}

/// A block that a cell names.
#[derive(Debug, Clone, Copy)]
struct Named {
    cell: u32,
    block: u32,
    /// The squared distance of its nearest point from the middle of the cell.
    distance_sq: f32,
}

impl BlockTree<'_> {
    /// A grid of cubes over all points, at most one a point. O(n).
    #[must_use]
    pub fn cells(&self, level: Level) -> Cells {
        let mut cells = self.grid();
        let mut all = Vec::new();
        for block in 0..self.blocks.len() {
            dispatch!(level, simd => simd.vectorize(
                #[inline(always)]
                || self.name(simd, block, &cells, &mut all),
            ));
        }
        for named in &all {
            cells.ranges[named.cell as usize][1] += 1;
        }
        let mut end = 0;
        for [first, count] in &mut cells.ranges {
            *first = end;
            if *count > MOST_NAMED {
                *count = CROWDED;
            } else {
                (end, *count) = (end + *count, 0);
            }
        }
        let mut places = vec![(0.0, 0); end as usize];
        for &Named { cell, block, distance_sq } in &all {
            let [first, count] = &mut cells.ranges[cell as usize];
            if *count == CROWDED {
                continue;
            }
            // By insertion, the nearest first: they are few.
            let mut place = (*first + *count) as usize;
            while place > *first as usize && places[place - 1].0 > distance_sq {
                places[place] = places[place - 1];
                place -= 1;
            }
            places[place] = (distance_sq, block);
            *count += 1;
        }
        cells.named = places.into_iter().map(|(_, block)| block).collect();
        cells
    }

    /// Adds the cells that a block is named by.
    #[inline(always)]
    fn name<S: Simd>(&self, simd: S, block: usize, cells: &Cells, all: &mut Vec<Named>) {
        let points = load(simd, &self.blocks[block].position);
        let present = (1_u32 << self.count(block)) - 1;
        let [xs, ys, zs] = cells.reached(&self.bounds(0, block));
        for x in xs {
            for y in ys.clone() {
                for z in zs.clone() {
                    let (about, margin) = cells.cube([x, y, z]);
                    let near: mask32x16<S> = about.distances_sq(simd, &points).simd_le(margin * margin);
                    let near = bits(near) & present;
                    if near != 0 {
                        let middle = [0, 1, 2].map(|k| 0.5 * (about.min[k] + about.max[k]));
                        let d = [points[0] - middle[0], points[1] - middle[1], points[2] - middle[2]];
                        let distances = squared(d).to_array();
                        let mut distance_sq = f32::INFINITY;
                        for lane in Bits(near) {
                            distance_sq = distance_sq.min(distances[lane]);
                        }
                        let cell = id32((x * cells.size[1] + y) * cells.size[2] + z);
                        all.push(Named { cell, block: id32(block), distance_sq });
                    }
                }
            }
        }
    }

    /// The grid, without names.
    #[expect(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "cells are counted in small numbers"
    )]
    fn grid(&self) -> Cells {
        let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for block in 0..self.blocks.len() {
            let bounds = self.bounds(0, block);
            for k in 0..3 {
                min[k] = min[k].min(f64::from(bounds.min[k]));
                max[k] = max[k].max(f64::from(bounds.max[k]));
            }
        }
        let most = CELLS_A_POINT * self.points as f64;
        // The edge of as many cubes as may be, with the margin about the points, in a few steps.
        let longest = (0..3).fold(f64::MIN_POSITIVE, |longest: f64, k| longest.max(max[k] - min[k]));
        let count = |edge: f64| {
            (0..3).map(|k| ((max[k] - min[k]) / edge + 2.0 * MARGIN).floor() + 1.0).product::<f64>()
        };
        let mut edge = longest;
        while count(0.9 * edge) <= most {
            edge *= 0.9;
        }
        let margin = MARGIN * edge;
        let far = (0..3).fold(edge, |far, k| far.max(min[k].abs()).max(max[k].abs()));
        let size = [0, 1, 2].map(|k| ((max[k] - min[k]) / edge + 2.0 * MARGIN) as usize + 1);
        Cells {
            min: min.map(|c| c - margin),
            per_cell: 1.0 / edge,
            size,
            // Cells are found, and blocks named, by rounded numbers.
            margin: margin * (1.0 - 1e-5) - ROUNDING * far,
            ranges: vec![[0, 0]; size.iter().product()],
            named: Vec::new(),
        }
    }
}

impl Cells {
    /// The blocks whose points may be within `radius` of `place`, the nearest first more or less; None if
    /// they are not known: radii are to be less than half a cell, and blocks few. O(1).
    #[inline]
    #[must_use]
    pub fn near(&self, place: [f64; 3], radius: f64) -> Option<&[u32]> {
        if radius.is_nan() || radius > self.margin {
            return None;
        }
        let mut cell = 0;
        for k in 0..3 {
            let at = (place[k] - self.min[k]) * self.per_cell;
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
            let number = at as usize;
            // Beyond the grid there are no points within the margin; nor near a place that is none.
            if at.is_nan() || at < 0.0 || number >= self.size[k] {
                return Some(&[]);
            }
            cell = cell * self.size[k] + number;
        }
        let [first, count] = self.ranges[cell];
        if count == CROWDED { None } else { self.named.get(first as usize..(first + count) as usize) }
    }

    /// The cells that a box may be within the margin of, along each axis.
    fn reached(&self, bounds: &Bounds) -> [std::ops::RangeInclusive<usize>; 3] {
        [0, 1, 2].map(|k| {
            // A little more, for rounding.
            let reach = (MARGIN + 1e-6) / self.per_cell;
            let cell = |c: f64| (c - self.min[k]) * self.per_cell;
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the grid")]
            let range = cell(f64::from(bounds.min[k]) - reach).max(0.0) as usize
                ..=(cell(f64::from(bounds.max[k]) + reach) as usize).min(self.size[k] - 1);
            range
        })
    }

    /// The cube of a cell, and the margin about it, both rounded.
    #[expect(clippy::cast_precision_loss, clippy::cast_possible_truncation, reason = "the margin covers it")]
    fn cube(&self, cell: [usize; 3]) -> (Bounds, f32) {
        let edge = 1.0 / self.per_cell;
        let side = |k: usize, beyond: f64| (self.min[k] + edge * (cell[k] as f64 + beyond)) as f32;
        let (min, max) = ([0, 1, 2].map(|k| side(k, 0.0)), [0, 1, 2].map(|k| side(k, 1.0)));
        (Bounds { min, max, horizon: 0.0 }, (MARGIN * edge) as f32)
    }
}
