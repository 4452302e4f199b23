//! The order of candidates: the deepest, the deepest of other walls, and the furthest.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16, u32x16};
use nearmiss_lanes::id32;
use nearmiss_lanes::wide::{Bits, along, bits, load, seen_from, squared};

use super::{Among, Candidate, CandidateBlock, CandidateBlocks, WIDTH, in_lanes};

/// The cosine below which two normals are those of different walls.
const UNLIKE: f32 = 0.7;

impl CandidateBlocks {
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

#[cfg(test)]
mod tests {
    use std::collections::BinaryHeap;

    use nearmiss_testdata::arbitrary::rng;
    use nearmiss_testdata::instructions::levels;
    use rand::RngExt;

    use super::super::CandidateLanes;
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
