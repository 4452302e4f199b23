//! A grid over the blocks of a tree. Queries with small spheres start at the blocks near the cell
//! of the centre instead of at the root.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, mask32x16};
use nearmiss_lanes::id32;
use nearmiss_lanes::wide::{Bits, bits, load, squared};

use super::{BlockTree, Bounds};
use crate::cubes::Cubes;

/// The maximum number of cells for each point. A cell takes eight bytes.
const CELLS_A_POINT: f64 = 1.0;

/// The distance, in cell edges, up to which a cell lists blocks: about one local radius if the scan
/// is of a surface.
const MARGIN: f64 = 0.5;

/// The maximum number of blocks that a cell lists; with more, the tree is as fast. On surfaces
/// there are about six.
const MOST_NAMED: u32 = 24;

/// Bound on the rounding of cell corners and coordinate differences in single precision, relative
/// to the largest coordinate.
const ROUNDING: f64 = 5e-7;

/// Marks a cell with more than [`MOST_NAMED`] blocks in place of their number.
const CROWDED: u32 = u32::MAX;

/// A grid that lists the nearby blocks of a [`BlockTree`] for each cell. Takes about 20 bytes for
/// each point.
#[derive(Debug, Clone)]
pub struct BlockGrid {
    cubes: Cubes,
    /// Every block with a point within this distance of a position in a cell is listed by the cell.
    margin: f64,
    /// The start of each cell's list in `named`, and its length.
    ranges: Vec<[u32; 2]>,
    named: Vec<u32>,
}

/// A block that a cell lists.
#[derive(Debug, Clone, Copy)]
struct Named {
    cell: u32,
    block: u32,
    /// The squared distance between the centre of the cell and the nearest point of the block.
    distance_sq: f32,
}

impl BlockTree<'_> {
    /// Builds a grid of cubes over all points, with at most one cell for each point. O(n).
    #[must_use]
    pub fn cells(&self, level: Level) -> BlockGrid {
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
            // Insertion sort, nearest first: the lists are short.
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

    /// Appends an entry to `all` for each cell that lists a block.
    #[inline(always)]
    fn name<S: Simd>(&self, simd: S, block: usize, cells: &BlockGrid, all: &mut Vec<Named>) {
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
                        let cell = id32(cells.cubes.number([x, y, z]));
                        all.push(Named { cell, block: id32(block), distance_sq });
                    }
                }
            }
        }
    }

    /// Returns the grid with empty lists.
    #[expect(clippy::cast_precision_loss, reason = "a count")]
    fn grid(&self) -> BlockGrid {
        let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for block in 0..self.blocks.len() {
            let bounds = self.bounds(0, block);
            for k in 0..3 {
                min[k] = min[k].min(f64::from(bounds.min[k]));
                max[k] = max[k].max(f64::from(bounds.max[k]));
            }
        }
        let cubes = Cubes::new([min, max], MARGIN, (0.0, CELLS_A_POINT * self.points as f64));
        let edge = cubes.edge();
        let far = (0..3).fold(edge, |far, k| far.max(min[k].abs()).max(max[k].abs()));
        BlockGrid {
            cubes,
            // Cell lookup and block lists work with rounded numbers.
            margin: MARGIN * edge * (1.0 - 1e-5) - ROUNDING * far,
            ranges: vec![[0, 0]; cubes.count()],
            named: Vec::new(),
        }
    }
}

impl BlockGrid {
    /// Returns the blocks that may have points within `radius` of `place`, roughly nearest first.
    /// Returns `None` if the grid cannot tell: `radius` exceeds about half a cell, or more than 24
    /// blocks are near the cell. O(1).
    #[inline]
    #[must_use]
    pub fn near(&self, place: [f64; 3], radius: f64) -> Option<&[u32]> {
        if radius.is_nan() || radius > self.margin {
            return None;
        }
        // No points are within the margin of a place outside the grid, and none are near NaN.
        let Some(cell) = self.cubes.at(place) else { return Some(&[]) };
        let [first, count] = self.ranges[cell];
        if count == CROWDED { None } else { self.named.get(first as usize..(first + count) as usize) }
    }

    /// Returns the range of cells along each axis that a box may be within the margin of.
    fn reached(&self, bounds: &Bounds) -> [std::ops::RangeInclusive<usize>; 3] {
        let size = self.cubes.size();
        [0, 1, 2].map(|k| {
            // Slightly more, because of rounding.
            let reach = MARGIN + 1e-6;
            let cell = |c: f32| self.cubes.along(k, f64::from(c));
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the grid")]
            let range = (cell(bounds.min[k]) - reach).max(0.0) as usize
                ..=((cell(bounds.max[k]) + reach) as usize).min(size[k] - 1);
            range
        })
    }

    /// Returns the cube of a cell and the margin around it, both rounded.
    #[expect(clippy::cast_possible_truncation, reason = "the margin covers it")]
    fn cube(&self, cell: [usize; 3]) -> (Bounds, f32) {
        let edge = self.cubes.edge();
        let corner = self.cubes.corner(cell);
        let (min, max) = (corner.map(|c| c as f32), corner.map(|c| (c + edge) as f32));
        (Bounds { min, max, support_radius: 0.0 }, (MARGIN * edge) as f32)
    }
}
