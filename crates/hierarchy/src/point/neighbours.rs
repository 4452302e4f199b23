//! Neighbour lists: for each block of points, the groups of blocks with support near it, so that f
//! can be evaluated there without a descent.
//!
//! These are the lists of molecular dynamics (Verlet 1967), for blocks of points instead of
//! particles. A ball around each block contains the support balls of all its points. The balls of
//! [`PointBlock::WIDTH`] blocks, a group, are stored side by side like points with support radii.
//! The list of a block contains groups. It is complete at all positions within some distance of the
//! centre of the block's ball. That is far enough for every surface point whose nearest stored
//! point is in the block (`docs/theory/certificates.md`, fact 2).

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16};
use nearmiss_index::PointBlock;
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::{change_each, fill, in_order};
use nearmiss_lanes::vector::{dot, sub};
use nearmiss_lanes::wide::{Vectors, WIDTH, greatest_of_each, product, seen_from, sum_of_each};
use nearmiss_store::{Room, WorkError, Workspace};
use nearmiss_surface::SurfacePlan;

use crate::bounds::boxes::ROUNDING;
use crate::point::gather::{GROWN, Index, NeighbourList, Supports};

/// The maximum length of a list. A block with more neighbours has no list, and f near it is found
/// by descent. Blocks on surfaces have about seven. Where sparse and dense regions meet, or
/// bandwidths are large, lists would contain everything.
pub(crate) const MOST_LISTED: usize = 64;

/// The number of entries per block for which memory is reserved; lists on surfaces have about
/// seven.
const USUAL_ENTRIES: usize = 10;

/// The number of steps towards the smallest ball around a block (Bădoiu & Clarkson 2003).
const CENTRING: u8 = 12;

/// The same for a block of points that move: a third of the time, for balls that are larger by a
/// hundredth.
const CENTRING_IN_MOTION: u8 = 3;

/// Sets `out` to the points in blocks, with their support radii. O(n), on all cores.
pub(crate) fn blocks(plan: &SurfacePlan, positions: &[[f32; 3]], radii: &[f32], out: &mut [PointBlock]) {
    fill(out, |number| {
        let start = number * PointBlock::WIDTH;
        let points = start..(start + PointBlock::WIDTH).min(positions.len());
        let mut block = plan.blocks(&positions[points.clone()], &radii[points]);
        block.next().unwrap_or(PointBlock::EMPTY)
    });
}

/// Returns the balls around `blocks` and their support, in groups.
pub(crate) fn groups(blocks: &[PointBlock], work: &Workspace) -> Result<Room<PointBlock>, WorkError> {
    let mut groups = work.room(blocks.len().div_ceil(PointBlock::WIDTH))?;
    fill_groups(blocks, &mut groups, CENTRING);
    Ok(groups)
}

/// Returns slightly larger balls in less time, for searches that end before the scan is ready.
pub(crate) fn rough_groups(blocks: &[PointBlock], work: &Workspace) -> Result<Room<PointBlock>, WorkError> {
    let mut groups = work.room(blocks.len().div_ceil(PointBlock::WIDTH))?;
    groups_in_motion(blocks, &mut groups);
    Ok(groups)
}

/// Sets `groups` to slightly larger balls in less time.
pub(crate) fn groups_in_motion(blocks: &[PointBlock], groups: &mut [PointBlock]) {
    fill_groups(blocks, groups, CENTRING_IN_MOTION);
}

/// Sets `groups` to the balls around `blocks` and their support.
fn fill_groups(blocks: &[PointBlock], groups: &mut [PointBlock], steps: u8) {
    const AT_ONCE: usize = 8;
    let level = Level::new();
    change_each(groups, AT_ONCE, |number, group| {
        let blocks = &blocks[number * WIDTH..blocks.len().min((number + 1) * WIDTH)];
        *group = dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || balls(simd, blocks, steps),
        ));
    });
}

/// Returns the levels of balls above `groups` in motion.
pub(crate) fn supports(groups: &[PointBlock]) -> Supports {
    let mut levels: Vec<Vec<PointBlock>> = Vec::new();
    while let below = levels.last().map_or(groups, |level| level)
        && below.len() > 1
    {
        let mut above = vec![PointBlock::EMPTY; below.len().div_ceil(PointBlock::WIDTH)];
        groups_in_motion(below, &mut above);
        levels.push(above);
    }
    Supports { levels }
}

/// Returns a ball for each of up to sixteen `blocks`. It contains the support balls of all points of the
/// block.
#[inline(always)]
fn balls<S: Simd>(simd: S, blocks: &[PointBlock], steps: u8) -> PointBlock {
    let (zero, infinite) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, f32::INFINITY));
    let mut centres = means(simd, blocks);
    // The smallest ball of balls: from the mean, ever smaller steps towards the point whose support
    // ball extends furthest.
    let mut best = (centres, infinite);
    for step in 2..2 + steps {
        let [x, y, z] = [centres[0].to_array(), centres[1].to_array(), centres[2].to_array()];
        let mut rows = [zero; WIDTH];
        for (i, block) in blocks.iter().enumerate() {
            let d = seen_from(simd, &block.position, [x[i], y[i], z[i]]);
            let support_radii = f32x16::load_array_ref(simd, &block.support_radius);
            let outer = product(d, d).sqrt() + support_radii;
            rows[i] = simd.select_f32x16(support_radii.simd_gt(0.0), outer, zero);
        }
        let radii = greatest_of_each(rows);
        let wide = f32x16::load_array(simd, radii);
        let is_better: mask32x16<S> = wide.simd_lt(best.1);
        best.1 = simd.select_f32x16(is_better, wide, best.1);
        let share = 1.0 / f32::from(step);
        let mut furthest = [[0.0; WIDTH]; 3];
        for (i, block) in blocks.iter().enumerate() {
            let is_furthest: mask32x16<S> = rows[i].simd_eq(radii[i]);
            let place = is_furthest.to_bitmask().trailing_zeros() as usize % WIDTH;
            for k in 0..3 {
                furthest[k][i] = block.position[k][place];
            }
        }
        for k in 0..3 {
            best.0[k] = simd.select_f32x16(is_better, centres[k], best.0[k]);
            let furthest = f32x16::load_array(simd, furthest[k]);
            centres[k] += (furthest - centres[k]) * share;
        }
    }
    let (centres, radii) = best;
    let far = centres[0].abs().max(centres[1].abs()).max(centres[2].abs()).max(radii);
    let radii = (radii * GROWN + far * ROUNDING).to_array();
    let mut found = PointBlock::EMPTY;
    let count = blocks.len().min(WIDTH);
    found.support_radius[..count].copy_from_slice(&radii[..count]);
    for k in 0..3 {
        found.position[k][..count].copy_from_slice(&centres[k].to_array()[..count]);
    }
    found
}

/// Returns the means of the points of each of up to sixteen `blocks`.
#[inline(always)]
fn means<S: Simd>(simd: S, blocks: &[PointBlock]) -> Vectors<S> {
    let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
    let mut rows = [[zero; WIDTH]; 4];
    for (i, block) in blocks.iter().enumerate() {
        let is_there: mask32x16<S> = f32x16::load_array_ref(simd, &block.support_radius).simd_gt(0.0);
        for k in 0..3 {
            let row = f32x16::load_array_ref(simd, &block.position[k]);
            rows[k][i] = simd.select_f32x16(is_there, row, zero);
        }
        rows[3][i] = simd.select_f32x16(is_there, one, zero);
    }
    let [x, y, z, counts] = rows;
    let share = one / f32x16::load_array(simd, sum_of_each(counts)).max(one);
    [
        f32x16::load_array(simd, sum_of_each(x)) * share,
        f32x16::load_array(simd, sum_of_each(y)) * share,
        f32x16::load_array(simd, sum_of_each(z)) * share,
    ]
}

/// The lists of some blocks, in order.
#[derive(Debug, Default)]
pub(crate) struct Lists {
    pub(crate) lists: Vec<NeighbourList>,
    pub(crate) entries: Vec<u32>,
}

impl Lists {
    /// Adds the list of the next block, complete `within` some distance of the centre of its ball.
    pub(crate) fn push(&mut self, within: f32, entries: impl ExactSizeIterator<Item = u32>) {
        let end = |entries: &[u32]| u32::try_from(entries.len()).unwrap_or(u32::MAX);
        let first = end(&self.entries);
        let fits = entries.len() <= MOST_LISTED && self.entries.len() + entries.len() < u32::MAX as usize;
        if fits {
            self.entries.extend(entries);
        }
        let within = if fits { within } else { -1.0 };
        self.lists.push(NeighbourList { within, first, count: end(&self.entries) - first });
    }
}

/// The points whose support is near some points. Can be reused.
#[derive(Debug, Default)]
pub(crate) struct Locality {
    /// The groups, ascending.
    pub(crate) groups: Vec<u32>,
    /// The blocks of these groups with support near the points, ascending.
    pub(crate) blocks: Vec<u32>,
    /// The balls around these blocks and their support, side by side.
    balls: Vec<PointBlock>,
    /// The supports of all other blocks are further than this from the centre.
    pub(crate) within: f32,
    /// No surface point is further than this from its nearest point, if that is one of the points.
    pub(crate) reach: f32,
}

impl Locality {
    /// Collects all blocks with support where there can be surface points whose nearest point is
    /// one of `points`, around their `middle`. `guess` estimates the greatest local radius among
    /// them.
    #[inline(always)]
    pub(crate) fn collect<S: Simd>(
        &mut self,
        simd: S,
        index: &Index<'_>,
        points: &[[f32; 3]],
        middle: [f32; 3],
        guess: f32,
    ) {
        let own = points.iter().map(|p| sub(*p, middle)).map(|d| dot(d, d)).fold(0.0, f32::max).sqrt();
        let mut half = 0.5 * index.plan.support_radius(guess);
        // A good guess saves a second descent.
        loop {
            self.collect_within(simd, index, middle, (own + half) * GROWN);
            self.reach = 0.5 * self.greatest_support_radius(index, middle, own * GROWN);
            if self.reach <= half {
                return;
            }
            half = self.reach;
        }
    }

    /// Collects all blocks with support within a distance of `middle`.
    #[inline(always)]
    pub(crate) fn collect_within<S: Simd>(
        &mut self,
        simd: S,
        index: &Index<'_>,
        middle: [f32; 3],
        within: f32,
    ) {
        self.within = within;
        index.collect_by(simd, middle, within, &mut self.groups);
        let count = index.supporting(simd, &self.groups, middle, within, &mut self.blocks).len();
        self.blocks.truncate(count);
    }

    /// Gathers the balls around the blocks, for [`Self::supporting`].
    #[inline(always)]
    pub(crate) fn gather_balls(&mut self, index: &Index<'_>) {
        self.balls.clear();
        self.balls.resize(self.blocks.len().div_ceil(WIDTH), PointBlock::EMPTY);
        for (i, &block) in self.blocks.iter().enumerate() {
            let (balls, lane) = (&mut self.balls[i / WIDTH], i % WIDTH);
            let (group, of_block) = (&index.groups[block as usize / WIDTH], block as usize % WIDTH);
            for k in 0..3 {
                balls.position[k][lane] = group.position[k][of_block];
            }
            balls.support_radius[lane] = group.support_radius[of_block];
        }
    }

    /// Finds those of the blocks whose support may come within `distance` of `x`. Writes their
    /// places in `self.blocks` to the front of `places`, ascending, and returns that part. There
    /// are fewer of them than in the groups, which makes this faster than [`Index::supporting`].
    #[inline(always)]
    pub(crate) fn supporting<'p, S: Simd>(
        &self,
        simd: S,
        x: [f32; 3],
        distance: f32,
        places: &'p mut Vec<u32>,
    ) -> &'p mut [u32] {
        let most = (self.balls.len() + 1) * WIDTH;
        if places.len() < most {
            places.resize(most, 0);
        }
        let (places, mut count, mut first) = (&mut places[..most], 0, 0);
        for balls in &self.balls {
            if let Some(room) = places.get_mut(count..).and_then(<[u32]>::first_chunk_mut) {
                count += balls.supporting(simd, x, distance, first, room);
            }
            first += id32(WIDTH);
        }
        &mut places[..count]
    }

    /// Returns the greatest support radius of the points whose support ball comes within `distance`
    /// of `x`.
    #[inline(always)]
    fn greatest_support_radius(&self, index: &Index<'_>, x: [f32; 3], distance: f32) -> f32 {
        let mut greatest = [0.0_f32; PointBlock::WIDTH];
        for &block in &self.blocks {
            let PointBlock { position: [px, py, pz], support_radius, .. } = &index.blocks[block as usize];
            for i in 0..PointBlock::WIDTH {
                let d = [px[i] - x[0], py[i] - x[1], pz[i] - x[2]];
                let far = (support_radius[i] + distance) * GROWN;
                let radius = if dot(d, d) < far * far { support_radius[i] } else { 0.0 };
                greatest[i] = if radius > greatest[i] { radius } else { greatest[i] };
            }
        }
        greatest.into_iter().fold(0.0, f32::max)
    }
}

/// Returns the neighbour lists of all blocks, and their entries.
pub(crate) fn neighbours(
    index: &Index<'_>,
    positions: &[[f32; 3]],
    radii: &[f32],
    work: &Workspace,
) -> Result<(Room<NeighbourList>, Room<u32>), WorkError> {
    let level = Level::new();
    let some = |locality: &mut Locality, blocks: Range<usize>| {
        let mut lists = Lists::default();
        for block in blocks {
            let first = block * PointBlock::WIDTH;
            let points = first..(first + PointBlock::WIDTH).min(positions.len());
            let guess = 1.3 * radii[points.clone()].iter().copied().fold(0.0, f32::max);
            let middle = index.middle(block).unwrap_or(positions[first]);
            dispatch!(level, simd => simd.vectorize(
                #[inline(always)]
                || locality.collect(simd, index, &positions[points], middle, guess)
            ));
            lists.push(locality.within, locality.groups.iter().copied());
        }
        lists
    };
    let blocks = index.blocks.len();
    let mut lists = work.room(blocks)?;
    // More memory than most scans need; it grows if a scan needs more.
    let mut entries = work.room(blocks * USUAL_ENTRIES)?;
    let (mut list, mut end, mut failed) = (0, 0, None);
    in_order(blocks, Locality::default, some, |some| {
        let shift = u32::try_from(end).unwrap_or(u32::MAX);
        for of_block in some.lists {
            lists[list] = NeighbourList { first: of_block.first.saturating_add(shift), ..of_block };
            list += 1;
        }
        let count = some.entries.len();
        if failed.is_none() && end + count > entries.len() {
            match work.room(2 * (end + count)) {
                Ok(mut more) => {
                    more[..end].copy_from_slice(&entries[..end]);
                    entries = more;
                }
                Err(cause) => failed = Some(cause),
            }
        }
        if failed.is_none() {
            entries[end..end + count].copy_from_slice(&some.entries);
            end += count;
        }
    });
    entries.truncate(end);
    failed.map_or(Ok((lists, entries)), Err)
}

#[cfg(test)]
mod tests {
    use nearmiss_testdata::arbitrary::{CloudKind, cloud, rng};
    use rand::RngExt;

    use super::*;
    use crate::tree::topology::Topology;
    use crate::tree::wide::Tree;

    #[test]
    #[expect(clippy::cast_possible_truncation, reason = "stored in single precision")]
    fn every_group_with_support_near_a_place_is_found_by_balls() {
        let (rng, work) = (&mut rng(3), Workspace::in_memory());
        // One group, one level, two levels and three.
        for count in [20, 300, 5_000, 70_000] {
            let mut positions: Vec<[f32; 3]> =
                cloud(CloudKind::Random, count, 8).iter().map(|p| p.map(|x| x as f32)).collect();
            // Along columns, so that points that follow each other are mostly close.
            let column = |p: &[f32; 3]| [p[0], p[1]].map(|x| (3.0 * x) as i32);
            positions.sort_by(|p, q| column(p).cmp(&column(q)).then(p[2].total_cmp(&q[2])));
            let mut blocks: Vec<PointBlock> = PointBlock::without_support(&positions).collect();
            for block in &mut blocks {
                block.support_radius =
                    block.position[0].map(|x| if x < 1e30 { 0.01 + 0.02 * x.abs() } else { 0.0 });
            }
            let groups = rough_groups(&blocks, &work).unwrap();
            let supports = supports(&groups);
            let topology = Topology::new(id32(positions.len()), 16);
            let plan = SurfacePlan::new(&nearmiss_surface::SurfaceOptions::default(), 0.01, 1.0).unwrap();
            let index = Index {
                supports: Some(&supports),
                ..Index::without_lists(Tree::without_boxes(&topology), (&blocks, &groups), &plan)
            };
            let (mut found, mut all) = (Vec::new(), 0);
            for _ in 0..200 {
                let p: [f32; 3] = positions[rng.random_range(0..positions.len())];
                let (x, distance) = (p.map(|c| c + rng.random_range(-0.1..0.1)), rng.random_range(0.0..0.1));
                index.collect(Level::new(), x, distance, &mut found);
                assert!(
                    found.is_sorted_by(|a, b| a < b) && found.iter().all(|id| (*id as usize) < groups.len())
                );
                for (i, p) in positions.iter().enumerate() {
                    let (block, d) = (&blocks[i / PointBlock::WIDTH], sub(*p, x));
                    let is_near = dot(d, d).sqrt() < block.support_radius[i % PointBlock::WIDTH] + distance;
                    let group = id32(i / PointBlock::WIDTH.pow(2));
                    assert!(!is_near || found.contains(&group), "point {i} of {count} supports {x:?}");
                }
                all += found.len();
            }
            let mean = all / 200;
            assert!(count < 70_000 || mean < groups.len() / 4, "{mean} of {} groups", groups.len());
        }
    }
}
