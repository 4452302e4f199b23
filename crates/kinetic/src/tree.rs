//! `KineticTree`: a hierarchy of boxes over moving points that is valid at every time.

use nearmiss_geometry::Aabb;

use crate::counts::Counts;
use crate::error::KineticError;
use crate::motion::State;
use crate::nodes::{Nodes, ROOT};
use crate::plan::FlightPlan;
use crate::points::{Points, Side};
use crate::primitives::{NONE, Primitives};

/// A kinetic hierarchy of axis-aligned boxes (Zachmann & Weller 2006).
///
/// Each node stores the indices of the points that determine its box, one a side, and a
/// certificate a side: the time until which that point stays extremal. [`advance`](Self::advance)
/// processes the events at which certificates fail, and only those. So boxes are valid at every
/// time, and the work does not depend on how often they are queried.
///
/// Primitives are points, triangles, or patches given by their control points: anything within the
/// convex hull of some points of the tree, such as Bézier patches, and rational ones with positive
/// weights. Points may get other plans, and points and primitives may come and go, at any time. The
/// height stays O(log n).
///
/// A box is the extremal points' positions at the clock. It differs from the true one by rounding
/// of positions, and of times of events, only. Results depend on the calls alone, not on the machine
/// or on threads.
#[derive(Debug, Clone)]
pub struct KineticTree {
    pub(crate) clock: f64,
    pub(crate) points: Points,
    pub(crate) primitives: Primitives,
    pub(crate) nodes: Nodes,
    pub(crate) counts: Counts,
    /// Changes of the tree other than by time; a separation list starts again after one.
    pub(crate) edits: u64,
    /// The sides of nodes whose extremal points, or their plans, changed, if a separation list
    /// wants to know.
    pub(crate) changes: Option<Vec<(u32, u8)>>,
    /// The points of a leaf that is refreshed; empty otherwise.
    pub(crate) states: Vec<(u32, State)>,
}

impl KineticTree {
    /// Returns the time of the tree, in seconds.
    #[must_use]
    pub const fn clock(&self) -> f64 {
        self.clock
    }

    /// Returns the number of primitives.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.primitives.len()
    }

    /// Returns `true` if there is no primitive.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the number of points, whether a primitive uses them or not.
    #[must_use]
    pub const fn point_count(&self) -> usize {
        self.points.slots.len() - self.points.free.len()
    }

    /// Returns the work done since the tree was built.
    #[must_use]
    pub const fn counts(&self) -> Counts {
        self.counts
    }

    /// Returns the number of nodes. Each has six certificates.
    #[must_use]
    pub const fn node_count(&self) -> usize {
        self.nodes.len()
    }

    /// Returns the number of nodes on the longest way from the root to a leaf. Visits all nodes.
    #[must_use]
    pub fn height(&self) -> usize {
        self.height_below(ROOT)
    }

    fn height_below(&self, at: u32) -> usize {
        let node = self.nodes.link(at);
        if node.is_leaf() {
            return 1;
        }
        1 + self.height_below(node.children).max(self.height_below(node.children + 1))
    }

    /// Returns the bytes of memory in use.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.points.bytes() + self.primitives.bytes() + self.nodes.bytes()
    }

    /// Returns the number of certificates that a point takes part in: six in each leaf that has it,
    /// and one for each side of a node above with a child of which it is extremal.
    #[must_use]
    pub fn certificates_of(&self, point: u32) -> usize {
        let mut count = 0;
        let Some(&slot) = self.points.slots.get(point as usize) else { return 0 };
        let mut leaves: Vec<u32> =
            self.primitives.of(point).map(|p| self.primitives.leaves[p as usize]).collect();
        leaves.sort_unstable();
        leaves.dedup();
        for leaf in leaves {
            let mut at = leaf;
            count += 6;
            while self.nodes.link(at).parent != NONE {
                count += self.nodes.get(at).winners.iter().filter(|&&winner| winner == slot).count();
                at = self.nodes.link(at).parent;
            }
        }
        count
    }

    /// Returns the box of all primitives now; [`Aabb::EMPTY`] for an empty tree.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.node_box(ROOT)
    }

    /// Calls `visit` with the box of every node now, the primitives below it in no particular
    /// order, from the leaves up.
    pub fn for_each_node(&self, mut visit: impl FnMut(&Aabb, &[u32])) {
        self.visit_below(ROOT, &mut Vec::new(), &mut visit);
    }

    fn visit_below(&self, at: u32, found: &mut Vec<u32>, visit: &mut impl FnMut(&Aabb, &[u32])) {
        let (node, start) = (self.nodes.link(at), found.len());
        if node.is_leaf() {
            found.extend_from_slice(self.nodes.primitives_of(at));
        } else {
            self.visit_below(node.children, found, visit);
            self.visit_below(node.children + 1, found, visit);
        }
        visit(&self.node_box(at), &found[start..]);
    }

    /// Returns the box of a primitive now; `None` if there is no such primitive.
    #[must_use]
    pub fn primitive_bounds(&self, primitive: u32) -> Option<Aabb> {
        let places = self.primitive(primitive)?.iter().map(|&point| self.points.position(point, self.clock));
        Some(Aabb::of(places))
    }

    /// Returns the points of a primitive; `None` if there is no such primitive. A primitive with
    /// fewer points than others repeats its last one.
    #[must_use]
    pub fn primitive(&self, primitive: u32) -> Option<&[u32]> {
        self.primitives.has(primitive).then(|| self.primitives.points(primitive))
    }

    /// Returns the position of a point now; `None` if there is no such point.
    #[must_use]
    pub fn position(&self, point: u32) -> Option<[f64; 3]> {
        self.has_point(point).then(|| self.points.position(point, self.clock))
    }

    /// Returns the position of a point at another time in its present leg; `None` if there is no
    /// such point. It is there at that time if no leg of its plan starts in between.
    #[must_use]
    pub fn position_at(&self, point: u32, time: f64) -> Option<[f64; 3]> {
        self.has_point(point).then(|| self.points.position(point, time))
    }

    /// Returns the plan of a point from its present leg on; `None` if there is no such point.
    #[must_use]
    pub fn plan(&self, point: u32) -> Option<FlightPlan> {
        self.has_point(point).then(|| self.points.plan(point))
    }

    pub(crate) fn has_point(&self, point: u32) -> bool {
        self.points.has(point)
    }

    pub(crate) fn check_point(&self, point: u32) -> Result<(), KineticError> {
        if self.has_point(point) { Ok(()) } else { Err(KineticError::NoSuchPoint { point }) }
    }

    /// Returns the box of a node now.
    #[inline]
    pub(crate) fn node_box(&self, at: u32) -> Aabb {
        let winners = &self.nodes.get(at).winners;
        if winners[0] == NONE {
            return Aabb::EMPTY;
        }
        let place = |side: Side| {
            let course = &self.points.courses[side % 3][winners[side] as usize];
            course.position(self.clock)
        };
        Aabb { min: [place(0), place(1), place(2)], max: [place(3), place(4), place(5)] }
    }

    /// Returns the time of the next event or leg; infinite if none is due.
    #[inline]
    pub(crate) fn next_time(&self) -> f64 {
        let knot = self.points.knots.first().map_or(f64::INFINITY, |(time, _)| time);
        self.nodes.link(ROOT).first.min(knot)
    }

    /// Returns the time of the next event, or of the next leg of a plan; `None` if boxes will be
    /// determined by the same points for ever.
    #[must_use]
    pub fn next_event(&self) -> Option<f64> {
        let time = self.next_time();
        (time < f64::INFINITY).then_some(time)
    }
}
