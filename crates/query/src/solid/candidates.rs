//! The discs and balls that a shape may touch, among which its contacts are selected.
//!
//! Sixteen consecutive points of a leaf are compared at a time. Of equal candidates the first point counts,
//! so a selection does not depend on the order in which leaves were visited.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16};
use nearmiss_hierarchy::LeafBlock;
use nearmiss_lanes::id32;
use nearmiss_lanes::wide::{Bits, bits, seen_from, squared};

const WIDTH: usize = LeafBlock::WIDTH;

/// The candidates among sixteen consecutive points.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CandidateBlock {
    /// The centres of the discs and balls, in the stored frame.
    pub(crate) centres: [[f32; WIDTH]; 3],
    /// Upper bounds on the depths, in the stored frame.
    pub(crate) most: [f32; WIDTH],
    /// The squared distances from the nearest contact that was selected.
    pub(crate) away_sq: [f32; WIDTH],
    /// A candidate gives another contact from this squared distance on.
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
}

/// The lanes of the candidates of a block, as bits.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CandidateLanes {
    pub(crate) found: u32,
    pub(crate) missed: u32,
    pub(crate) turned: u32,
    pub(crate) behind: u32,
}

/// A candidate: its block and its lane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Candidate(u32);

/// Blocks of candidates; reusable memory.
#[derive(Debug, Clone, Default)]
pub(crate) struct CandidateBlocks(Vec<CandidateBlock>);

/// The candidate with the greatest number so far.
struct Greatest {
    number: f32,
    i: u32,
    candidate: Option<Candidate>,
}

impl CandidateBlock {
    /// Candidates from the point `first` on. `measured` are their centres, the bounds of their depths and
    /// the distances from which on they give another contact.
    #[inline(always)]
    pub(crate) fn new<S: Simd>(
        first: usize,
        lanes: CandidateLanes,
        centres: [[f32; WIDTH]; 3],
        [most, apart]: [f32x16<S>; 2],
    ) -> Self {
        let CandidateLanes { found, missed, turned, behind } = lanes;
        Self {
            centres,
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
        }
    }

    /// The candidates before the surface, or those behind it.
    fn on_side(&self, is_front: bool) -> u32 {
        self.lanes & if is_front { !self.behind } else { self.behind }
    }
}

impl CandidateBlocks {
    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }

    pub(crate) fn push(&mut self, block: CandidateBlock) {
        self.0.push(block);
    }

    fn at(&self, Candidate(n): Candidate) -> (&CandidateBlock, usize) {
        (&self.0[n as usize / WIDTH], n as usize % WIDTH)
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

    /// The number of the candidate's place, if that is known.
    pub(crate) fn place(&self, candidate: Candidate) -> Option<usize> {
        let (block, lane) = self.at(candidate);
        (block.placed >> lane & 1 == 1).then(|| block.places[lane] as usize)
    }

    pub(crate) fn set_place(&mut self, Candidate(n): Candidate, number: usize) {
        let (block, lane) = (&mut self.0[n as usize / WIDTH], n as usize % WIDTH);
        block.placed |= 1 << lane;
        block.places[lane] = id32(number);
    }

    /// Removes a candidate that no part of the shape within the margin is over.
    pub(crate) fn miss(&mut self, candidate: Candidate) {
        self.remove(candidate);
        let Candidate(n) = candidate;
        self.0[n as usize / WIDTH].missed |= 1 << (n as usize % WIDTH);
    }

    pub(crate) fn remove(&mut self, Candidate(n): Candidate) {
        self.0[n as usize / WIDTH].lanes &= !(1 << (n as usize % WIDTH));
    }

    pub(crate) fn remove_behind(&mut self) {
        for block in &mut self.0 {
            block.lanes &= !block.behind;
        }
    }

    /// The points that the shape may be beside.
    pub(crate) fn missed(&self) -> impl Iterator<Item = Candidate> {
        self.lanes(|block| block.missed)
    }

    /// All candidates, each with a key that orders them by the distance from the nearest contact.
    pub(crate) fn by_distance(&self) -> impl Iterator<Item = (u64, Candidate)> {
        self.lanes(|block| block.lanes).map(|candidate| {
            let (block, lane) = self.at(candidate);
            (self.key(candidate, block.away_sq[lane]), candidate)
        })
    }

    /// The candidates that may be as deep as `depth` before the surface, or behind it, each with a key
    /// that orders them by the bound.
    pub(crate) fn deeper(&self, is_front: bool, depth: f32) -> impl Iterator<Item = (u64, Candidate)> {
        let all = self.lanes(move |block| block.on_side(is_front));
        all.map(|candidate| {
            let (block, lane) = self.at(candidate);
            (block.most[lane], candidate)
        })
        .filter(move |(most, _)| *most >= depth)
        .map(|(most, candidate)| (self.key(candidate, most), candidate))
    }

    fn lanes(&self, of: impl Fn(&CandidateBlock) -> u32) -> impl Iterator<Item = Candidate> {
        let all = self.0.iter().enumerate();
        all.flat_map(move |(n, block)| Bits(of(block)).map(move |lane| Candidate(id32(n * WIDTH + lane))))
    }

    /// A key that orders candidates by a number, and equal ones by their points, the first one last.
    fn key(&self, candidate: Candidate, number: f32) -> u64 {
        // The bits of floats in their order.
        let bits = number.to_bits();
        let ordered = if bits >> 31 == 0 { bits | 1 << 31 } else { !bits };
        u64::from(ordered) << 32 | u64::from(!id32(self.point(candidate)))
    }

    /// The candidate that may be deepest, of those before the surface or of those behind it. O(n), as the
    /// next ones.
    pub(crate) fn deepest(&self, level: Level, is_front: bool) -> Option<Candidate> {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.deepest_by(simd, is_front),
        ))
    }

    #[inline(always)]
    fn deepest_by<S: Simd>(&self, simd: S, is_front: bool) -> Option<Candidate> {
        let mut best = Greatest::NONE;
        for (n, block) in self.0.iter().enumerate() {
            let most = f32x16::load_array_ref(simd, &block.most);
            best.offer(simd, most, block.on_side(is_front), (n, block.first));
        }
        best.candidate
    }

    /// Measures the distances from a contact of the point `own`, and removes the candidates that are not
    /// apart from it. Returns the one that is furthest from all contacts.
    pub(crate) fn separate(&mut self, level: Level, at: [f32; 3], own: usize) -> Option<Candidate> {
        let own = id32(own);
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.separate_by(simd, at, own),
        ))
    }

    #[inline(always)]
    fn separate_by<S: Simd>(&mut self, simd: S, at: [f32; 3], own: u32) -> Option<Candidate> {
        let mut best = Greatest::NONE;
        for (n, block) in self.0.iter_mut().enumerate() {
            let away_sq = squared(seen_from(simd, &block.centres, at));
            let away_sq = away_sq.min(f32x16::load_array_ref(simd, &block.away_sq));
            block.away_sq = away_sq.to_array();
            let is_apart: mask32x16<S> = away_sq.simd_ge(f32x16::load_array_ref(simd, &block.apart_sq));
            let is_own = 1_u32.checked_shl(own.wrapping_sub(block.first)).unwrap_or(0);
            block.lanes &= bits(is_apart) & !is_own;
            best.offer(simd, away_sq, block.lanes, (n, block.first));
        }
        best.candidate
    }

    /// The candidate whose centre is nearest to `at`, except some points.
    pub(crate) fn nearest(&self, level: Level, at: [f32; 3], except: &[u32]) -> Option<(f32, Candidate)> {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.nearest_by(simd, at, except),
        ))
    }

    #[inline(always)]
    fn nearest_by<S: Simd>(&self, simd: S, at: [f32; 3], except: &[u32]) -> Option<(f32, Candidate)> {
        let mut best = Greatest::NONE;
        for (n, block) in self.0.iter().enumerate() {
            let away_sq = squared(seen_from(simd, &block.centres, at));
            let excepted = |&i: &u32| 1_u32.checked_shl(i.wrapping_sub(block.first)).unwrap_or(0);
            let lanes = block.lanes & !except.iter().map(excepted).fold(0, |all, own| all | own);
            best.offer(simd, -away_sq, lanes, (n, block.first));
        }
        Some((-best.number, best.candidate?))
    }

    /// The candidate of a point, if it is one.
    pub(crate) fn of_point(&self, i: usize) -> Option<Candidate> {
        let holds = |block: &CandidateBlock| {
            let lane = i.wrapping_sub(block.first as usize);
            (lane < WIDTH && block.lanes >> lane & 1 == 1).then_some(lane)
        };
        let found = self.0.iter().enumerate().find_map(|(n, block)| Some((n, holds(block)?)));
        found.map(|(n, lane)| Candidate(id32(n * WIDTH + lane)))
    }
}

impl Greatest {
    const NONE: Self = Self { number: f32::NEG_INFINITY, i: u32::MAX, candidate: None };

    /// Compares the candidates in `lanes` of block `n`, whose first point is given.
    #[inline(always)]
    fn offer<S: Simd>(&mut self, simd: S, numbers: f32x16<S>, lanes: u32, (n, first): (usize, u32)) {
        let is_there = mask32x16::from_bitmask(simd, u64::from(lanes));
        let numbers = is_there.select(numbers, f32x16::splat(simd, f32::NEG_INFINITY));
        let greatest = numbers.reduce_max();
        if greatest < self.number {
            return;
        }
        let is_greatest: mask32x16<S> = numbers.simd_eq(greatest);
        let Some(lane) = Bits(bits(is_greatest) & lanes).next() else { return };
        let i = first + id32(lane);
        if greatest > self.number || i < self.i {
            *self = Self { number: greatest, i, candidate: Some(Candidate(id32(n * WIDTH + lane))) };
        }
    }
}
