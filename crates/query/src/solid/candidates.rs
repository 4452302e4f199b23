//! The discs and balls that a shape may touch, among which its contacts are selected.
//!
//! Sixteen consecutive points of a leaf are compared at a time. Of equal candidates the first point counts,
//! so a selection does not depend on the order in which leaves were visited.

mod choice;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16};
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::LeafBlock;
use nearmiss_lanes::id32;
use nearmiss_lanes::wide::{Bits, Vectors, along, bits, seen_from, squared};

const WIDTH: usize = LeafBlock::WIDTH;

/// The candidates among sixteen consecutive points. Each row of numbers is in one line of the cache.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(crate) struct CandidateBlock {
    /// The centres of the discs and balls, in the stored frame.
    pub(crate) centres: [[f32; WIDTH]; 3],
    /// The normals of discs, in the direction in which the shape moves out.
    out: [[f32; WIDTH]; 3],
    /// Upper bounds on the depths, in the stored frame.
    pub(crate) most: [f32; WIDTH],
    /// The squared distances from the nearest contact, or candidate that was chosen; negative infinity in
    /// lanes without a candidate.
    pub(crate) away_sq: [f32; WIDTH],
    /// A candidate gives another contact beyond this squared distance.
    pub(crate) apart_sq: [f32; WIDTH],
    /// The numbers of the places that are known.
    places: [u32; WIDTH],
    /// The index of the first point.
    first: u32,
    /// The lanes of candidates, as the next.
    lanes: u32,
    /// The lanes of points that no part of the shape within the margin is over. It may be beside them.
    missed: u32,
    /// The lanes whose normal is opposite to the direction in which the shape moves out.
    turned: u32,
    /// The lanes behind whose disc the shape is.
    behind: u32,
    /// The lanes whose place is known.
    placed: u32,
    /// The lanes whose place is known although they are still ranked by their depth.
    settled: u32,
    /// The lanes of points at borders of sheets that have not been looked at.
    borders: u32,
    /// The lanes of the points near a plane.
    slab: u32,
    /// The lanes of discs.
    discs: u32,
}

/// The lanes of the candidates of a block, as bits.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CandidateLanes {
    pub(crate) found: u32,
    pub(crate) missed: u32,
    pub(crate) turned: u32,
    pub(crate) behind: u32,
    pub(crate) borders: u32,
    pub(crate) discs: u32,
}

/// The candidates among which the deepest one is looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Among {
    /// Candidates that the shape is not behind.
    Front,
    /// Candidates that the shape is behind.
    Behind,
}

/// The points near a plane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slab {
    /// A place of the plane.
    pub(crate) at: [f32; 3],
    pub(crate) normal: [f32; 3],
    /// The greatest distance from the plane.
    pub(crate) within: f32,
    /// The place from whose foot distances are measured.
    pub(crate) inside: [f32; 3],
}

/// A candidate: its block and its lane.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Candidate(u32);

/// Blocks of candidates; reusable memory.
#[derive(Debug, Clone, Default)]
pub(crate) struct CandidateBlocks {
    blocks: Vec<CandidateBlock>,
    /// The numbers of the blocks, in the order of their points.
    order: Vec<u32>,
}

impl CandidateBlock {
    /// Candidates from the point `first` on, with their centres and normals, the bounds of their depths and
    /// the distances beyond which they give another contact.
    #[inline(always)]
    pub(crate) fn new<S: Simd>(
        first: usize,
        lanes: CandidateLanes,
        (centres, [x, y, z]): ([[f32; WIDTH]; 3], Vectors<S>),
        [most, apart]: [f32x16<S>; 2],
    ) -> Self {
        let CandidateLanes { found, missed, turned, behind, borders, discs } = lanes;
        Self {
            centres,
            out: [x.to_array(), y.to_array(), z.to_array()],
            most: most.to_array(),
            away_sq: [f32::INFINITY; WIDTH],
            apart_sq: (apart * apart).to_array(),
            places: [0; WIDTH],
            first: id32(first),
            lanes: found,
            missed,
            turned,
            behind,
            placed: 0,
            settled: 0,
            borders,
            slab: 0,
            discs,
        }
    }

    /// The candidates among some whose place is not known, as bits.
    #[inline(always)]
    fn by_depth(&self, among: Among) -> u32 {
        let lanes = match among {
            Among::Front => !self.behind,
            Among::Behind => self.behind,
        };
        self.lanes & !self.placed & lanes
    }
}

impl CandidateBlocks {
    pub(crate) fn clear(&mut self) {
        self.blocks.clear();
        self.order.clear();
    }

    pub(crate) fn push(&mut self, block: CandidateBlock) {
        self.blocks.push(block);
    }

    /// Orders the blocks, once all are added.
    pub(crate) fn arrange(&mut self) {
        let Self { blocks, order } = self;
        order.extend(0..id32(blocks.len()));
        order.sort_unstable_by_key(|&number| blocks[number as usize].first);
    }

    fn at(&self, Candidate(n): Candidate) -> (&CandidateBlock, usize) {
        (&self.blocks[n as usize / WIDTH], n as usize % WIDTH)
    }

    /// The index of the point of a candidate.
    pub(crate) fn point(&self, candidate: Candidate) -> usize {
        let (block, lane) = self.at(candidate);
        block.first as usize + lane
    }

    /// The sign of the normal of the disc in the direction in which the shape moves out.
    pub(crate) fn sign(&self, candidate: Candidate) -> f64 {
        let (block, lane) = self.at(candidate);
        if block.turned >> lane & 1 == 1 { -1.0 } else { 1.0 }
    }

    /// The upper bound on the depth, in the stored frame.
    pub(crate) fn most(&self, candidate: Candidate) -> f64 {
        let (block, lane) = self.at(candidate);
        f64::from(block.most[lane])
    }

    /// Lowers the upper bound on the depth.
    pub(crate) fn set_most(&mut self, Candidate(n): Candidate, most: f64) {
        #[expect(clippy::cast_possible_truncation, reason = "rounded up")]
        let most = (most as f32).next_up();
        self.blocks[n as usize / WIDTH].most[n as usize % WIDTH] = most;
    }

    /// The number of the candidate's place, if that is known. The depth no longer ranks it then.
    pub(crate) fn place(&mut self, Candidate(n): Candidate) -> Option<usize> {
        let (block, lane) = (&mut self.blocks[n as usize / WIDTH], n as usize % WIDTH);
        block.placed |= block.settled & 1 << lane;
        (block.placed >> lane & 1 == 1).then(|| block.places[lane] as usize)
    }

    /// Sets the number of the place of a candidate before or behind the surface, or of a point that the
    /// shape is beside. Its depth ranks it.
    pub(crate) fn settle(&mut self, candidate: Candidate, number: usize, (depth, normal): (f64, [f32; 3])) {
        let Candidate(n) = candidate;
        let (block, lane) = (&mut self.blocks[n as usize / WIDTH], n as usize % WIDTH);
        block.settled |= 1 << lane;
        block.places[lane] = id32(number);
        block.lanes |= 1 << lane;
        block.missed &= !(1 << lane);
        block.behind &= !(1 << lane);
        for k in 0..3 {
            block.out[k][lane] = normal[k];
        }
        self.set_most(candidate, depth);
    }

    /// Returns `true` if the place is known although the candidate is still ranked by its depth.
    pub(crate) fn is_settled(&self, candidate: Candidate) -> bool {
        let (block, lane) = self.at(candidate);
        block.settled >> lane & 1 == 1
    }

    pub(crate) fn set_place(&mut self, Candidate(n): Candidate, number: usize) {
        let (block, lane) = (&mut self.blocks[n as usize / WIDTH], n as usize % WIDTH);
        block.placed |= 1 << lane;
        block.places[lane] = id32(number);
    }

    /// Removes a candidate that no part of the shape within the margin is over.
    pub(crate) fn miss(&mut self, candidate: Candidate) {
        self.remove(candidate);
        let Candidate(n) = candidate;
        self.blocks[n as usize / WIDTH].missed |= 1 << (n as usize % WIDTH);
    }

    pub(crate) fn remove(&mut self, Candidate(n): Candidate) {
        self.blocks[n as usize / WIDTH].lanes &= !(1 << (n as usize % WIDTH));
    }

    pub(crate) fn remove_behind(&mut self) {
        for block in &mut self.blocks {
            block.lanes &= !block.behind;
        }
    }

    /// The points that the shape may be beside.
    pub(crate) fn missed(&self) -> impl Iterator<Item = Candidate> {
        self.lanes(|block| block.missed)
    }

    /// All candidates whose place is not known, each with a key that orders them by their depth, the first
    /// one last.
    pub(crate) fn ordered(&self, among: Among) -> impl Iterator<Item = (u64, Candidate)> {
        self.lanes(move |block| block.by_depth(among)).map(move |candidate| {
            let (block, lane) = self.at(candidate);
            // The bits of floats in their order.
            let bits = block.most[lane].to_bits();
            let ordered = if bits >> 31 == 0 { bits | 1 << 31 } else { !bits };
            (u64::from(ordered) << 32 | u64::from(!id32(self.point(candidate))), candidate)
        })
    }

    fn lanes(&self, of: impl Fn(&CandidateBlock) -> u32) -> impl Iterator<Item = Candidate> {
        let all = self.blocks.iter().enumerate();
        all.flat_map(move |(n, block)| Bits(of(block)).map(move |lane| Candidate(id32(n * WIDTH + lane))))
    }

    /// The centre of a candidate.
    pub(crate) fn centre(&self, candidate: Candidate) -> [f32; 3] {
        let (block, lane) = self.at(candidate);
        [0, 1, 2].map(|k| block.centres[k][lane])
    }

    /// The first point at a border of a sheet for which [`Self::look_at`] was not called.
    pub(crate) fn first_border(&self) -> Option<Candidate> {
        self.lanes(|block| block.borders).min_by_key(|&candidate| self.point(candidate))
    }

    /// Returns `true` if the shape is behind the disc.
    pub(crate) fn is_behind(&self, candidate: Candidate) -> bool {
        let (block, lane) = self.at(candidate);
        block.behind >> lane & 1 == 1
    }

    /// The candidates that the shape is not behind.
    pub(crate) fn in_front(&self) -> impl Iterator<Item = Candidate> {
        self.lanes(|block| block.lanes & !block.behind)
    }

    /// Leaves a point out of [`Self::first_border`].
    pub(crate) fn look_at(&mut self, Candidate(n): Candidate) {
        self.blocks[n as usize / WIDTH].borders &= !(1 << (n as usize % WIDTH));
    }

    /// Marks the points near a plane. Returns the greatest bound of their depths, and the least square of
    /// their distances along the plane. O(n).
    pub(crate) fn mark_slab(&mut self, level: Level, slab: &Slab) -> [f32; 2] {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.mark_slab_by(simd, slab),
        ))
    }

    #[inline(always)]
    fn mark_slab_by<S: Simd>(&mut self, simd: S, slab: &Slab) -> [f32; 2] {
        let none = f32x16::splat(simd, f32::NEG_INFINITY);
        let (mut most, mut nearness) = (none, none);
        for block in &mut self.blocks {
            let height = along(seen_from(simd, &block.centres, slab.at), slab.normal);
            let is_level: mask32x16<S> = height.abs().simd_le(slab.within);
            block.slab = bits(is_level) & (block.lanes | block.missed);
            let away = seen_from(simd, &block.centres, slab.inside);
            let up = along(away, slab.normal);
            nearness = nearness.max(in_lanes(simd, up * up - squared(away), block.slab));
            let depths = f32x16::load_array_ref(simd, &block.most);
            most = most.max(in_lanes(simd, depths, block.slab & block.lanes));
        }
        [most.reduce_max(), -nearness.reduce_max()]
    }

    /// The points near the plane of the last [`Self::mark_slab`].
    pub(crate) fn in_slab(&self) -> impl Iterator<Item = Candidate> {
        self.lanes(|block| block.slab)
    }

    /// The candidate whose centre is nearest to `at`, except some points. O(n).
    pub(crate) fn nearest(&self, level: Level, at: [f32; 3], except: &[u32]) -> Option<(f32, Candidate)> {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.nearest_by(simd, at, except),
        ))
    }

    #[inline(always)]
    fn nearest_by<S: Simd>(&self, simd: S, at: [f32; 3], except: &[u32]) -> Option<(f32, Candidate)> {
        let (mut best, mut nearest) = ((f32::INFINITY, u32::MAX), None);
        for (n, block) in self.blocks.iter().enumerate() {
            let excepted = |&i: &u32| 1_u32.checked_shl(i.wrapping_sub(block.first)).unwrap_or(0);
            let lanes = block.lanes & !except.iter().map(excepted).fold(0, |all, own| all | own);
            let away_sq = squared(seen_from(simd, &block.centres, at));
            let least = -in_lanes(simd, -away_sq, lanes).reduce_max();
            let is_least: mask32x16<S> = away_sq.simd_eq(least);
            let Some(lane) = Bits(bits(is_least) & lanes).next() else { continue };
            let own = (least, block.first + id32(lane));
            if own < best {
                (best, nearest) = (own, Some(Candidate(id32(n * WIDTH + lane))));
            }
        }
        Some((best.0, nearest?))
    }

    /// The candidate of a point, if it is one.
    pub(crate) fn of_point(&self, i: usize) -> Option<Candidate> {
        let holds = |block: &CandidateBlock| {
            let lane = i.wrapping_sub(block.first as usize);
            (lane < WIDTH && block.lanes >> lane & 1 == 1).then_some(lane)
        };
        let found = self.blocks.iter().enumerate().find_map(|(n, block)| Some((n, holds(block)?)));
        found.map(|(n, lane)| Candidate(id32(n * WIDTH + lane)))
    }
}

/// A vector in the precision of candidates.
#[expect(clippy::cast_possible_truncation, reason = "as precise as the positions")]
pub(crate) fn single(v: &Vector3<f64>) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

/// The numbers in `lanes`, and negative infinity in the others.
#[inline(always)]
fn in_lanes<S: Simd>(simd: S, numbers: f32x16<S>, lanes: u32) -> f32x16<S> {
    let is_there = mask32x16::from_bitmask(simd, u64::from(lanes));
    is_there.select(numbers, f32x16::splat(simd, f32::NEG_INFINITY))
}
