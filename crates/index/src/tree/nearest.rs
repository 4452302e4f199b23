//! The nearest neighbours of the points of a block.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, f64x8, mask32x16, u32x16};
use nearmiss_lanes::id32;
use nearmiss_lanes::wide::{Bits, WIDTH, bits, load, squared};

use super::{BlockTree, Bounds};
use crate::block::PointBlock;

/// Half a register's worth of keys each.
const HALF: usize = WIDTH / 2;

/// The number of each lane.
const ORDINALS: [f32; WIDTH] =
    [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0];

/// What stands where there is no neighbour: further than any, after any id.
const NONE: f64 = f64::from_bits(0x7f80_0000_ffff_ffff);

/// A neighbour of a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Neighbour {
    /// Which point.
    pub id: u32,
    /// The square of its distance.
    pub distance_sq: f32,
}

/// A node to look into, with its squared distance.
#[derive(Debug, Clone, Copy)]
struct Open {
    distance_sq: f32,
    level: u32,
    id: u32,
}

/// What [`BlockTree::nearest`] found. Reused.
///
/// Distance and id of a neighbour are kept as one double: its upper half has the bits of the squared
/// distance, its lower those of the id. Such doubles are positive and finite, and ascend by distance, then
/// id, so that the lesser of two is one instruction everywhere.
#[derive(Debug, Clone, Default)]
pub struct Nearest {
    /// A rank each, of all lanes.
    keys: Vec<[[f64; HALF]; 2]>,
    open: Vec<Open>,
}

impl Nearest {
    /// The neighbours of the block's point in this lane by distance, then id: as many as were asked for, or
    /// all. Anything where the lane has no point.
    ///
    /// # Panics
    /// When `lane` is not below 16.
    pub fn of(&self, lane: usize) -> impl Iterator<Item = Neighbour> {
        self.keys.iter().map_while(move |keys| neighbour(keys[lane / HALF][lane % HALF]))
    }

    /// The one of a rank, from 0 for the nearest; `None` where the points are fewer, or so many were not
    /// asked for.
    ///
    /// # Panics
    /// When `lane` is not below 16.
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

/// The points of a block, and how near those found so far are.
struct Search<S: Simd> {
    about: Bounds,
    points: [f32x16<S>; 3],
    present: mask32x16<S>,
    /// Squared distances of the last of the lists, less than any where there is no point.
    last: f32x16<S>,
    /// The greatest of those.
    limit: f32,
}

impl BlockTree<'_> {
    /// Finds for each point of a block its `count` nearest others, ties by lower id.
    ///
    /// Six of each take 80 to 190 ns a point on scans with AVX-512, by a kd-tree five to ten times that
    /// (`benches/src/bin/graph.rs`). A rank more costs four instructions for each point that improves a list;
    /// the less the order is one of places, the more are looked at.
    ///
    /// # Panics
    /// When there is no such block.
    #[inline]
    pub fn nearest(&self, level: Level, block: usize, count: usize, found: &mut Nearest) {
        found.keys.clear();
        found.keys.resize(count, [[NONE; HALF]; 2]);
        found.open.clear();
        if count > 0 {
            dispatch!(level, simd => simd.vectorize(
                #[inline(always)]
                || self.nearest_by(simd, block, found)
            ));
        }
    }

    #[inline(always)]
    fn nearest_by<S: Simd>(&self, simd: S, block: usize, found: &mut Nearest) {
        let Nearest { keys, open } = found;
        #[expect(clippy::cast_precision_loss, reason = "at most 16")]
        let present = f32x16::load_array_ref(simd, &ORDINALS).simd_lt(self.count(block) as f32);
        let (never, any) = (f32x16::simd_from(simd, -1.0), f32x16::simd_from(simd, f32::INFINITY));
        let mut search = Search {
            about: self.bounds(0, block),
            points: load(simd, &self.blocks[block].position),
            present,
            last: simd.select_f32x16(present, any, never),
            limit: f32::INFINITY,
        };
        self.offer(simd, block, true, &mut search, keys);
        // From the block up, what lies beside it first: so the limit is low before anything far is looked
        // into.
        let mut below = block;
        for level in 0..self.levels.len() {
            let group = below / WIDTH;
            let siblings = !(1 << (below % WIDTH));
            self.open(simd, (level, group), siblings, &search, open);
            while let Some(Open { distance_sq, level, id }) = open.pop() {
                let (level, id) = (level as usize, id as usize);
                if distance_sq > search.limit {
                    continue;
                }
                let bounds = self.bounds(level, id);
                if bits(bounds.distances_sq(simd, &search.points).simd_le(search.last)) == 0 {
                    continue;
                }
                if level == 0 {
                    self.offer(simd, id, false, &mut search, keys);
                } else {
                    self.open(simd, (level - 1, id), u32::MAX, &search, open);
                }
            }
            below = group;
        }
    }

    /// Puts those of `lanes` of a group on the stack that are not beyond the limit, the nearest last.
    #[inline(always)]
    fn open<S: Simd>(
        &self,
        simd: S,
        (level, group): (usize, usize),
        lanes: u32,
        search: &Search<S>,
        open: &mut Vec<Open>,
    ) {
        let distances = self.levels[level][group].distances_sq(simd, &search.about);
        let count = (self.nodes(level) - group * WIDTH).min(WIDTH);
        let near = bits(distances.simd_le(search.limit)) & lanes & ((1 << count) - 1);
        let distances = distances.to_array();
        let first = open.len();
        for lane in Bits(near) {
            let node =
                Open { distance_sq: distances[lane], level: id32(level), id: id32(group * WIDTH + lane) };
            // By insertion: they are few.
            let mut place = open.len();
            open.push(node);
            while place > first && open[place - 1].distance_sq < node.distance_sq {
                open[place] = open[place - 1];
                place -= 1;
            }
            open[place] = node;
        }
    }

    /// Offers the points of block `id`, which is the points' `own` or another, to the lists.
    #[inline(always)]
    fn offer<S: Simd>(
        &self,
        simd: S,
        id: usize,
        own: bool,
        search: &mut Search<S>,
        keys: &mut [[[f64; HALF]; 2]],
    ) {
        let PointBlock { position: [x, y, z], .. } = &self.blocks[id];
        let [px, py, pz] = search.points;
        let mut improved = false;
        for lane in 0..self.count(id) {
            let d_sq = squared([px - x[lane], py - y[lane], pz - z[lane]]);
            if !d_sq.simd_le(search.last).any_true() {
                continue;
            }
            improved = true;
            let d_sq: u32x16<S> = d_sq.bitcast();
            let mut ids = u32x16::simd_from(simd, id32(id * WIDTH + lane));
            let mut distances = d_sq;
            if own {
                // Nobody is its own neighbour.
                let this: mask32x16<S> = f32x16::load_array_ref(simd, &ORDINALS).simd_eq(ORDINALS[lane]);
                ids = simd.select_u32x16(this, u32x16::simd_from(simd, u32::MAX), ids);
                distances = simd.select_u32x16(this, u32x16::simd_from(simd, 0x7f80_0000), d_sq);
            }
            let mut low: f64x8<S> = ids.zip_low(distances).bitcast();
            let mut high: f64x8<S> = ids.zip_high(distances).bitcast();
            let mut greatest = (low, high);
            for [a, b] in &mut *keys {
                let (here, there) = (f64x8::load_array_ref(simd, a), f64x8::load_array_ref(simd, b));
                greatest = (here.min(low), there.min(high));
                (low, high) = (here.max(low), there.max(high));
                (*a, *b) = (greatest.0.to_array(), greatest.1.to_array());
            }
            let (low, high): (u32x16<S>, u32x16<S>) = (greatest.0.bitcast(), greatest.1.bitcast());
            let last: f32x16<S> = low.unzip_high(high).bitcast();
            search.last = simd.select_f32x16(search.present, last, search.last);
        }
        if improved {
            search.limit = search.last.to_array().into_iter().fold(0.0, f32::max);
        }
    }
}
