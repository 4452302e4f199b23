//! The spending of a budget.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use crate::ask::answer::Statistics;
use crate::ask::budget::{Budget, Deadline, now};
use crate::pair::placed::Placed;

/// Work between two reads of the clock, in node pairs. A read costs about 22 ns, a node pair about
/// 15 ns.
const PAIRS_A_LOOK: u64 = 64;

/// The cost of an evaluation, in node pairs.
const PAIRS_AN_EVALUATION: u64 = 64;

/// The number of point pairs that cost as much as one node pair.
pub(crate) const POINTS_A_PAIR: u64 = 4;

/// The limit of leaf pairs per leaf of both scans for a query without a work budget. A damaged file
/// whose boxes all overlap could otherwise make it compare every leaf with every other. Solid noise
/// of 400,000 points inside other such noise takes 19, coincident surfaces 5; for 100,000 points
/// the limit is reached within about a second (docs/decisions).
const LEAF_PAIRS_A_LEAF: u64 = 128;

/// Node pairs per leaf pair: two to eight where boxes overlap much.
pub(crate) const NODE_PAIRS_A_LEAF_PAIR: u64 = 4;

/// A budget and what was spent of it.
#[derive(Debug)]
pub(crate) struct Meter {
    /// The limit of work units.
    most_units: u64,
    /// The limit of all work, leaf work included, in node pairs.
    most_work: u64,
    deadline: Option<Deadline>,
    /// Leaf work so far, in node pairs.
    leaf_work: u64,
    /// The total work at which the clock or the work limit is checked next.
    next_look: u64,
    /// While fewer node pairs than this are counted, no limit can be reached. Any other work that
    /// is counted sets it to 0.
    free_until: u64,
    /// The time of the last clock read.
    looked: Option<Instant>,
    pub(crate) longest_stretch: Duration,
    /// The cost so far.
    pub(crate) spent: Statistics,
}

impl Meter {
    /// A meter for two scans whose leaf pairs cost `evaluations` evaluations each.
    pub(crate) fn new(budget: &Budget, views: [&Placed<'_>; 2], evaluations: u64) -> Self {
        let leaves = views.map(|view| view.scan().topology().leaves() as u64);
        let points = views.map(|view| u64::from(view.scan().leaf_size()));
        let leaf_pair = points[0] * points[1] / POINTS_A_PAIR
            + NODE_PAIRS_A_LEAF_PAIR
            + PAIRS_AN_EVALUATION * evaluations;
        Self::of_leaves(budget, leaves, leaf_pair)
    }

    /// A meter for two trees with these numbers of leaves, whose leaf pairs cost as much as
    /// `leaf_pair` node pairs each.
    pub(crate) fn of_leaves(budget: &Budget, leaves: [u64; 2], leaf_pair: u64) -> Self {
        let sane = (LEAF_PAIRS_A_LEAF * (leaves[0] + leaves[1])).saturating_mul(leaf_pair);
        let most_work = if budget.work.is_some() { u64::MAX } else { sane };
        Self {
            most_units: budget.work.unwrap_or(u64::MAX),
            most_work,
            deadline: budget.deadline,
            leaf_work: 0,
            next_look: if budget.deadline.is_some() { 0 } else { most_work },
            free_until: 0,
            looked: None,
            longest_stretch: Duration::ZERO,
            spent: Statistics::default(),
        }
    }

    /// The same meter with `spent` as its count so far.
    pub(crate) fn after(self, spent: Statistics) -> Self {
        Self { spent, ..self }
    }

    /// Adds what another search has spent.
    pub(crate) fn spend(&mut self, spent: &Statistics) {
        self.spent.evaluations += spent.evaluations;
        self.spent.node_pairs += spent.node_pairs;
        self.spent.leaf_pairs += spent.leaf_pairs;
        self.free_until = 0;
    }

    /// Counts a pair of leaves with `a` and `b` points.
    #[inline]
    pub(crate) fn leaf_pair(&mut self, a: usize, b: usize) {
        self.spent.leaf_pairs += 1;
        self.leaf_work((a * b) as u64 / POINTS_A_PAIR);
    }

    /// Counts evaluations of an implicit function.
    #[inline]
    pub(crate) fn evaluated(&mut self, times: u64) {
        self.spent.evaluations += times;
        self.free_until = 0;
    }

    /// Counts leaf work that costs as much as `pairs` node pairs.
    #[inline]
    pub(crate) fn leaf_work(&mut self, pairs: u64) {
        self.leaf_work += pairs;
        self.free_until = 0;
    }

    /// Breaks once the budget is spent, and always from then on.
    #[inline]
    pub(crate) fn go_on(&mut self) -> ControlFlow<()> {
        if self.spent.node_pairs < self.free_until { ControlFlow::Continue(()) } else { self.count() }
    }

    /// Adds up all work and checks the limits.
    fn count(&mut self) -> ControlFlow<()> {
        let Statistics { evaluations, node_pairs, .. } = self.spent;
        let units = evaluations + node_pairs;
        if units >= self.most_units {
            return ControlFlow::Break(());
        }
        let work = PAIRS_AN_EVALUATION * evaluations + node_pairs + self.leaf_work;
        if work >= self.next_look {
            self.look(work)?;
        }
        self.free_until = node_pairs + (self.most_units - units).min(self.next_look - work);
        ControlFlow::Continue(())
    }

    #[cold]
    fn look(&mut self, work: u64) -> ControlFlow<()> {
        self.next_look = self.most_work.min(work.saturating_add(PAIRS_A_LOOK));
        let mut is_past = false;
        if let Some(Deadline(end)) = self.deadline {
            let now = now();
            is_past = now >= end;
            let stretch = self.looked.map_or(Duration::ZERO, |then| now.saturating_duration_since(then));
            self.longest_stretch = self.longest_stretch.max(stretch);
            self.looked = Some(now);
        }
        if is_past || work >= self.most_work {
            // The next call checks again.
            self.next_look = 0;
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    }
}
