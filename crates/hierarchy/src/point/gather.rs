//! The points that f(x) needs: those whose horizon reaches x, from the neighbour list of a leaf near x, or by
//! a descent where no list holds.

use bytemuck::{Pod, Zeroable};
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x4, mask32x4};
use nearmiss_geometry::NodeId;
use nearmiss_index::PointBlock;
use nearmiss_lanes::id32;
use nearmiss_lanes::vector::{dot, sub};
use nearmiss_surface::{Centre, Evaluation, HalfBlock, Moments, Neighbourhood, SurfacePlan};

use crate::tree::topology::TREE_STACK;
use crate::tree::wide::Tree;

/// Points of a group of blocks.
pub(crate) const GROUP: usize = PointBlock::WIDTH * PointBlock::WIDTH;

/// What rounding may cost a comparison of distances, relatively.
pub(crate) const GROWN: f32 = 1.0 + 1e-5;

/// Which entries of the array of all lists are a block's, and where they are complete.
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[repr(C)]
pub struct NeighbourList {
    /// At places no further than this from the middle of the block's ball; negative where there is no list.
    pub within: f32,
    /// The first entry.
    pub first: u32,
    /// Number of entries.
    pub count: u32,
}

/// Reused between evaluations; never influences a result.
#[derive(Debug, Clone)]
pub struct GatherScratch {
    pub(crate) level: Level,
    /// The block near which f was evaluated last.
    pub(crate) block: usize,
    /// Groups that a descent found.
    pub(crate) found: Vec<u32>,
    /// Blocks that are heard at x.
    heard: Vec<u32>,
    /// How near they are.
    halves: Vec<HalfBlock>,
}

impl Default for GatherScratch {
    fn default() -> Self {
        Self::at(Level::new())
    }
}

impl GatherScratch {
    /// One whose evaluations use the instructions of `level`: no result depends on it.
    #[must_use]
    pub fn at(level: Level) -> Self {
        Self { level, block: 0, found: Vec::new(), heard: Vec::new(), halves: Vec::new() }
    }
}

/// What a search for neighbours reads.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Index<'a> {
    pub(crate) tree: Tree<'a>,
    pub(crate) blocks: &'a [PointBlock],
    pub(crate) groups: &'a [PointBlock],
    pub(crate) lists: &'a [NeighbourList],
    pub(crate) listed: &'a [u32],
    pub(crate) plan: &'a SurfacePlan,
}

impl<'a> Index<'a> {
    /// One by which lists are made: all is found by descent.
    pub(crate) fn without_lists(
        tree: Tree<'a>,
        (blocks, groups): (&'a [PointBlock], &'a [PointBlock]),
        plan: &'a SurfacePlan,
    ) -> Self {
        Self { tree, blocks, groups, lists: &[], listed: &[], plan }
    }
}

impl<'a> Index<'a> {
    /// f at `x`.
    pub(crate) fn evaluate(&self, x: [f64; 3], scratch: &mut GatherScratch) -> Evaluation {
        let centre = Centre::new(x);
        let place = centre.rounded();
        let GatherScratch { level, block, found, heard, halves } = scratch;
        let mut list = self.list(*block, place, 0.0);
        if list.is_none() {
            *block = self.nearest_block(*level, place);
            list = self.list(*block, place, 0.0);
        }
        let list = list.unwrap_or_else(|| {
            self.collect(*level, place, 0.0, found);
            &*found
        });
        dispatch!(*level, simd => simd.vectorize(
            #[inline(always)]
            || self.moments(simd, &centre, list, heard, halves).evaluate(self.plan, x),
        ))
    }

    /// The groups of which a point may be heard within `distance` of `x`, if the list of this block is
    /// complete there.
    #[inline]
    pub(crate) fn list(&self, block: usize, x: [f32; 3], distance: f32) -> Option<&'a [u32]> {
        let list = self.lists.get(block)?;
        let d = sub(x, self.middle(block)?);
        let first = list.first as usize;
        let within = list.within - distance;
        let complete = within > 0.0 && dot(d, d) <= within * within;
        if complete { self.listed.get(first..first + list.count as usize) } else { None }
    }

    /// The middle of the ball about a block.
    #[inline]
    pub(crate) fn middle(&self, block: usize) -> Option<[f32; 3]> {
        let [x, y, z] = &self.groups.get(block / PointBlock::WIDTH)?.position;
        let lane = block % PointBlock::WIDTH;
        Some([x[lane], y[lane], z[lane]])
    }

    /// Of the blocks that are heard near `block` the one with the middle nearest to `x`.
    pub(crate) fn next_block(&self, block: usize, x: [f32; 3]) -> Option<usize> {
        const LANES: usize = PointBlock::WIDTH;
        let list = self.lists.get(block)?;
        let first = list.first as usize;
        // Lane by lane, as they stand side by side.
        let (mut least, mut nearest) = ([f32::INFINITY; LANES], [0_u32; LANES]);
        for &group in self.listed.get(first..first + list.count as usize)? {
            let [px, py, pz] = &self.groups.get(group as usize)?.position;
            for i in 0..LANES {
                let d = [px[i] - x[0], py[i] - x[1], pz[i] - x[2]];
                let far = dot(d, d);
                nearest[i] = if far < least[i] { group } else { nearest[i] };
                least[i] = least[i].min(far);
            }
        }
        let lane = (0..LANES).min_by(|&i, &k| least[i].total_cmp(&least[k]))?;
        Some(nearest[lane] as usize * LANES + lane)
    }

    /// A block of the leaf whose box is near `x`: always into the nearest child.
    fn nearest_block(&self, level: Level, x: [f32; 3]) -> usize {
        let Tree { topology, siblings, .. } = self.tree;
        let mut id = NodeId::ROOT;
        while !topology.is_leaf(id) {
            let distances = dispatch!(level, simd => simd.vectorize(
                #[inline(always)]
                || siblings[id.index()].distances_sq(simd, x).to_array(),
            ));
            let children = topology.children(id).iter().zip(distances);
            id = children.reduce(nearer).map_or(id, |(child, _)| child);
        }
        topology.points(id).start / PointBlock::WIDTH
    }

    /// The groups of which a point may be heard within `distance` of `x`, ascending.
    pub(crate) fn collect(&self, level: Level, x: [f32; 3], distance: f32, found: &mut Vec<u32>) {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.collect_by(simd, x, distance, found),
        ));
    }

    /// [`Self::collect`] by the instructions of the caller.
    #[inline(always)]
    pub(crate) fn collect_by<S: Simd>(&self, simd: S, x: [f32; 3], distance: f32, found: &mut Vec<u32>) {
        found.clear();
        let Tree { topology, siblings, .. } = self.tree;
        let mut stack = [NodeId::ROOT; TREE_STACK];
        let mut top = 1;
        // Leaves come in order, and many in one group.
        let mut next = 0;
        while top > 0 {
            top -= 1;
            let id = stack[top];
            let points = topology.points(id);
            let (first, end) = (points.start / GROUP, points.end.div_ceil(GROUP));
            if end <= next {
                continue;
            }
            if topology.is_leaf(id) {
                found.extend((first.max(next)..end).map(id32));
                next = end;
                continue;
            }
            let (children, below) = (topology.children(id), &siblings[id.index()]);
            let [a, b, c, d] = below.reach;
            let horizon = |reach: f32| self.plan.horizon(reach);
            let horizons = f32x4::load_array(simd, [horizon(a), horizon(b), horizon(c), horizon(d)]);
            let far = (horizons + distance) * GROWN;
            let is_near: mask32x4<S> = below.distances_sq(simd, x).simd_lt(far * far);
            let near = is_near.to_bitmask();
            // The first comes next.
            for lane in (0..children.len()).rev() {
                stack[top] = children.lanes()[lane];
                top += usize::from(near >> lane & 1 != 0);
            }
        }
    }

    /// The blocks of these groups, which ascend, that may be heard within `distance` of `x`: written to the
    /// front of `heard`, of which they are returned.
    #[inline(always)]
    pub(crate) fn heard<'b, S: Simd>(
        &self,
        simd: S,
        groups: &[u32],
        x: [f32; 3],
        distance: f32,
        heard: &'b mut Vec<u32>,
    ) -> &'b mut [u32] {
        let most = (groups.len() + 1) * PointBlock::WIDTH;
        if heard.len() < most {
            heard.resize(most, 0);
        }
        let (balls, heard, mut count) = (self.groups, &mut heard[..most], 0);
        for &group in groups {
            let balls = balls.get(group as usize);
            let room = heard.get_mut(count..).and_then(<[u32]>::first_chunk_mut);
            if let (Some(balls), Some(room)) = (balls, room) {
                count += balls.heard(simd, x, distance, group * id32(PointBlock::WIDTH), room);
            }
        }
        &mut heard[..count]
    }

    /// The sums over all points of `groups`, which ascend, about x.
    #[inline(always)]
    pub(crate) fn moments<S: Simd>(
        &self,
        simd: S,
        x: &Centre,
        groups: &[u32],
        heard: &mut Vec<u32>,
        halves: &mut Vec<HalfBlock>,
    ) -> Moments {
        let mut near = Neighbourhood::new(simd, self.plan, x);
        let heard = self.heard(simd, groups, x.rounded(), 0.0, heard);
        near.offer_all(simd, self.blocks, heard, halves);
        near.moments(simd)
    }
}

/// The nearer of two nodes, the first of equals or where one is no number.
fn nearer(best: (NodeId, f32), other: (NodeId, f32)) -> (NodeId, f32) {
    if other.1 < best.1 { other } else { best }
}
