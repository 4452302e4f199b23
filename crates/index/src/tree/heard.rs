//! Which points are heard at those of a block.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16};
use nearmiss_lanes::id32;
use nearmiss_lanes::wide::{Bits, WIDTH, bits, load};

use super::BlockTree;

/// What [`BlockTree::heard`] found. Reused.
#[derive(Debug, Clone, Default)]
pub struct Heard {
    lists: [Vec<u32>; WIDTH],
    nodes: Vec<u32>,
    children: Vec<u32>,
}

impl Heard {
    /// The points heard at the block's point in this lane, itself among them if it has a horizon, ascending.
    ///
    /// # Panics
    /// When `lane` is not below 16.
    #[must_use]
    pub fn at(&self, lane: usize) -> &[u32] {
        &self.lists[lane]
    }
}

impl BlockTree<'_> {
    /// Finds for each point of a block all points whose balls meet its own: nearer than the sum of their
    /// horizons.
    ///
    /// A node is looked into if for one of the points it may hold an answer, so the cost follows what is
    /// found even where one lone point with a large horizon lies beside a dense cluster.
    ///
    /// # Panics
    /// When there is no such block.
    #[inline]
    pub fn heard(&self, level: Level, block: usize, found: &mut Heard) {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.heard_by(simd, block, found)
        ));
    }

    #[inline(always)]
    fn heard_by<S: Simd>(&self, simd: S, block: usize, found: &mut Heard) {
        let Heard { lists, nodes, children } = found;
        lists.iter_mut().for_each(Vec::clear);
        let own = &self.blocks[block];
        let points = load(simd, &own.position);
        let horizons = f32x16::load_array_ref(simd, &own.horizon);
        let about = self.bounds(0, block);
        let present = (1 << self.count(block)) - 1;
        // From the root down, each level ascending, so that points come ascending too.
        nodes.clear();
        nodes.push(0);
        for level in (0..self.levels.len()).rev() {
            children.clear();
            for &group in &*nodes {
                let boxes = &self.levels[level][group as usize];
                let far = f32x16::load_array_ref(simd, &boxes.horizon) + about.horizon;
                let near = boxes.distances_sq(simd, &about).simd_lt(far * far);
                for lane in Bits(bits(near)) {
                    let bounds = boxes.get(lane);
                    let far = horizons + bounds.horizon;
                    let near = bounds.distances_sq(simd, &points).simd_lt(far * far);
                    let near = bits(near) & present;
                    let id = group as usize * WIDTH + lane;
                    if near != 0 && level > 0 {
                        children.push(id32(id));
                    } else if near != 0 {
                        self.listen(simd, block, id, near, lists);
                    }
                }
            }
            std::mem::swap(nodes, children);
        }
    }

    /// Adds the points of block `id` that are heard at points of `block` to the lists of these; `lanes` says
    /// which to ask for.
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
