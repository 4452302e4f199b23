//! What cones over points leave free: the greatest values below theirs that nowhere grow faster than the
//! cones do.

use std::ops::ControlFlow;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16};
use nearmiss_lanes::wide::{WIDTH, bits, load, squared};

use super::walk::Walker;
use super::{BlockTree, Bounds};

/// By so much rounding may make a square differ from another, relatively; what is as near as that is
/// measured.
const SURELY: f32 = 1.0 - 4e-6;

/// A cone over every point of a [`BlockTree`], opening upwards.
#[derive(Debug, Clone)]
pub struct Cones<'a> {
    tree: &'a BlockTree<'a>,
    slope: f32,
    /// The heights of the tips; infinite where there is no point.
    tips: &'a [[f32; WIDTH]],
    /// The least tip of each box of the tree, level by level.
    least: Vec<Vec<[f32; WIDTH]>>,
}

impl<'a> BlockTree<'a> {
    /// Cones that rise by `slope`, not negative, per length, with their tips at the heights of points, which
    /// may be infinite, but are numbers. They are kept in `tips`. O(n).
    ///
    /// # Panics
    /// When `tips` has not an item for every block.
    #[must_use]
    pub fn cones(
        &'a self,
        tips: &'a mut [[f32; WIDTH]],
        height: impl Fn(usize) -> f32,
        slope: f32,
    ) -> Cones<'a> {
        assert_eq!(tips.len(), self.blocks.len(), "tips a block");
        for (block, tips) in tips.iter_mut().enumerate() {
            *tips = [f32::INFINITY; WIDTH];
            let points = block * WIDTH..block * WIDTH + self.count(block);
            tips.iter_mut().zip(points).for_each(|(tip, i)| *tip = height(i));
        }
        let mut least: Vec<Vec<[f32; WIDTH]>> = Vec::with_capacity(self.levels.len());
        for _ in self.levels {
            let below = least.last().map_or(&*tips, |least| least);
            let tips: Vec<f32> =
                below.iter().map(|row| row.iter().copied().fold(f32::INFINITY, f32::min)).collect();
            least.push(rows(&tips));
        }
        Cones { tree: self, slope, tips, least }
    }
}

/// Sixteen at a time, infinite ones at the end.
fn rows(heights: &[f32]) -> Vec<[f32; WIDTH]> {
    let row = |heights: &[f32]| {
        let mut row = [f32::INFINITY; WIDTH];
        row[..heights.len()].copy_from_slice(heights);
        row
    };
    heights.chunks(WIDTH).map(row).collect()
}

/// The points of a block, how low the cones found so far are there, and the highest of these.
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
    /// The least of each of `heights` over the points of a block and of all cones there: of height + slope ·
    /// distance, all rounded.
    ///
    /// Exactly so, whatever the order of the points; it decides how much is looked at. Lanes without a point
    /// keep their height. Does not allocate.
    ///
    /// # Panics
    /// When there is no such block.
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
        // Nothing ends it.
        let _whole = tree.walk(simd, &mut search);
        let mut heights = *heights;
        heights[..count].copy_from_slice(&search.lowest.to_array()[..count]);
        heights
    }

    /// Whether cones may rise by less than the margins over such squared distances.
    #[inline(always)]
    fn is_below<S: Simd>(&self, distances_sq: f32x16<S>, margins: f32x16<S>) -> mask32x16<S> {
        let rises_sq = distances_sq * (self.slope * self.slope * SURELY);
        margins.simd_gt(0.0) & rises_sq.simd_le(margins * margins)
    }

    /// Whether a cone over a block may be below what is known at one of the points.
    #[inline(always)]
    fn may_hold<S: Simd>(&self, simd: S, id: usize, search: &Search<'_, S>) -> bool {
        let bounds = self.tree.bounds(0, id);
        let margins = search.lowest - self.least[0][id / WIDTH][id % WIDTH];
        bits(self.is_below(bounds.distances_sq(simd, &search.points), margins)) != 0
    }

    /// Offers the cones over a block.
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
