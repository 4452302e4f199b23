//! Lower envelopes of cones over points: the greatest values that are below the given ones and
//! nowhere grow faster than `slope`.

use std::ops::ControlFlow;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16};
use nearmiss_lanes::parallel::{fill, map_all};
use nearmiss_lanes::wide::{WIDTH, bits, load, squared};

use super::walk::Walker;
use super::{BlockTree, Bounds};

/// Allowance for the relative rounding error of squares: pairs that are not clearly above are
/// measured.
const SURELY: f32 = 1.0 - 4e-6;

/// A cone over every point of a [`BlockTree`], opening upwards.
#[derive(Debug, Clone)]
pub struct Cones<'a> {
    tree: &'a BlockTree<'a>,
    slope: f32,
    /// The heights of the tips; infinite in unused lanes.
    tips: &'a [[f32; WIDTH]],
    /// The lowest tip in each box of the tree, by level.
    least: Vec<Vec<[f32; WIDTH]>>,
}

impl<'a> BlockTree<'a> {
    /// Returns cones that rise by `slope` (at least 0) per unit length, with their tips at the
    /// heights of the points. Heights may be infinite but not NaN. They are kept in `tips`. O(n).
    ///
    /// # Panics
    /// If `tips` does not have one item for each block.
    #[must_use]
    pub fn cones(
        &'a self,
        tips: &'a mut [[f32; WIDTH]],
        height: impl Fn(usize) -> f32 + Sync + Send,
        slope: f32,
    ) -> Cones<'a> {
        assert_eq!(tips.len(), self.blocks.len(), "expected tips for each block");
        fill(tips, |block| {
            let mut tips = [f32::INFINITY; WIDTH];
            let points = block * WIDTH..block * WIDTH + self.count(block);
            tips.iter_mut().zip(points).for_each(|(tip, i)| *tip = height(i));
            tips
        });
        let mut least: Vec<Vec<[f32; WIDTH]>> = Vec::with_capacity(self.levels.len());
        for _ in self.levels {
            let below = least.last().map_or(&*tips, |least| least);
            let tips = map_all(below, |row| row.iter().copied().fold(f32::INFINITY, f32::min));
            least.push(rows(&tips));
        }
        Cones { tree: self, slope, tips, least }
    }
}

/// Groups heights by sixteen and pads them with infinity.
fn rows(heights: &[f32]) -> Vec<[f32; WIDTH]> {
    let row = |heights: &[f32]| {
        let mut row = [f32::INFINITY; WIDTH];
        row[..heights.len()].copy_from_slice(heights);
        row
    };
    heights.chunks(WIDTH).map(row).collect()
}

/// The points of a block, the height of the lowest cone found so far at each, and the greatest of
/// these heights.
struct Search<'a, S: Simd> {
    cones: &'a Cones<'a>,
    block: usize,
    about: Bounds,
    points: [f32x16<S>; 3],
    lowest: f32x16<S>,
    limit: f32,
}

impl<S: Simd> Walker<S> for Search<'_, S> {
    #[inline(always)]
    fn wanted(&mut self, simd: S, level: usize, group: usize) -> u32 {
        let cones = self.cones;
        let distances = cones.tree.levels[level][group].distances_sq(simd, &self.about);
        let margins = -(f32x16::load_array_ref(simd, &cones.least[level][group]) - self.limit);
        bits(cones.is_below(distances, margins))
    }

    #[inline(always)]
    fn block(&mut self, simd: S, id: usize) -> ControlFlow<()> {
        let cones = self.cones;
        if id != self.block && cones.may_hold(simd, id, self) {
            cones.offer(simd, id, self);
        }
        ControlFlow::Continue(())
    }
}

impl Cones<'_> {
    /// Returns the minimum of each of `heights` and all cones at that point of a block: of height +
    /// slope · distance, rounded.
    ///
    /// The result is exact for any order of the points, which affects only the running time. Lanes
    /// without a point keep their height. Does not allocate.
    ///
    /// # Panics
    /// If there is no such block.
    #[inline]
    #[must_use]
    pub fn below(&self, level: Level, block: usize, heights: &[f32; WIDTH]) -> [f32; WIDTH] {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.below_by(simd, block, heights)
        ))
    }

    #[inline(always)]
    fn below_by<S: Simd>(&self, simd: S, block: usize, heights: &[f32; WIDTH]) -> [f32; WIDTH] {
        let tree = self.tree;
        let mut lowest = [f32::NEG_INFINITY; WIDTH];
        let count = tree.count(block);
        lowest[..count].copy_from_slice(&heights[..count]);
        let (about, points) = (tree.bounds(0, block), load(simd, &tree.blocks[block].position));
        let lowest = f32x16::load_array(simd, lowest);
        let mut search = Search { cones: self, block, about, points, lowest, limit: f32::INFINITY };
        self.offer(simd, block, &mut search);
        // The walker never breaks.
        let _whole = tree.groups().walk(simd, &mut search);
        let mut heights = *heights;
        heights[..count].copy_from_slice(&search.lowest.to_array()[..count]);
        heights
    }

    /// Returns the lanes in which a cone may rise by less than the margin over the distance.
    #[inline(always)]
    fn is_below<S: Simd>(&self, distances_sq: f32x16<S>, margins: f32x16<S>) -> mask32x16<S> {
        let rises_sq = distances_sq * (self.slope * self.slope * SURELY);
        margins.simd_gt(0.0) & rises_sq.simd_le(margins * margins)
    }

    /// Returns `true` if a cone over a block may be below the lowest known height at one of the
    /// points.
    #[inline(always)]
    fn may_hold<S: Simd>(&self, simd: S, id: usize, search: &Search<'_, S>) -> bool {
        let bounds = self.tree.bounds(0, id);
        let margins = search.lowest - self.least[0][id / WIDTH][id % WIDTH];
        bits(self.is_below(bounds.distances_sq(simd, &search.points), margins)) != 0
    }

    /// Lowers the heights to those of the cones over a block.
    #[inline(always)]
    fn offer<S: Simd>(&self, simd: S, id: usize, search: &mut Search<'_, S>) {
        let [x, y, z] = &self.tree.blocks[id].position;
        let [px, py, pz] = search.points;
        for lane in 0..self.tree.count(id) {
            let (d_sq, tip) = (squared([px - x[lane], py - y[lane], pz - z[lane]]), self.tips[id][lane]);
            let near = self.is_below(d_sq, search.lowest - tip);
            if near.any_true() {
                let heights = (d_sq.sqrt() * self.slope + tip).min(search.lowest);
                search.lowest = simd.select_f32x16(near, heights, search.lowest);
            }
        }
        search.limit = f32::NEG_INFINITY;
        for lowest in search.lowest.to_array() {
            search.limit = search.limit.max(lowest);
        }
    }
}
