//! The nearest pairs of leaves, by branch and bound, nearest pair of nodes first: for the nearest points by
//! boxes, for a bound from below by enclosures, both in one descent.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use nearmiss_hierarchy::{NodePair, Part};
use nearmiss_lanes::order::{ascending, from_ascending};

use crate::contact::bounds::{Limits, Motion};
use crate::pair::scan_pair::ScanPair;

/// A pair of nodes still to be looked at, and how much further away than the centres of the scans what is in
/// them is at least. Ordered so that the nearest is greatest, of equally near ones that of the nearest boxes,
/// then the first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Open {
    /// How near the enclosures are, and in the lower half the boxes, as numbers in the same order: a heap
    /// compares often.
    key: Reverse<u64>,
    pair: Reverse<NodePair>,
}

impl Open {
    #[inline]
    fn new(enclosures: f32, boxes: f32, pair: NodePair) -> Self {
        let key = u64::from(ascending(enclosures)) << 32 | u64::from(ascending(boxes));
        Self { key: Reverse(key), pair: Reverse(pair) }
    }

    #[inline]
    fn enclosures(&self) -> f32 {
        from_ascending((self.key.0 >> 32) as u32)
    }

    #[inline]
    fn boxes(&self) -> f32 {
        #[expect(clippy::cast_possible_truncation, reason = "the lower 32 bits")]
        let bits = self.key.0 as u32;
        from_ascending(bits)
    }
}

/// So many steps split the nearest pair of all, which a heap finds. Then limits are near what they will be,
/// and what was put off last comes next: some pairs more, but a heap takes longer than to look at those.
const NEAREST_FIRST: u32 = 128;

/// The pairs of nodes still to be looked at. Reused.
#[derive(Debug, Clone, Default)]
pub(crate) struct Frontier {
    heap: BinaryHeap<Open>,
    /// Before any in the heap.
    stack: Vec<Open>,
}

/// A search through pairs of nodes.
#[derive(Debug)]
pub(crate) struct Search<'s> {
    open: &'s mut Frontier,
    /// Whether enclosures are asked about too.
    of_surfaces: bool,
    /// Nothing that is so much further away than the centres of the scans is looked at for the nearest
    /// points.
    points: f32,
    /// Nor for the bound from below: some pair of leaves whose enclosures are so near was looked at.
    surfaces: f32,
    /// So many pairs were split.
    steps: u32,
}

impl<'s> Search<'s> {
    /// From the pair of the roots on; for the nearest points alone, or for the nearest enclosures of leaves
    /// as well.
    pub(crate) fn new(open: &'s mut Frontier, of_surfaces: bool, motion: &Motion) -> Self {
        open.heap.clear();
        open.stack.clear();
        open.stack.push(Open::new(motion.least(), motion.least(), NodePair::ROOTS));
        let surfaces = if of_surfaces { f32::INFINITY } else { f32::NEG_INFINITY };
        Self { open, of_surfaces, points: f32::INFINITY, surfaces, steps: 0 }
    }

    /// Points further apart than this `bound` are not looked for any more.
    pub(crate) fn found_points(&mut self, bound: f64, motion: &Motion) {
        self.points = motion.beyond(bound);
    }

    /// Bounds from below beyond this `bound` are good enough: what is no nearer is not looked at for them any
    /// more.
    pub(crate) fn is_content_with(&mut self, bound: f64, motion: &Motion) {
        if self.of_surfaces {
            self.surfaces = self.surfaces.min(motion.beyond(bound));
        }
    }

    /// How near, in a's stored frame, surfaces are at least, or points where these alone are looked for.
    /// O(open pairs).
    pub(crate) fn lower(&self, motion: &Motion) -> f64 {
        let known = if self.of_surfaces { self.surfaces } else { self.points };
        let open = self.open.heap.iter().chain(&self.open.stack);
        motion.bound(open.fold(known, |least, open| least.min(open.enclosures())))
    }

    /// What [`Self::lower`] will not exceed.
    pub(crate) fn upper(&self, motion: &Motion) -> f64 {
        motion.bound(self.surfaces)
    }

    /// Whether nothing is left to look at.
    pub(crate) fn is_over(&mut self) -> bool {
        let Frontier { heap, stack } = &mut *self.open;
        let (points, surfaces) = (self.points, self.surfaces);
        let wanted = |open: &Open| open.boxes() < points || open.enclosures() < surfaces;
        while stack.last().is_some_and(|open| !wanted(open)) {
            stack.pop();
        }
        if !stack.is_empty() {
            return false;
        }
        if self.steps >= NEAREST_FIRST {
            // A heap's array has its nearest first, more or less.
            stack.extend(heap.drain().filter(wanted));
            stack.reverse();
        }
        while heap.peek().is_some_and(|open| !wanted(open)) {
            heap.pop();
        }
        stack.is_empty() && heap.is_empty()
    }

    /// Splits the next pair of nodes; a pair of leaves whose points may be nearer than those found so far is
    /// taken off. None when the search [is over](Self::is_over), too.
    pub(crate) fn step(&mut self, pair: &mut ScanPair<'_>, motion: &Motion) -> Option<NodePair> {
        self.steps = self.steps.saturating_add(1);
        let dives = !self.open.stack.is_empty() || self.steps.is_power_of_two();
        let next = self.open.stack.pop().or_else(|| self.open.heap.pop())?;
        let (of_enclosures, of_boxes) = (next.enclosures(), next.boxes());
        if pair.which_are_leaves(next.pair.0) == [true; 2] {
            let leaves = next.pair.0;
            if of_enclosures < self.surfaces {
                let bound = bound_of_leaves(pair, motion, leaves, of_enclosures, self.surfaces);
                self.surfaces = self.surfaces.min(bound);
            }
            return (of_boxes < self.points).then_some(leaves);
        }
        let limits = Limits { boxes: self.points, enclosures: self.surfaces };
        let (pairs, gaps) = motion.split(([pair.a, pair.b], pair.part), next.pair.0, limits);
        let enclosures = if self.of_surfaces { gaps.enclosures } else { gaps.boxes };
        pair.meter.spent.node_pairs += u64::from(pairs.lanes.count_ones());
        let mut near = gaps.near;
        let mut nearest: Option<Open> = None;
        while near != 0 {
            let lane = near.trailing_zeros() as usize;
            near &= near - 1;
            // What is in its parents is no nearer than they are.
            let children = pairs.pair(lane);
            let (mut of_enclosures, mut of_boxes) =
                (enclosures[lane].max(of_enclosures), gaps.boxes[lane].max(of_boxes));
            let [is_leaf_a, is_leaf_b] = pair.which_are_leaves(children);
            if is_leaf_a != is_leaf_b {
                // The points of a loose leaf say more than its box, also of points.
                if pair.part == Part::Obstacle
                    && let Some(gap) = pair.gap_by_points(children)
                {
                    of_enclosures = of_enclosures.max(motion.no_nearer(f64::from(gap)));
                }
                of_boxes = of_boxes.max(of_enclosures);
                if of_boxes >= self.points && of_enclosures >= self.surfaces {
                    continue;
                }
            }
            let own = Open::new(of_enclosures, of_boxes, children);
            if !dives {
                self.put_off(own);
            } else if let Some(known) = nearest {
                self.put_off(known.min(own));
                nearest = Some(known.max(own));
            } else {
                nearest = Some(own);
            }
        }
        if let Some(nearest) = nearest {
            self.open.stack.push(nearest);
        }
        None
    }

    #[inline]
    fn put_off(&mut self, open: Open) {
        if self.steps < NEAREST_FIRST { self.open.heap.push(open) } else { self.open.stack.push(open) }
    }
}

/// The greater of a bound of two leaves by enclosures and that by points, if they have one, both relative to
/// the centres of the scans. A lesser bound will do that is no less than `enough`.
#[inline]
fn bound_of_leaves(
    pair: &ScanPair<'_>,
    motion: &Motion,
    leaves: NodePair,
    by_enclosures: f32,
    enough: f32,
) -> f32 {
    if pair.part == Part::Surface {
        return by_enclosures;
    }
    // The points of either and a box about the other are far quicker compared than all points of both.
    let by_boxes = motion.no_nearer(f64::from(pair.gap_of_leaf_boxes(leaves)));
    if by_boxes >= enough {
        return by_boxes;
    }
    by_enclosures.max(motion.no_nearer(f64::from(pair.gap_of_leaves(leaves))))
}
