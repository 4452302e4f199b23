//! Building a tree, and building parts of it again.

use nearmiss_lanes::id32;

use crate::counts::Counts;
use crate::error::KineticError;
use crate::nodes::{DIRTY, FRESH, Nodes, ROOT};
use crate::plan::{FlightPlan, seconds};
use crate::points::{MOST, Points};
use crate::primitives::Primitives;
use crate::tree::KineticTree;

/// The most points of a primitive.
pub(crate) const MOST_CORNERS: usize = 1024;

/// Primitives of a leaf. Smaller leaves make more nodes, larger ones more comparisons at each event.
const LEAF_SIZE: usize = 4;

/// A primitive and its centre.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Item {
    primitive: u32,
    centre: [f64; 3],
}

/// Returns the most primitives of a leaf. Those with many points have a leaf each.
const fn leaf_size(arity: usize) -> usize {
    if arity <= 4 { LEAF_SIZE } else { 1 }
}

impl KineticTree {
    /// Builds a tree over moving points, each of them a primitive, with the clock at `start`.
    /// Point i is primitive i.
    ///
    /// Costs O(n log n): the points are halved at medians of their positions at `start`.
    ///
    /// # Errors
    /// [`KineticError::Number`] if `start` is not finite, [`KineticError::TooMany`] for 2³¹ points.
    pub fn of_points(start: f64, plans: impl IntoIterator<Item = FlightPlan>) -> Result<Self, KineticError> {
        let mut tree = Self::without_primitives(start, plans, 1)?;
        for point in 0..tree.points.slots.len() {
            tree.primitives.add(&[id32(point)]);
        }
        tree.build();
        Ok(tree)
    }

    /// Builds a tree over primitives, which index moving points, with the clock at `start`. They
    /// may have different numbers of points. Primitives inserted later may have as many points as
    /// the largest of these; without any, up to three.
    ///
    /// A Bézier patch is the list of its control points. So is a rational patch, if its weights are
    /// positive.
    ///
    /// # Errors
    /// [`KineticError::Number`] if `start` is not finite, [`KineticError::Arity`] for a primitive
    /// with no or more than 1024 points, [`KineticError::NoSuchPoint`] for an index out of range,
    /// [`KineticError::TooMany`] for 2³¹ points or corners.
    pub fn new<P: AsRef<[u32]>>(
        start: f64,
        plans: impl IntoIterator<Item = FlightPlan>,
        primitives: &[P],
    ) -> Result<Self, KineticError> {
        let arity = primitives.iter().map(|points| points.as_ref().len()).max().unwrap_or(3);
        if arity == 0 || arity > MOST_CORNERS {
            return Err(KineticError::Arity { found: arity, most: MOST_CORNERS });
        }
        let mut tree = Self::without_primitives(start, plans, arity)?;
        for points in primitives {
            tree.check_primitive(points.as_ref())?;
            tree.primitives.add(points.as_ref());
        }
        tree.build();
        Ok(tree)
    }

    fn without_primitives(
        start: f64,
        plans: impl IntoIterator<Item = FlightPlan>,
        arity: usize,
    ) -> Result<Self, KineticError> {
        let clock = seconds(start)?;
        let mut points = Points::default();
        for plan in plans {
            points.add(plan, clock)?;
        }
        Ok(Self {
            clock,
            points,
            primitives: Primitives::new(arity),
            nodes: Nodes::new(leaf_size(arity), arity),
            counts: Counts::default(),
            edits: 0,
            changes: None,
            states: Vec::new(),
        })
    }

    /// Returns an error if these cannot be the points of a new primitive.
    pub(crate) fn check_primitive(&self, points: &[u32]) -> Result<(), KineticError> {
        let most = self.primitives.arity;
        if points.is_empty() || points.len() > most {
            return Err(KineticError::Arity { found: points.len(), most });
        }
        if (self.primitives.slots() + 1) * most > MOST {
            return Err(KineticError::TooMany);
        }
        points.iter().try_for_each(|&point| self.check_point(point))
    }

    fn build(&mut self) {
        let all: Vec<u32> = (0..id32(self.primitives.slots())).collect();
        self.grow(ROOT, &all);
        let mut order = Vec::with_capacity(all.len());
        self.nodes.list(ROOT, &mut order);
        self.points.arrange(order.iter().flat_map(|&primitive| self.primitives.points(primitive)).copied());
        self.refresh();
        self.counts = Counts::default();
    }

    /// Makes a new subtree of `primitives` at `at`, which must be a leaf without a block, and marks
    /// its nodes to be refreshed.
    pub(crate) fn grow(&mut self, at: u32, primitives: &[u32]) {
        let share = 1.0 / self.primitives.arity as f64;
        let centre = |&primitive: &u32| {
            let mut centre = [0.0; 3];
            for &point in self.primitives.points(primitive) {
                let place = self.points.position(point, self.clock);
                centre = [0, 1, 2].map(|k| centre[k] + share * place[k]);
            }
            Item { primitive, centre }
        };
        let mut items: Vec<Item> = primitives.iter().map(centre).collect();
        self.grow_items(at, &mut items);
    }

    fn grow_items(&mut self, at: u32, items: &mut [Item]) {
        self.counts.rebuilt += 1;
        self.nodes.link_mut(at).size = id32(items.len());
        self.nodes.get_mut(at).flags |= FRESH | DIRTY;
        if items.len() <= self.nodes.leaf_size {
            return self.fill(at, items);
        }
        let mut extent = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
        for item in &*items {
            for k in 0..3 {
                extent[k] = [extent[k][0].min(item.centre[k]), extent[k][1].max(item.centre[k])];
            }
        }
        let length = extent.map(|[least, greatest]| greatest - least);
        let axis = (1..3).fold(0, |a, b| if length[b] > length[a] { b } else { a });
        // Leaves are full but for one.
        let half = (items.len() / 2).next_multiple_of(self.nodes.leaf_size);
        items.select_nth_unstable_by(half, |a, b| {
            a.centre[axis].total_cmp(&b.centre[axis]).then(a.primitive.cmp(&b.primitive))
        });
        let children = self.nodes.split(at);
        let (left, right) = items.split_at_mut(half);
        self.grow_items(children, left);
        self.grow_items(children + 1, right);
    }

    /// Puts `items` into a leaf.
    fn fill(&mut self, leaf: u32, items: &mut [Item]) {
        items.sort_unstable_by_key(|item| item.primitive);
        let start = self.nodes.block_of(leaf) as usize * self.nodes.leaf_size;
        for (i, item) in items.iter().enumerate() {
            self.nodes.primitives[start + i] = item.primitive;
            self.primitives.leaves[item.primitive as usize] = leaf;
        }
    }
}
