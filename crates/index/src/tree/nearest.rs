//! The nearest neighbours of the points of a block.

use std::ops::ControlFlow;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, f64x8, mask32x16, u32x16};
use nearmiss_lanes::id32;
use nearmiss_lanes::wide::{WIDTH, bits, load, squared};

use super::walk::{NearWalker, Stack};
use super::{BlockTree, Bounds, Boxes};
use crate::block::PointBlock;

/// The number of keys in one register.
const HALF: usize = WIDTH / 2;

/// The index of each lane.
const ORDINALS: [f32; WIDTH] =
    [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0];

/// The key of a missing neighbour: infinite distance and greatest id, so it sorts last.
const NONE: f64 = f64::from_bits(0x7f80_0000_ffff_ffff);

/// A neighbour of a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Neighbour {
    /// The index of the point.
    pub id: u32,
    /// The squared distance of the point.
    pub distance_sq: f32,
}

/// The result of [`BlockTree::nearest`]. Can be reused.
///
/// Squared distance and id of a neighbour are packed into one double: the distance's bits in the
/// upper half, the id in the lower. Such doubles are positive and finite, and ascend by distance,
/// then id, so that the lesser of two takes one instruction on every processor.
#[derive(Debug, Clone, Default)]
pub struct Nearest {
    /// The keys of all lanes, by rank.
    keys: Vec<[[f64; HALF]; 2]>,
}

impl Nearest {
    /// Returns the neighbours of the block's point in this lane by distance, then id: the requested
    /// number, or all if there are fewer. Unspecified if the lane has no point.
    ///
    /// # Panics
    /// If `lane` is not below 16.
    pub fn of(&self, lane: usize) -> impl Iterator<Item = Neighbour> {
        self.keys.iter().map_while(move |keys| neighbour(keys[lane / HALF][lane % HALF]))
    }

    /// Returns the neighbour of a rank, from 0 for the nearest. Returns `None` if there are too few
    /// points or fewer neighbours were requested.
    ///
    /// # Panics
    /// If `lane` is not below 16.
    #[must_use]
    pub fn ranked(&self, lane: usize, rank: usize) -> Option<Neighbour> {
        neighbour(self.keys.get(rank)?[lane / HALF][lane % HALF])
    }
}

#[expect(clippy::cast_possible_truncation, reason = "both halves are wanted")]
fn neighbour(key: f64) -> Option<Neighbour> {
    let key = key.to_bits();
    let (id, distance) = (key as u32, (key >> 32) as u32);
    (id != u32::MAX).then(|| Neighbour { id, distance_sq: f32::from_bits(distance) })
}

/// The points of a block and the neighbours found so far.
struct Search<'a, S: Simd> {
    tree: &'a BlockTree<'a>,
    /// The lists of neighbours, as in [`Nearest`].
    keys: &'a mut [[[f64; HALF]; 2]],
    about: Bounds,
    points: [f32x16<S>; 3],
    present: mask32x16<S>,
    /// The squared distance of the last neighbour in each list; negative in lanes without a point.
    last: f32x16<S>,
    /// The greatest of `last`.
    limit: f32,
}

impl BlockTree<'_> {
    /// Finds the `count` nearest other points of each point of a block; ties go to the lower id.
    ///
    /// Six neighbours take 80 to 190 ns per point on scans with AVX-512, five to ten times less
    /// than with a kd-tree (`benches/src/bin/graph.rs`). Each further rank costs four instructions
    /// for each point that improves a list. The less the order of the points follows their
    /// positions, the more points are examined.
    ///
    /// # Panics
    /// If there is no such block.
    #[inline]
    pub fn nearest(&self, level: Level, block: usize, count: usize, found: &mut Nearest) {
        found.keys.clear();
        found.keys.resize(count, [[NONE; HALF]; 2]);
        if count > 0 {
            dispatch!(level, simd => simd.vectorize(
                #[inline(always)]
                || self.nearest_by(simd, block, found)
            ));
        }
    }

    #[inline(always)]
    fn nearest_by<S: Simd>(&self, simd: S, block: usize, found: &mut Nearest) {
        #[expect(clippy::cast_precision_loss, reason = "at most 16")]
        let present = f32x16::load_array_ref(simd, &ORDINALS).simd_lt(self.count(block) as f32);
        let (never, any) = (f32x16::simd_from(simd, -1.0), f32x16::simd_from(simd, f32::INFINITY));
        let mut search = Search {
            tree: self,
            keys: &mut found.keys,
            about: self.bounds(0, block),
            points: load(simd, &self.blocks[block].position),
            present,
            last: simd.select_f32x16(present, any, never),
            limit: f32::INFINITY,
        };
        search.offer(simd, block, true);
        // Search from the block up, neighbouring subtrees first, so that the limit is low before
        // distant nodes are visited.
        let (mut below, mut stack) = (block, Stack::new());
        for level in 0..self.levels.len() {
            let group = below / WIDTH;
            let siblings = !(1 << (below % WIDTH));
            // The walker never breaks.
            let _whole = self.groups().walk_near(simd, (level, group, siblings), &mut stack, &mut search);
            below = group;
        }
    }
}

impl<S: Simd> NearWalker<S> for Search<'_, S> {
    #[inline(always)]
    fn distances_sq(&self, simd: S, _: (usize, usize), boxes: &Boxes) -> f32x16<S> {
        boxes.distances_sq(simd, &self.about)
    }

    #[inline(always)]
    fn most_sq(&self) -> f32 {
        self.limit
    }

    #[inline(always)]
    fn is_wanted(&mut self, simd: S, level: usize, id: usize) -> bool {
        let bounds = self.tree.bounds(level, id);
        bits(bounds.distances_sq(simd, &self.points).simd_le(self.last)) != 0
    }

    #[inline(always)]
    fn block(&mut self, simd: S, id: usize, _: f32) -> ControlFlow<()> {
        self.offer(simd, id, false);
        ControlFlow::Continue(())
    }
}

impl<S: Simd> Search<'_, S> {
    /// Offers the points of block `id` to the lists. `own` tells that it is the block of the query
    /// points themselves.
    #[inline(always)]
    fn offer(&mut self, simd: S, id: usize, own: bool) {
        let tree = self.tree;
        let PointBlock { position: [x, y, z], .. } = &tree.blocks[id];
        let [px, py, pz] = self.points;
        let mut improved = false;
        for lane in 0..tree.count(id) {
            let d_sq = squared([px - x[lane], py - y[lane], pz - z[lane]]);
            if !d_sq.simd_le(self.last).any_true() {
                continue;
            }
            improved = true;
            let d_sq: u32x16<S> = d_sq.bitcast();
            let mut ids = u32x16::simd_from(simd, id32(id * WIDTH + lane));
            let mut distances = d_sq;
            if own {
                // A point is not its own neighbour.
                let this: mask32x16<S> = f32x16::load_array_ref(simd, &ORDINALS).simd_eq(ORDINALS[lane]);
                ids = simd.select_u32x16(this, u32x16::simd_from(simd, u32::MAX), ids);
                distances = simd.select_u32x16(this, u32x16::simd_from(simd, 0x7f80_0000), d_sq);
            }
            let mut low: f64x8<S> = ids.zip_low(distances).bitcast();
            let mut high: f64x8<S> = ids.zip_high(distances).bitcast();
            let mut greatest = (low, high);
            for [a, b] in &mut *self.keys {
                let (here, there) = (f64x8::load_array_ref(simd, a), f64x8::load_array_ref(simd, b));
                greatest = (here.min(low), there.min(high));
                (low, high) = (here.max(low), there.max(high));
                (*a, *b) = (greatest.0.to_array(), greatest.1.to_array());
            }
            let (low, high): (u32x16<S>, u32x16<S>) = (greatest.0.bitcast(), greatest.1.bitcast());
            let last: f32x16<S> = low.unzip_high(high).bitcast();
            self.last = simd.select_f32x16(self.present, last, self.last);
        }
        if improved {
            self.limit = self.last.to_array().into_iter().fold(0.0, f32::max);
        }
    }
}
