//! The discs and balls that a shape may touch, among which its contacts are selected.
//!
//! Sixteen consecutive points of a leaf are compared at a time. Of equal candidates the first point counts,
//! so a selection does not depend on the order in which leaves were visited.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16, u32x16};
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::LeafBlock;
use nearmiss_lanes::id32;
use nearmiss_lanes::wide::{Bits, Vectors, along, bits, load, seen_from, squared};

const WIDTH: usize = LeafBlock::WIDTH;

/// The cosine below which two normals are those of different walls.
const UNLIKE: f32 = 0.7;

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
    /// Those that the shape is not behind.
    Front,
    /// Those that the shape is behind.
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

    fn remove(&mut self, Candidate(n): Candidate) {
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

    /// The candidate with the greatest bound of its depth, among some whose place is not known. O(n), as the
    /// next ones.
    pub(crate) fn first(&self, level: Level, among: Among) -> Option<Candidate> {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.first_by(simd, among),
        ))
    }

    #[inline(always)]
    fn first_by<S: Simd>(&self, simd: S, among: Among) -> Option<Candidate> {
        let mut deepest = Greatest::none(simd);
        for &number in &self.order {
            let block = &self.blocks[number as usize];
            let most = f32x16::load_array_ref(simd, &block.most);
            deepest.offer(simd, in_lanes(simd, most, block.by_depth(among)), number);
        }
        deepest.candidate(&self.blocks)
    }

    /// Adds the disc with the greatest bound of its depth to `chosen`, of those whose normals make more than
    /// about 45° with all of `normals`, then the same with the normal of that one, up to `wanted`. Those that
    /// are added are no longer candidates. O(n) each.
    pub(crate) fn choose_walls(
        &mut self,
        level: Level,
        normals: &mut Vec<[f32; 3]>,
        (wanted, chosen): (usize, &mut Vec<Candidate>),
    ) {
        if wanted == 0 {
            return;
        }
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.choose_walls_by(simd, normals, (wanted, chosen)),
        ));
    }

    #[inline(always)]
    fn choose_walls_by<S: Simd>(
        &mut self,
        simd: S,
        normals: &mut Vec<[f32; 3]>,
        (wanted, chosen): (usize, &mut Vec<Candidate>),
    ) {
        let none = f32x16::splat(simd, f32::NEG_INFINITY);
        for _ in 0..wanted {
            let mut deepest = Greatest::none(simd);
            for &number in &self.order {
                let block = &self.blocks[number as usize];
                let (out, mut cosine) = (load(simd, &block.out), none);
                for &normal in &*normals {
                    cosine = cosine.max(along(out, normal));
                }
                let is_unlike: mask32x16<S> = cosine.simd_lt(UNLIKE);
                let most = f32x16::load_array_ref(simd, &block.most);
                let most = in_lanes(simd, most, block.lanes & block.discs);
                deepest.offer(simd, is_unlike.select(most, none), number);
            }
            let Some(first) = deepest.candidate(&self.blocks) else { return };
            self.remove(first);
            let (block, lane) = self.at(first);
            normals.push([0, 1, 2].map(|k| block.out[k][lane]));
            chosen.push(first);
        }
    }

    /// Adds up to `wanted` candidates to `chosen`. Each is the furthest from the contacts and from those
    /// added before, and apart from all of these. Candidates that are added are no longer candidates. O(n)
    /// each.
    pub(crate) fn choose(
        &mut self,
        level: Level,
        contacts: &[[f32; 3]],
        (wanted, chosen): (usize, &mut Vec<Candidate>),
    ) {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.choose_by(simd, contacts, (wanted, chosen)),
        ));
    }

    #[inline(always)]
    fn choose_by<S: Simd>(
        &mut self,
        simd: S,
        contacts: &[[f32; 3]],
        (wanted, chosen): (usize, &mut Vec<Candidate>),
    ) {
        let none = f32x16::splat(simd, f32::NEG_INFINITY);
        let mut last = None;
        for _ in 0..wanted {
            let mut furthest = Greatest::none(simd);
            for &number in &self.order {
                let block = &mut self.blocks[number as usize];
                let away_sq = if let Some(at) = last {
                    let away_sq = squared(seen_from(simd, &block.centres, at));
                    away_sq.min(f32x16::load_array_ref(simd, &block.away_sq))
                } else {
                    let mut away_sq = f32x16::splat(simd, f32::INFINITY);
                    for &at in contacts {
                        away_sq = away_sq.min(squared(seen_from(simd, &block.centres, at)));
                    }
                    in_lanes(simd, away_sq, block.lanes)
                };
                block.away_sq = away_sq.to_array();
                let is_apart: mask32x16<S> = away_sq.simd_gt(f32x16::load_array_ref(simd, &block.apart_sq));
                furthest.offer(simd, is_apart.select(away_sq, none), number);
            }
            let Some(first) = furthest.candidate(&self.blocks) else { return };
            // Its distance is 0 from now on, so it is not chosen again.
            self.remove(first);
            last = Some(self.centre(first));
            chosen.push(first);
        }
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

/// The greatest number of each lane, and its block.
struct Greatest<S: Simd> {
    numbers: f32x16<S>,
    blocks: u32x16<S>,
}

impl<S: Simd> Greatest<S> {
    #[inline(always)]
    fn none(simd: S) -> Self {
        Self { numbers: f32x16::splat(simd, f32::NEG_INFINITY), blocks: u32x16::splat(simd, 0) }
    }

    /// Compares the numbers of a block. Of equal ones those of the first block count.
    #[inline(always)]
    fn offer(&mut self, simd: S, numbers: f32x16<S>, block: u32) {
        let is_greater: mask32x16<S> = numbers.simd_gt(self.numbers);
        self.numbers = is_greater.select(numbers, self.numbers);
        self.blocks = is_greater.select(u32x16::splat(simd, block), self.blocks);
    }

    /// The candidate with the greatest number, and of equal ones the first point. `None` if the number is
    /// negative infinity.
    #[inline(always)]
    fn candidate(&self, blocks: &[CandidateBlock]) -> Option<Candidate> {
        let greatest = self.numbers.reduce_max();
        if greatest == f32::NEG_INFINITY {
            return None;
        }
        let is_greatest: mask32x16<S> = self.numbers.simd_eq(greatest);
        let numbers = self.blocks.to_array();
        let first = |&lane: &usize| blocks[numbers[lane] as usize].first + id32(lane);
        let lane = Bits(bits(is_greatest)).min_by_key(first)?;
        Some(Candidate(numbers[lane] * id32(WIDTH) + id32(lane)))
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

#[cfg(test)]
mod tests {
    use std::collections::BinaryHeap;

    use nearmiss_testdata::arbitrary::rng;
    use nearmiss_testdata::instructions::levels;
    use rand::RngExt;

    use super::*;

    /// Candidates come in the order of the bounds of their depths, and equal ones in that of their points,
    /// whether they are looked for one by one or ordered at once, in any order of the blocks.
    #[test]
    fn candidates_come_in_one_order() {
        let rng = &mut rng(7359);
        for round in 0..200 {
            let mut firsts: Vec<usize> = (0..rng.random_range(1..9)).map(|n| n * WIDTH).collect();
            let by = rng.random_range(0..firsts.len());
            firsts.rotate_left(by);
            let mut found = CandidateBlocks::default();
            for &first in &firsts {
                let lanes = CandidateLanes {
                    found: rng.random_range(0..1 << WIDTH),
                    missed: 0,
                    turned: 0,
                    borders: 0,
                    discs: 0,
                    behind: rng.random_range(0..1 << WIDTH),
                };
                // Many are equal.
                let numbers = [(); WIDTH].map(|()| [0.5, -1.0, 2.0, f32::INFINITY][rng.random_range(0..4)]);
                let block = dispatch!(Level::new(), simd => {
                    let depths = f32x16::load_array(simd, numbers);
                    CandidateBlock::new(first, lanes, ([[0.0; WIDTH]; 3], [depths; 3]), [depths, depths])
                });
                found.push(block);
            }
            found.arrange();
            for among in [Among::Front, Among::Behind] {
                let all = found.lanes(|block| block.by_depth(among));
                let mut expected: Vec<(f32, usize)> = all
                    .map(|candidate| {
                        let (block, lane) = found.at(candidate);
                        (block.most[lane], found.point(candidate))
                    })
                    .collect();
                expected.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
                let expected: Vec<usize> = expected.into_iter().map(|(_, i)| i).collect();
                let heap: BinaryHeap<(u64, Candidate)> = found.ordered(among).collect();
                let ordered: Vec<usize> = heap
                    .into_sorted_vec()
                    .iter()
                    .rev()
                    .map(|&(_, candidate)| found.point(candidate))
                    .collect();
                assert_eq!(ordered, expected, "round {round}, {among:?}");
                for level in levels() {
                    let mut left = found.clone();
                    let one_by_one: Vec<usize> = std::iter::from_fn(|| {
                        let candidate = left.first(level, among)?;
                        left.remove(candidate);
                        Some(left.point(candidate))
                    })
                    .collect();
                    assert_eq!(one_by_one, expected, "round {round}, {among:?}, {level:?}");
                }
            }
        }
    }

    /// Each candidate that is chosen is the furthest from contacts and those before, and the first point of
    /// equal ones, in any order of the blocks.
    #[test]
    fn the_furthest_candidates_are_chosen() {
        let rng = &mut rng(7367);
        let mut counts = [0; 10];
        for round in 0..300 {
            let mut firsts: Vec<usize> = (0..rng.random_range(1..6)).map(|n| n * WIDTH).collect();
            let by = rng.random_range(0..firsts.len());
            firsts.rotate_left(by);
            // Places of a grid, many of which are equally far apart.
            let steps: u8 = [4, 10][round % 2];
            let mut place = || [(); 3].map(|()| f32::from(rng.random_range(0..steps)));
            let contacts = [place(), place(), place()];
            let contacts = &contacts[..round % 4];
            let (mut found, mut all) = (CandidateBlocks::default(), Vec::new());
            for &first in &firsts {
                let places = [(); WIDTH].map(|()| place());
                let lanes =
                    CandidateLanes { found: 0xb7ff, missed: 0, turned: 0, borders: 0, behind: 0, discs: 0 };
                all.extend(Bits(lanes.found).map(|lane| (first + lane, places[lane])));
                let centres = [0, 1, 2].map(|k| places.map(|place| place[k]));
                found.push(dispatch!(Level::new(), simd => {
                    let apart = f32x16::splat(simd, 2.0);
                    CandidateBlock::new(first, lanes, (centres, [apart; 3]), [apart, apart])
                }));
            }
            all.sort_by_key(|&(i, _)| i);
            found.arrange();
            let (mut taken, mut expected) = (contacts.to_vec(), Vec::new());
            for _ in 0..9 {
                let mut best: Option<(f32, usize, [f32; 3])> = None;
                for &(i, place) in &all {
                    let apart = |at: &[f32; 3]| (0..3).map(|k| (place[k] - at[k]).powi(2)).sum::<f32>();
                    let away = taken.iter().map(apart).fold(f32::INFINITY, f32::min);
                    if away > 4.0 && best.is_none_or(|best| away > best.0) && !expected.contains(&i) {
                        best = Some((away, i, place));
                    }
                }
                let Some((_, i, place)) = best else { break };
                expected.push(i);
                taken.push(place);
            }
            counts[expected.len()] += 1;
            for level in levels() {
                let (mut left, mut chosen) = (found.clone(), Vec::new());
                left.choose(level, contacts, (9, &mut chosen));
                let chosen: Vec<usize> = chosen.into_iter().map(|candidate| left.point(candidate)).collect();
                assert_eq!(chosen, expected, "round {round}, {level:?}");
            }
        }
        assert!(counts[9] > 100 && counts[..9].iter().sum::<usize>() > 50, "{counts:?} by number");
    }
}
