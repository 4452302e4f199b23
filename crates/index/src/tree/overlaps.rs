//! The points whose support balls meet those of the points of a block.

use std::ops::ControlFlow;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16};
use nearmiss_lanes::id32;
use nearmiss_lanes::wide::{Bits, WIDTH, bits, load};

use super::walk::Walker;
use super::{BlockTree, Bounds};

/// The result of [`BlockTree::overlapping`]. Can be reused.
#[derive(Debug, Clone, Default)]
pub struct Overlaps {
    lists: [Vec<u32>; WIDTH],
}

impl Overlaps {
    /// Returns the points whose balls meet that of the block's point in this lane, ascending. The
    /// point itself is among them if its support radius is positive.
    ///
    /// # Panics
    /// If `lane` is not below 16.
    #[must_use]
    pub fn at(&self, lane: usize) -> &[u32] {
        &self.lists[lane]
    }
}

impl BlockTree<'_> {
    /// Finds for each point of a block all points whose balls meet its own: nearer than the sum of
    /// the support radii.
    ///
    /// A node is visited only if it may hold a result for one of the points. The cost therefore
    /// follows the size of the result, even if one isolated point with a large support radius is
    /// next to a dense cluster.
    ///
    /// # Panics
    /// If there is no such block.
    #[inline]
    pub fn overlapping(&self, level: Level, block: usize, found: &mut Overlaps) {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.overlapping_by(simd, block, found)
        ));
    }

    #[inline(always)]
    fn overlapping_by<S: Simd>(&self, simd: S, block: usize, found: &mut Overlaps) {
        let Overlaps { lists } = found;
        lists.iter_mut().for_each(Vec::clear);
        let own = &self.blocks[block];
        let mut search = Search {
            tree: self,
            block,
            about: self.bounds(0, block),
            points: load(simd, &own.position),
            support_radii: f32x16::load_array_ref(simd, &own.support_radius),
            present: self.present(block),
            lists,
        };
        // The walker never breaks. It visits blocks in order, so the ids in each list ascend.
        let _whole = self.groups().walk(simd, &mut search);
    }

    /// Adds the points of block `id` whose balls meet those of points of `block` to the lists of
    /// the latter, for the given lanes of `block`.
    #[inline(always)]
    fn add_overlapping<S: Simd>(
        &self,
        simd: S,
        block: usize,
        id: usize,
        lanes: u32,
        lists: &mut [Vec<u32>; WIDTH],
    ) {
        let own = &self.blocks[block];
        let [x, y, z] = &own.position;
        for lane in Bits(lanes) {
            let mut overlapping = [0; WIDTH];
            let other = &self.blocks[id];
            let place = [x[lane], y[lane], z[lane]];
            let count =
                other.supporting(simd, place, own.support_radius[lane], id32(id * WIDTH), &mut overlapping);
            lists[lane].extend_from_slice(&overlapping[..count]);
        }
    }
}

/// The search for the points whose balls meet those of the points of a block.
struct Search<'a, S: Simd> {
    tree: &'a BlockTree<'a>,
    block: usize,
    about: Bounds,
    points: [f32x16<S>; 3],
    support_radii: f32x16<S>,
    /// The lanes that have points, as bits.
    present: u32,
    lists: &'a mut [Vec<u32>; WIDTH],
}

impl<S: Simd> Search<'_, S> {
    /// Returns the lanes of the points whose balls may meet one in a box, as bits.
    #[inline(always)]
    fn lanes_near(&self, simd: S, bounds: &Bounds) -> u32 {
        let far = self.support_radii + bounds.support_radius;
        bits(bounds.distances_sq(simd, &self.points).simd_lt(far * far)) & self.present
    }
}

impl<S: Simd> Walker<S> for Search<'_, S> {
    #[inline(always)]
    fn wanted(&mut self, simd: S, level: usize, group: usize) -> u32 {
        let boxes = &self.tree.levels[level][group];
        let far = f32x16::load_array_ref(simd, &boxes.support_radius) + self.about.support_radius;
        let near = bits(boxes.distances_sq(simd, &self.about).simd_lt(far * far));
        if level == 0 {
            return near;
        }
        let is_near = |&lane: &usize| self.lanes_near(simd, &boxes.get(lane)) != 0;
        Bits(near).filter(is_near).fold(0, |lanes, lane| lanes | 1 << lane)
    }

    #[inline(always)]
    fn block(&mut self, simd: S, id: usize) -> ControlFlow<()> {
        let lanes = self.lanes_near(simd, &self.tree.bounds(0, id));
        if lanes != 0 {
            self.tree.add_overlapping(simd, self.block, id, lanes, self.lists);
        }
        ControlFlow::Continue(())
    }
}
