//! Neighbour lists: for each block of points, the groups of blocks whose horizons reach near it, so that f is
//! evaluated there without a descent.
//!
//! The lists of molecular dynamics (Verlet 1967), kept for blocks of points instead of particles. About every
//! block there is a ball that contains the horizons of all its points; the balls of [`PointBlock::WIDTH`]
//! blocks, a group, stand side by side like points with horizons. The list of a block names groups. It is
//! complete for every place within some distance of the middle of the block's ball, far enough for every
//! surface point whose nearest stored point is the block's (`docs/theory/certificates.md`, fact 2).

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16};
use nearmiss_index::PointBlock;
use nearmiss_lanes::parallel::{fill, in_order};
use nearmiss_lanes::vector::{dot, sub};
use nearmiss_lanes::wide::{greatest, product, seen_from};
use nearmiss_store::{Room, WorkError, Workspace};
use nearmiss_surface::SurfacePlan;

use crate::bounds::boxes::ROUNDING;
use crate::point::gather::{GROWN, Index, NeighbourList};

/// No list is longer; a block that hears more has none, and f near it is found by descent. Blocks on surfaces
/// hear some seven; where the scan is sparse beside dense, or a bandwidth large, lists would be of
/// everything.
pub(crate) const MOST_LISTED: usize = 64;

/// Entries that there is room for at first, a block: on surfaces lists have some seven.
const USUAL_ENTRIES: usize = 10;

/// Steps towards the least ball about a block (Bădoiu & Clarkson 2003).
const CENTRING: u8 = 12;

/// Sets `out` to the points in blocks, with their horizons. O(n), on all cores.
pub(crate) fn blocks(plan: &SurfacePlan, positions: &[[f32; 3]], radii: &[f32], out: &mut [PointBlock]) {
    fill(out, |number| {
        let start = number * PointBlock::WIDTH;
        let points = start..(start + PointBlock::WIDTH).min(positions.len());
        let mut block = plan.blocks(&positions[points.clone()], &radii[points]);
        block.next().unwrap_or(PointBlock::EMPTY)
    });
}

/// For every group of blocks the balls outside of which no point of a block is heard, given the blocks.
pub(crate) fn groups(blocks: &[PointBlock], work: &Workspace) -> Result<Room<PointBlock>, WorkError> {
    const WIDTH: usize = PointBlock::WIDTH;
    let level = Level::new();
    let mut groups = work.room(blocks.len().div_ceil(WIDTH))?;
    fill(&mut groups, |number| {
        let blocks = &blocks[number * WIDTH..blocks.len().min((number + 1) * WIDTH)];
        let mut group = PointBlock::EMPTY;
        for (lane, block) in blocks.iter().enumerate() {
            let (centre, radius) = dispatch!(level, simd => simd.vectorize(
                #[inline(always)]
                || ball(simd, block),
            ));
            for k in 0..3 {
                group.position[k][lane] = centre[k];
            }
            group.horizon[lane] = radius;
        }
        group
    });
    Ok(groups)
}

/// A ball outside of which no point of a block is heard.
#[inline(always)]
fn ball<S: Simd>(simd: S, block: &PointBlock) -> ([f32; 3], f32) {
    let PointBlock { position: [x, y, z], horizon, .. } = block;
    let (mut sum, mut count) = ([0.0; 3], 0.0);
    for i in 0..PointBlock::WIDTH {
        if horizon[i] > 0.0 {
            (sum, count) = ([sum[0] + x[i], sum[1] + y[i], sum[2] + z[i]], count + 1.0);
        }
    }
    let mut centre = [sum[0] / count, sum[1] / count, sum[2] / count];
    // From the mean ever less far towards whoever is heard furthest: the least ball of balls.
    let horizons = f32x16::load_array_ref(simd, horizon);
    let is_there: mask32x16<S> = horizons.simd_gt(0.0);
    let mut best = (centre, f32::INFINITY);
    for step in 2..2 + CENTRING {
        let d = seen_from(simd, &block.position, centre);
        let heard = product(d, d).sqrt() + horizons;
        let heard = simd.select_f32x16(is_there, heard, f32x16::splat(simd, 0.0));
        let radius = greatest(heard, 0.0);
        if radius < best.1 {
            best = (centre, radius);
        }
        let furthest: mask32x16<S> = heard.simd_eq(radius);
        let i = furthest.to_bitmask().trailing_zeros() as usize % PointBlock::WIDTH;
        let share = 1.0 / f32::from(step);
        for (c, p) in centre.iter_mut().zip([x[i], y[i], z[i]]) {
            *c += share * (p - *c);
        }
    }
    let (centre, radius) = best;
    let far = centre.iter().fold(radius, |far, c| far.max(c.abs()));
    (centre, radius * GROWN + ROUNDING * far)
}

/// The lists of all blocks, as they are found one after the other.
#[derive(Debug, Default)]
pub(crate) struct Lists {
    pub(crate) lists: Vec<NeighbourList>,
    pub(crate) entries: Vec<u32>,
}

impl Lists {
    /// The list of the next block, complete `within` some distance of the middle of its ball.
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

/// What is heard near some points. Reused.
#[derive(Debug, Default)]
pub(crate) struct Locality {
    /// The groups, ascending.
    pub(crate) groups: Vec<u32>,
    /// Their blocks that are heard, ascending.
    pub(crate) blocks: Vec<u32>,
    /// What is not among them is not heard within this distance of the middle.
    pub(crate) within: f32,
    /// No surface point whose nearest point is one of the points is further from that than this.
    pub(crate) reach: f32,
}

impl Locality {
    /// Collects all that is heard where surface points can be whose nearest point is one of `points`, about
    /// their `middle`; `guess` is what the greatest local radius heard there may be.
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
        let mut half = 0.5 * index.plan.horizon(guess);
        // A good guess saves a second descent.
        loop {
            self.within = (own + half) * GROWN;
            index.collect_by(simd, middle, self.within, &mut self.groups);
            let count = index.heard(simd, &self.groups, middle, self.within, &mut self.blocks).len();
            self.blocks.truncate(count);
            self.reach = 0.5 * self.greatest_heard(index, middle, own * GROWN);
            if self.reach <= half {
                return;
            }
            half = self.reach;
        }
    }

    /// The greatest horizon of a point that is heard within `distance` of `x`.
    #[inline(always)]
    fn greatest_heard(&self, index: &Index<'_>, x: [f32; 3], distance: f32) -> f32 {
        let mut greatest = [0.0_f32; PointBlock::WIDTH];
        for &block in &self.blocks {
            let PointBlock { position: [px, py, pz], horizon, .. } = &index.blocks[block as usize];
            for i in 0..PointBlock::WIDTH {
                let d = [px[i] - x[0], py[i] - x[1], pz[i] - x[2]];
                let far = (horizon[i] + distance) * GROWN;
                let heard = if dot(d, d) < far * far { horizon[i] } else { 0.0 };
                greatest[i] = if heard > greatest[i] { heard } else { greatest[i] };
            }
        }
        greatest.into_iter().fold(0.0, f32::max)
    }
}

/// The neighbour lists of all blocks, and the entries of these.
pub(crate) fn neighbours(
    index: &Index<'_>,
    positions: &[[f32; 3]],
    radii: &[f32],
    work: &Workspace,
) -> Result<(Room<NeighbourList>, Room<u32>), WorkError> {
    let level = Level::new();
    let some = |blocks: Range<usize>| {
        let (mut locality, mut lists) = (Locality::default(), Lists::default());
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
    // Room for more than most scans need; moved where a scan needs more.
    let mut entries = work.room(blocks * USUAL_ENTRIES)?;
    let (mut list, mut end, mut failed) = (0, 0, None);
    in_order(blocks, some, |some| {
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
