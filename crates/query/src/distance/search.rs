//! The search for the nearest points of two scans: branch and bound, nearest pair of nodes first.
//! One descent finds both the nearest points, by boxes, and a lower bound, by enclosures.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::ControlFlow;

use nearmiss_hierarchy::{self as hierarchy, NodePair, PairVisitor, Part, resume};
use nearmiss_lanes::order::{ascending, from_ascending};

use crate::pair::bounds::BoundVisitor;
use crate::pair::pairing::{ItemPair, Pairing};
use crate::pair::relative_pose::{Limits, RelativePose};

type Open = hierarchy::Open<Nearness>;

/// The lower bounds on the distance of two nodes, minus the distance of the scans' centres. Ordered
/// by the enclosures first, then by the boxes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Nearness(
    /// The bound of the enclosures in the upper half and of the boxes in the lower half, as
    /// integers in the same order, which a heap compares quickly.
    u64,
);

impl Nearness {
    #[inline]
    pub(crate) fn new(enclosures: f32, boxes: f32) -> Self {
        Self(u64::from(ascending(enclosures)) << 32 | u64::from(ascending(boxes)))
    }

    #[inline]
    pub(crate) fn enclosures(self) -> f32 {
        from_ascending((self.0 >> 32) as u32)
    }

    #[inline]
    fn boxes(self) -> f32 {
        #[expect(clippy::cast_possible_truncation, reason = "the lower 32 bits")]
        let bits = self.0 as u32;
        from_ascending(bits)
    }
}

/// The number of steps that visit the nearest of all pairs, found by a heap. After these steps the
/// limits are near their final values. Then the pair that was postponed last is visited next. That
/// visits some more pairs, but it takes less time than a heap.
const NEAREST_FIRST: u32 = 128;

/// Reusable memory for the open node pairs.
#[derive(Debug, Clone, Default)]
pub(crate) struct Frontier {
    heap: BinaryHeap<Reverse<(Nearness, NodePair)>>,
    /// Pairs that are visited before any in the heap.
    stack: Vec<Open>,
    /// The number of pairs visited.
    steps: u32,
    /// `true` if the nearest child of the current pair comes next.
    dives: bool,
}

impl Frontier {
    /// Removes all pairs, and adds the pair of the roots.
    pub(crate) fn start(&mut self, key: Nearness) {
        self.heap.clear();
        self.stack.clear();
        self.steps = 0;
        self.stack.push(Open { pair: NodePair::ROOTS, key });
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = Nearness> {
        self.heap.iter().map(|open| open.0.0).chain(self.stack.iter().map(|open| open.key))
    }
}

impl hierarchy::Frontier<Nearness> for Frontier {
    #[inline]
    fn push(&mut self, open: Open) {
        if self.steps < NEAREST_FIRST {
            self.heap.push(Reverse((open.key, open.pair)));
        } else {
            self.stack.push(open);
        }
    }

    #[inline]
    fn pop(&mut self) -> Option<Open> {
        let next = |Reverse((key, pair))| Open { pair, key };
        self.steps = self.steps.saturating_add(1);
        if self.stack.is_empty() && self.steps > NEAREST_FIRST {
            // The array of a heap is roughly in order, nearest first.
            self.stack.extend(self.heap.drain().map(next));
            self.stack.reverse();
        }
        self.dives = !self.stack.is_empty() || self.steps.is_power_of_two();
        self.stack.pop().or_else(|| self.heap.pop().map(next))
    }

    #[inline]
    fn push_last(&mut self, open: Open) -> Option<Open> {
        if self.dives {
            self.stack.push(open)
        } else {
            self.push(open)
        }
        None
    }
}

/// A search for the nearest items of two things: points, or triangles.
#[derive(Debug)]
pub(crate) struct Search<'m, P> {
    pub(crate) pair: P,
    relative_pose: &'m RelativePose,
    /// The nearest items so far.
    pub(crate) best: ItemPair,
    /// `true` if the enclosures are compared, too.
    pub(crate) of_enclosures: bool,
    /// Pairs whose boxes exceed the distance of the scans' centres by this much cannot improve the
    /// nearest points.
    points: f32,
    /// The same limit for enclosures and the lower bound: the smallest bound of any leaf pair so
    /// far.
    enclosures: f32,
    /// A lower bound of this share of the upper bound is sufficient.
    pub(crate) share: Option<f64>,
    /// The search stops at points within this distance.
    pub(crate) near_enough: f64,
    /// `true` if the search stops as soon as the lower bound must become zero.
    pub(crate) stops_at_zero: bool,
}

impl<'m, P: Pairing> Search<'m, P> {
    /// A search that starts from the items `start`, for the nearest items and, if `of_enclosures`,
    /// the nearest enclosures of leaves.
    pub(crate) fn new(
        pair: P,
        relative_pose: &'m RelativePose,
        start: [usize; 2],
        of_enclosures: bool,
    ) -> Self {
        let enclosures = if of_enclosures { f32::INFINITY } else { f32::NEG_INFINITY };
        let best = pair.items(start);
        let points = relative_pose.beyond(relative_pose.bound_of(best.distance));
        let (share, near_enough, stops_at_zero) = (None, f64::NEG_INFINITY, false);
        Self {
            pair,
            relative_pose,
            best,
            of_enclosures,
            points,
            enclosures,
            share,
            near_enough,
            stops_at_zero,
        }
    }

    /// Searches from the roots down. Breaks if the search was ended early.
    pub(crate) fn run(&mut self, open: &mut Frontier) -> ControlFlow<()> {
        open.start(Nearness::new(self.relative_pose.least(), self.relative_pose.least()));
        self.pair.meter().go_on()?;
        self.go_on(open)
    }

    /// Searches the open pairs.
    pub(crate) fn go_on(&mut self, open: &mut Frontier) -> ControlFlow<()> {
        let (bounds, level) = (self.pair.bounds(self.relative_pose), self.pair.level());
        resume(&bounds, level, open, self)
    }

    /// A lower bound of the distance of the surfaces in the world, or of the points if only those
    /// are compared. O(open pairs).
    pub(crate) fn lower(&self, open: &Frontier) -> f64 {
        let known = if self.of_enclosures { self.enclosures } else { self.points };
        self.proven(open.iter().fold(known, |least, key| least.min(key.enclosures())))
    }

    /// Returns `true` if [`Self::lower`] will be zero.
    pub(crate) fn may_touch(&self) -> bool {
        !self.of_enclosures || self.proven(self.enclosures) <= 0.0
    }

    fn proven(&self, beyond: f32) -> f64 {
        self.relative_pose.proven(self.relative_pose.bound(beyond))
    }

    /// Compares the points of two leaves and updates the limits.
    fn compare(&mut self, leaves: NodePair, numbers: [usize; 2]) {
        self.pair.count_leaves(numbers);
        self.best = self.pair.nearest(leaves, self.best);
        let upper = self.best.distance.max(0.0);
        self.points = self.relative_pose.beyond(self.relative_pose.bound_of(upper));
        if self.of_enclosures
            && let Some(share) = self.share
        {
            let enough = self.relative_pose.beyond(self.relative_pose.bound_of(upper * share));
            self.enclosures = self.enclosures.min(enough);
        }
    }

    /// The greater bound of two leaves, by enclosures or by points, relative to the distance of the
    /// scans' centres. Returns a smaller bound early if that suffices.
    fn bound_of_leaves(&self, leaves: NodePair, by_enclosures: f32) -> f32 {
        if self.pair.part() == Part::Surface {
            return by_enclosures;
        }
        // Comparing the points of each leaf with the box of the other is much faster than comparing
        // all points.
        let by_boxes = self.relative_pose.no_nearer(f64::from(self.pair.gap_of_leaf_boxes(leaves)));
        if by_boxes >= self.enclosures {
            return by_boxes;
        }
        #[expect(clippy::cast_possible_truncation, reason = "rounded up")]
        let most = (self.relative_pose.bound(self.enclosures) as f32).next_up();
        by_enclosures.max(self.relative_pose.no_nearer(f64::from(self.pair.gap_of_leaves(leaves, most))))
    }
}

impl<P: Pairing> PairVisitor<Nearness> for Search<'_, P> {
    #[inline]
    fn compared(&mut self, pairs: u32) -> ControlFlow<()> {
        let meter = self.pair.meter();
        meter.spent.node_pairs += u64::from(pairs);
        meter.go_on()
    }

    #[inline]
    fn is_wanted(&mut self, open: &Open) -> bool {
        open.key.boxes() < self.points || open.key.enclosures() < self.enclosures
    }

    fn leaf_pair(&mut self, leaves: [usize; 2], open: &Open) -> ControlFlow<()> {
        let (enclosures, boxes) = (open.key.enclosures(), open.key.boxes());
        if enclosures < self.enclosures {
            self.enclosures = self.enclosures.min(self.bound_of_leaves(open.pair, enclosures));
        }
        if boxes < self.points {
            self.compare(open.pair, leaves);
        }
        if self.best.distance <= self.near_enough || self.stops_at_zero && self.may_touch() {
            return ControlFlow::Break(());
        }
        self.pair.meter().go_on()
    }
}

impl<P: Pairing> BoundVisitor<Nearness> for Search<'_, P> {
    #[inline]
    fn limits(&self) -> Limits {
        Limits { boxes: self.points, enclosures: self.enclosures }
    }

    #[inline(always)]
    fn key(&mut self, above: &Open, pair: NodePair, boxes: f32, enclosures: f32) -> Option<Nearness> {
        let enclosures = if self.of_enclosures { enclosures } else { boxes };
        // A pair is no nearer than its parents.
        let (mut enclosures, mut boxes) =
            (enclosures.max(above.key.enclosures()), boxes.max(above.key.boxes()));
        let [is_leaf_a, is_leaf_b] = self.pair.which_are_leaves(pair);
        if is_leaf_a != is_leaf_b {
            // The points of a loose leaf give a better bound than its box, for the nearest points
            // as well.
            if self.pair.part() == Part::Obstacle
                && let Some(gap) = self.pair.gap_by_points(pair)
            {
                enclosures = enclosures.max(self.relative_pose.no_nearer(f64::from(gap)));
            }
            boxes = boxes.max(enclosures);
            if boxes >= self.points && enclosures >= self.enclosures {
                return None;
            }
        }
        Some(Nearness::new(enclosures, boxes))
    }
}
