//! The points whose support balls meet those of the points of a block.

use std::ops::ControlFlow;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16};
use nearmiss_lanes::id32;
use nearmiss_lanes::wide::{Bits, WIDTH, bits, load};

use super::walk::Walker;
use super::{BlockTree, Bounds};

/// The result of [`BlockTree::heard`]. Can be reused.
#[derive(Debug, Clone, Default)]
pub struct Heard {
    lists: [Vec<u32>; WIDTH],
}

impl Heard {
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
    pub fn heard(&self, level: Level, block: usize, found: &mut Heard) {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.heard_by(simd, block, found)
        ));
    }

    #[inline(always)]
    fn heard_by<S: Simd>(&self, simd: S, block: usize, found: &mut Heard) {
        let Heard { lists } = found;
        lists.iter_mut().for_each(Vec::clear);
        let own = &self.blocks[block];
        let mut search = Search {
            tree: self,
            block,
            about: self.bounds(0, block),
            points: load(simd, &own.position),
            horizons: f32x16::load_array_ref(simd, &own.horizon),
            present: self.present(block),
            lists,
        };
        // The walker never breaks. It visits blocks in order, so the ids in each list ascend.
        let _whole = self.walk(simd, &mut search);
    }

    /// Adds the points of block `id` whose balls meet those of points of `block` to the lists of
    /// the latter, for the given lanes of `block`.
    #[inline(always)]
    fn listen<S: Simd>(&self, simd: S, block: usize, id: usize, lanes: u32, lists: &mut [Vec<u32>; WIDTH]) {
        let own = &self.blocks[block];
        let [x, y, z] = &own.position;
        for lane in Bits(lanes) {
            let mut heard = [0; WIDTH];
            let other = &self.blocks[id];
            let place = [x[lane], y[lane], z[lane]];
            let count = other.heard(simd, place, own.horizon[lane], id32(id * WIDTH), &mut heard);
            lists[lane].extend_from_slice(&heard[..count]);
        }
    }
}

/// The search for the points whose balls meet those of the points of a block.
struct Search<'a, S: Simd> {
    tree: &'a BlockTree<'a>,
    block: usize,
    about: Bounds,
    points: [f32x16<S>; 3],
    horizons: f32x16<S>,
    /// The lanes that have points, as bits.
    present: u32,
    lists: &'a mut [Vec<u32>; WIDTH],
}

impl<S: Simd> Search<'_, S> {
    /// Returns the lanes of the points whose balls may meet one in a box, as bits.
    #[inline(always)]
    fn lanes_near(&self, simd: S, bounds: &Bounds) -> u32 {
        let far = self.horizons + bounds.horizon;
        bits(bounds.distances_sq(simd, &self.points).simd_lt(far * far)) & self.present
    }
}

impl<S: Simd> Walker<S> for Search<'_, S> {
    #[inline(always)]
    fn wanted(&mut self, simd: S, level: usize, group: usize) -> u32 {
        let boxes = &self.tree.levels[level][group];
        let far = f32x16::load_array_ref(simd, &boxes.horizon) + self.about.horizon;
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
            self.tree.listen(simd, self.block, id, lanes, self.lists);
        }
        ControlFlow::Continue(())
    }
}
