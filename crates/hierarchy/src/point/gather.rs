//! Gathers the points that f(x) needs, those within their support radius of x: from the neighbour
//! list of a block near x, or by a descent where no list is complete. The support of a block or
//! group is the union of the support balls of its points.

use std::ops::ControlFlow;

use bytemuck::{Pod, Zeroable};
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x4};
use nearmiss_geometry::NodeId;
use nearmiss_index::PointBlock;
use nearmiss_lanes::id32;
use nearmiss_lanes::vector::{dot, sub};
use nearmiss_surface::{Centre, Evaluation, Gathered, HalfBlock, Neighbourhood, SurfacePlan};

use crate::descent::PlaceVisitor;
use crate::tree::wide::Tree;

/// The number of points in a group of blocks.
pub(crate) const GROUP: usize = PointBlock::WIDTH * PointBlock::WIDTH;

/// Bound on the relative rounding error of a comparison of distances.
pub(crate) const GROWN: f32 = 1.0 + 1e-5;

/// The slice of the array of all lists that is the list of a block, and the ball in which the list
/// is complete.
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[repr(C)]
pub struct NeighbourList {
    /// The list is complete at positions up to this distance from the centre of the block's ball.
    /// Negative if there is no list.
    pub within: f32,
    /// The first entry.
    pub first: u32,
    /// The number of entries.
    pub count: u32,
}

/// Scratch memory of evaluations. Never influences a result.
#[derive(Debug, Clone)]
pub struct GatherScratch {
    pub(crate) level: Level,
    /// The block near which f was evaluated last.
    pub(crate) block: usize,
    /// The groups that a descent found.
    pub(crate) found: Vec<u32>,
    /// The blocks whose support may contain x.
    supporting: Vec<u32>,
    /// Intermediate values of half blocks.
    halves: Vec<HalfBlock>,
    /// The points that support positions near a place.
    gathered: Gathered,
}

impl Default for GatherScratch {
    fn default() -> Self {
        Self::at(Level::new())
    }
}

impl GatherScratch {
    /// Creates scratch memory for evaluations with the instruction set `level`, which does not
    /// affect results.
    #[must_use]
    pub fn at(level: Level) -> Self {
        Self {
            level,
            block: 0,
            found: Vec::new(),
            supporting: Vec::new(),
            halves: Vec::new(),
            gathered: Gathered::default(),
        }
    }
}

/// The arrays that a search for neighbours reads.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Index<'a> {
    pub(crate) tree: Tree<'a>,
    pub(crate) blocks: &'a [PointBlock],
    pub(crate) groups: &'a [PointBlock],
    pub(crate) lists: &'a [NeighbourList],
    pub(crate) listed: &'a [u32],
    pub(crate) plan: &'a SurfacePlan,
    /// The balls above the groups, where the boxes of nodes are not known yet.
    pub(crate) supports: Option<&'a Supports>,
}

/// The balls around groups and their support, in levels: a block of the first level has the balls of
/// sixteen groups, a block of the next one the balls around sixteen blocks below. The last level has one
/// block. Without levels there is one group.
#[derive(Debug, Clone, Default)]
pub(crate) struct Supports {
    pub(crate) levels: Vec<Vec<PointBlock>>,
}

impl Supports {
    /// The maximum number of levels above 2³² points.
    const MOST_LEVELS: usize = 6;

    /// Finds the groups whose support may come within `distance` of `x`, ascending.
    #[inline(always)]
    fn collect<S: Simd>(&self, simd: S, x: [f32; 3], distance: f32, found: &mut Vec<u32>) {
        let (mut lanes, mut counts) = ([[0; PointBlock::WIDTH]; Self::MOST_LEVELS], [0; Self::MOST_LEVELS]);
        let top = self.levels.len();
        if top == 0 {
            return found.push(0);
        }
        let mut level = top - 1;
        counts[level] = self.below(simd, (level, 0), (x, distance), &mut lanes[level]);
        while level < top {
            let Some(left) = counts[level].checked_sub(1) else {
                level += 1;
                continue;
            };
            counts[level] = left;
            let id = lanes[level][left];
            if level == 0 {
                found.push(id);
            } else {
                level -= 1;
                counts[level] = self.below(simd, (level, id), (x, distance), &mut lanes[level]);
            }
        }
    }

    /// Finds the balls of a block of a level that come within `distance` of `x`, the last one first.
    /// Returns their number.
    #[inline(always)]
    fn below<S: Simd>(
        &self,
        simd: S,
        (level, id): (usize, u32),
        (x, distance): ([f32; 3], f32),
        lanes: &mut [u32; PointBlock::WIDTH],
    ) -> usize {
        let (block, first) = (&self.levels[level][id as usize], id * id32(PointBlock::WIDTH));
        let count = block.supporting(simd, x, distance, first, lanes);
        lanes[..count].reverse();
        count
    }
}

impl<'a> Index<'a> {
    /// Creates an index without lists, for the construction of the lists: every search descends.
    pub(crate) fn without_lists(
        tree: Tree<'a>,
        (blocks, groups): (&'a [PointBlock], &'a [PointBlock]),
        plan: &'a SurfacePlan,
    ) -> Self {
        Self { tree, blocks, groups, lists: &[], listed: &[], plan, supports: None }
    }
}

impl<'a> Index<'a> {
    /// Evaluates f at `x`.
    pub(crate) fn evaluate(&self, x: [f64; 3], scratch: &mut GatherScratch) -> Evaluation {
        let centre = Centre::new(x);
        let count = self.list_supporting(centre.rounded(), 0.0, scratch);
        let GatherScratch { level, supporting, halves, .. } = scratch;
        dispatch!(*level, simd => simd.vectorize(
            #[inline(always)]
            || {
                let mut near = Neighbourhood::new(simd, self.plan, &centre);
                near.offer_all(simd, (self.blocks, &[]), &mut supporting[..count], halves);
                near.moments(simd).evaluate(self.plan, x)
            },
        ))
    }

    /// Gathers the points that support positions within `distance` of `place`.
    pub(crate) fn gather(&self, place: [f32; 3], distance: f32, scratch: &mut GatherScratch) {
        let count = self.list_supporting(place, distance * GROWN, scratch);
        let GatherScratch { level, supporting, gathered, .. } = scratch;
        dispatch!(*level, simd => simd.vectorize(
            #[inline(always)]
            || gathered.gather(simd, self.plan, (self.blocks, &supporting[..count]), place, distance),
        ));
    }

    /// Evaluates f at `x`, which is `centre`, from the points gathered last.
    #[inline]
    pub(crate) fn evaluate_gathered(
        &self,
        x: [f64; 3],
        centre: &Centre,
        scratch: &mut GatherScratch,
    ) -> Evaluation {
        let GatherScratch { level, gathered, .. } = scratch;
        dispatch!(*level, simd => simd.vectorize(
            #[inline(always)]
            || {
                let mut near = Neighbourhood::new(simd, self.plan, centre);
                near.offer_gathered(simd, gathered);
                near.moments(simd).evaluate(self.plan, x)
            },
        ))
    }

    /// Lists the blocks whose support may come within `distance` of `place` in `scratch`. Returns
    /// their number.
    #[inline]
    fn list_supporting(&self, place: [f32; 3], distance: f32, scratch: &mut GatherScratch) -> usize {
        let GatherScratch { level, block, found, supporting, .. } = scratch;
        let mut list = self.list(*block, place, distance);
        if list.is_none() {
            *block = self.nearest_block(*level, place);
            list = self.list(*block, place, distance);
        }
        let list = list.unwrap_or_else(|| {
            self.collect(*level, place, distance, found);
            &*found
        });
        dispatch!(*level, simd => simd.vectorize(
            #[inline(always)]
            || self.supporting(simd, list, place, distance, supporting).len(),
        ))
    }

    /// Returns the groups whose support may come within `distance` of `x`, if the list of `block`
    /// is complete there.
    #[inline]
    pub(crate) fn list(&self, block: usize, x: [f32; 3], distance: f32) -> Option<&'a [u32]> {
        let list = self.lists.get(block)?;
        let d = sub(x, self.middle(block)?);
        let first = list.first as usize;
        let within = list.within - distance;
        let complete = within > 0.0 && dot(d, d) <= within * within;
        if complete { self.listed.get(first..first + list.count as usize) } else { None }
    }

    /// Returns the centre of the ball around a block.
    #[inline]
    pub(crate) fn middle(&self, block: usize) -> Option<[f32; 3]> {
        let [x, y, z] = &self.groups.get(block / PointBlock::WIDTH)?.position;
        let lane = block % PointBlock::WIDTH;
        Some([x[lane], y[lane], z[lane]])
    }

    /// Returns the listed block near `block` whose centre is nearest to `x`.
    pub(crate) fn next_block(&self, block: usize, x: [f32; 3]) -> Option<usize> {
        const LANES: usize = PointBlock::WIDTH;
        let list = self.lists.get(block)?;
        let first = list.first as usize;
        // Lane by lane, as in memory.
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

    /// Returns a block of the leaf near `x` that is found by descending to the nearest child.
    fn nearest_block(&self, level: Level, x: [f32; 3]) -> usize {
        let mut first = FirstLeaf(0);
        let _found = self.tree.descend_to(level, x, &mut first);
        self.tree.topology.points_of_leaf(first.0).start / PointBlock::WIDTH
    }

    /// Finds the groups whose support may come within `distance` of `x`, ascending.
    pub(crate) fn collect(&self, level: Level, x: [f32; 3], distance: f32, found: &mut Vec<u32>) {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.collect_by(simd, x, distance, found),
        ));
    }

    /// Does the same as [`Self::collect`] with the instruction set of the caller.
    #[inline(always)]
    pub(crate) fn collect_by<S: Simd>(&self, simd: S, x: [f32; 3], distance: f32, found: &mut Vec<u32>) {
        found.clear();
        if let Some(supports) = self.supports {
            return supports.collect(simd, x, distance * GROWN, found);
        }
        // The visitor never breaks.
        let mut groups = Groups { tree: &self.tree, plan: self.plan, distance, found, next: 0 };
        let _whole = self.tree.descend_to_by(simd, x, &mut groups);
    }

    /// Finds the blocks of `groups`, which must ascend, whose support may come within `distance` of
    /// `x`. Writes them to the front of `supporting` and returns that part.
    #[inline(always)]
    pub(crate) fn supporting<'b, S: Simd>(
        &self,
        simd: S,
        groups: &[u32],
        x: [f32; 3],
        distance: f32,
        supporting: &'b mut Vec<u32>,
    ) -> &'b mut [u32] {
        let most = (groups.len() + 1) * PointBlock::WIDTH;
        if supporting.len() < most {
            supporting.resize(most, 0);
        }
        let (balls, supporting, mut count) = (self.groups, &mut supporting[..most], 0);
        for &group in groups {
            let balls = balls.get(group as usize);
            let room = supporting.get_mut(count..).and_then(<[u32]>::first_chunk_mut);
            if let (Some(balls), Some(room)) = (balls, room) {
                count += balls.supporting(simd, x, distance, group * id32(PointBlock::WIDTH), room);
            }
        }
        &mut supporting[..count]
    }
}

/// The search for all groups whose support may come within some distance of a position.
struct Groups<'a> {
    tree: &'a Tree<'a>,
    plan: &'a SurfacePlan,
    distance: f32,
    found: &'a mut Vec<u32>,
    /// The first group not visited yet: groups ascend.
    next: usize,
}

impl PlaceVisitor for Groups<'_> {
    /// Several leaves share a group; in order, each group is found once.
    const IN_ORDER: bool = true;

    #[inline(always)]
    fn most_sq(&self) -> f32 {
        f32::INFINITY
    }

    #[inline(always)]
    fn most_sq_of<S: Simd>(&self, simd: S, node: NodeId) -> f32x4<S> {
        let [a, b, c, d] = *self.tree.reaches_below(node);
        let support_radius = |reach: f32| self.plan.support_radius(reach);
        let support_radii = f32x4::load_array(
            simd,
            [support_radius(a), support_radius(b), support_radius(c), support_radius(d)],
        );
        let far = (support_radii + self.distance) * GROWN;
        far * far
    }

    #[inline(always)]
    fn is_wanted(&mut self, node: NodeId, _: f32) -> bool {
        self.tree.topology.points(node).end.div_ceil(GROUP) > self.next
    }

    #[inline(always)]
    fn leaf<S: Simd>(&mut self, _: S, number: usize) -> ControlFlow<()> {
        let points = self.tree.topology.points_of_leaf(number);
        let (first, end) = (points.start / GROUP, points.end.div_ceil(GROUP));
        self.found.extend((first.max(self.next)..end).map(id32));
        self.next = end;
        ControlFlow::Continue(())
    }
}

/// The first leaf that a descent visits.
struct FirstLeaf(usize);

impl PlaceVisitor for FirstLeaf {
    #[inline(always)]
    fn most_sq(&self) -> f32 {
        f32::INFINITY
    }

    #[inline(always)]
    fn leaf<S: Simd>(&mut self, _: S, number: usize) -> ControlFlow<()> {
        self.0 = number;
        ControlFlow::Break(())
    }
}
