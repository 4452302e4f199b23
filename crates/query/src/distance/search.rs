//! The nearest points of two scans, by branch and bound, nearest pair of nodes first: for the nearest points
//! by boxes, for a bound from below by enclosures, both in one descent.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::ControlFlow;

use nearmiss_hierarchy::{self as hierarchy, NodePair, PairVisitor, Part, resume};
use nearmiss_lanes::order::{ascending, from_ascending};

use crate::leaf::nearest_points::{PointPair, nearest};
use crate::pair::bounds::BoundVisitor;
use crate::pair::motion::{Limits, Motion};
use crate::pair::scan_pair::ScanPair;

type Open = hierarchy::Open<Nearness>;

/// The lower bounds of the distance of two nodes, less the distance of the scans' centres: by enclosures
/// first, then by boxes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Nearness(
    /// The enclosures, and in the lower half the boxes, as numbers in the same order: a heap compares often.
    u64,
);

impl Nearness {
    #[inline]
    fn new(enclosures: f32, boxes: f32) -> Self {
        Self(u64::from(ascending(enclosures)) << 32 | u64::from(ascending(boxes)))
    }

    #[inline]
    fn enclosures(self) -> f32 {
        from_ascending((self.0 >> 32) as u32)
    }

    #[inline]
    fn boxes(self) -> f32 {
        #[expect(clippy::cast_possible_truncation, reason = "the lower 32 bits")]
        let bits = self.0 as u32;
        from_ascending(bits)
    }
}

/// So many steps look at the nearest pair of all, which a heap finds. Then limits are near what they will be,
/// and what was put off last comes next: some pairs more, but a heap takes longer than to look at those.
const NEAREST_FIRST: u32 = 128;

/// The pairs of nodes still to be looked at. Reused.
#[derive(Debug, Clone, Default)]
pub(crate) struct Frontier {
    heap: BinaryHeap<Reverse<(Nearness, NodePair)>>,
    /// Before any in the heap.
    stack: Vec<Open>,
    /// So many pairs were looked at.
    steps: u32,
    /// Whether the nearest child of the pair that is looked at comes next.
    dives: bool,
}

impl Frontier {
    fn clear(&mut self) {
        self.heap.clear();
        self.stack.clear();
        self.steps = 0;
    }

    fn iter(&self) -> impl Iterator<Item = Nearness> {
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
            // A heap's array has its nearest first, more or less.
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

/// A search for the nearest points of two scans.
#[derive(Debug)]
pub(crate) struct Search<'a> {
    pub(crate) pair: ScanPair<'a>,
    motion: &'a Motion,
    /// The nearest points so far.
    pub(crate) best: PointPair,
    /// Whether enclosures are asked about too.
    pub(crate) of_enclosures: bool,
    /// Nothing that is so much further away than the centres of the scans is looked at for the nearest
    /// points.
    points: f32,
    /// Nor for the bound from below: some pair of leaves whose enclosures are so near was looked at.
    enclosures: f32,
    /// A bound from below that is this share of the bound from above is good enough.
    pub(crate) share: Option<f64>,
    /// Points so near each other are near enough.
    pub(crate) near_enough: f64,
    /// Whether the search stops as soon as the bound from below will be zero.
    pub(crate) stops_at_zero: bool,
}

impl<'a> Search<'a> {
    /// From the points of `best` on; for the nearest points alone, or for the nearest enclosures of leaves as
    /// well.
    pub(crate) fn new(pair: ScanPair<'a>, motion: &'a Motion, of_enclosures: bool) -> Self {
        let enclosures = if of_enclosures { f32::INFINITY } else { f32::NEG_INFINITY };
        let best = PointPair::new(&pair, [0, 0]);
        let points = motion.beyond(motion.bound_of(best.distance));
        let (share, near_enough, stops_at_zero) = (None, f64::NEG_INFINITY, false);
        Self { pair, motion, best, of_enclosures, points, enclosures, share, near_enough, stops_at_zero }
    }

    /// Looks at pairs from the roots down. Returns whether it came to its end.
    pub(crate) fn run(&mut self, open: &mut Frontier) -> ControlFlow<()> {
        open.clear();
        let key = Nearness::new(self.motion.least(), self.motion.least());
        open.stack.push(Open { pair: NodePair::ROOTS, key });
        self.pair.meter.go_on()?;
        self.go_on(open)
    }

    /// Looks at the pairs that are open.
    pub(crate) fn go_on(&mut self, open: &mut Frontier) -> ControlFlow<()> {
        let (bounds, level) = (self.pair.bounds(self.motion), self.pair.level);
        resume(&bounds, level, open, self)
    }

    /// How far surfaces are apart at least, or points where these alone are looked for, in the world. O(open
    /// pairs).
    pub(crate) fn lower(&self, open: &Frontier) -> f64 {
        let known = if self.of_enclosures { self.enclosures } else { self.points };
        self.proven(open.iter().fold(known, |least, key| least.min(key.enclosures())))
    }

    /// Whether [`Self::lower`] will be zero.
    pub(crate) fn may_touch(&self) -> bool {
        !self.of_enclosures || self.proven(self.enclosures) <= 0.0
    }

    fn proven(&self, beyond: f32) -> f64 {
        self.motion.proven(self.motion.bound(beyond))
    }

    /// The points of two leaves.
    fn compare(&mut self, leaves: NodePair, [a, b]: [usize; 2]) {
        self.pair.meter.leaf_pair(self.pair.a.leaves.points(a).len(), self.pair.b.leaves.points(b).len());
        self.best = nearest(self.pair.level, &self.pair, leaves, self.best);
        let upper = self.best.distance.max(0.0);
        self.points = self.motion.beyond(self.motion.bound_of(upper));
        if self.of_enclosures
            && let Some(share) = self.share
        {
            let enough = self.motion.beyond(self.motion.bound_of(upper * share));
            self.enclosures = self.enclosures.min(enough);
        }
    }

    /// The greater of a bound of two leaves by enclosures and that by points, if they have one, both relative
    /// to the centres of the scans. A lesser bound will do that is no less than needed.
    fn bound_of_leaves(&self, leaves: NodePair, by_enclosures: f32) -> f32 {
        if self.pair.part == Part::Surface {
            return by_enclosures;
        }
        // The points of either and a box about the other are far quicker compared than all points of both.
        let by_boxes = self.motion.no_nearer(f64::from(self.pair.gap_of_leaf_boxes(leaves)));
        if by_boxes >= self.enclosures {
            return by_boxes;
        }
        by_enclosures.max(self.motion.no_nearer(f64::from(self.pair.gap_of_leaves(leaves))))
    }
}

impl PairVisitor<Nearness> for Search<'_> {
    #[inline]
    fn compared(&mut self, pairs: u32) -> ControlFlow<()> {
        self.pair.meter.spent.node_pairs += u64::from(pairs);
        self.pair.meter.go_on()
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
        self.pair.meter.go_on()
    }
}

impl BoundVisitor<Nearness> for Search<'_> {
    #[inline]
    fn limits(&self) -> Limits {
        Limits { boxes: self.points, enclosures: self.enclosures }
    }

    #[inline(always)]
    fn key(&mut self, above: &Open, pair: NodePair, boxes: f32, enclosures: f32) -> Option<Nearness> {
        let enclosures = if self.of_enclosures { enclosures } else { boxes };
        // What is in its parents is no nearer than they are.
        let (mut enclosures, mut boxes) =
            (enclosures.max(above.key.enclosures()), boxes.max(above.key.boxes()));
        let [is_leaf_a, is_leaf_b] = self.pair.which_are_leaves(pair);
        if is_leaf_a != is_leaf_b {
            // The points of a loose leaf say more than its box, also of points.
            if self.pair.part == Part::Obstacle
                && let Some(gap) = self.pair.gap_by_points(pair)
            {
                enclosures = enclosures.max(self.motion.no_nearer(f64::from(gap)));
            }
            boxes = boxes.max(enclosures);
            if boxes >= self.points && enclosures >= self.enclosures {
                return None;
            }
        }
        Some(Nearness::new(enclosures, boxes))
    }
}
