//! A budget being spent.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use crate::ask::answer::Statistics;
use crate::ask::budget::{Budget, Deadline, now};
use crate::pair::placed::Placed;

/// Between two looks at the clock, which cost some 22 ns each, lies work of about this many node pairs, which
/// cost about 15 ns each.
const PAIRS_A_LOOK: u64 = 64;

/// An evaluation costs as much as so many node pairs.
const PAIRS_AN_EVALUATION: u64 = 64;

/// So many pairs of points cost as much as a node pair.
pub(crate) const POINTS_A_PAIR: u64 = 4;

/// A query without a budget of work is ended after so many leaf pairs for each leaf of either scan. Boxes
/// that lie could otherwise make it compare each leaf with each. Solid noise of 400,000 points in the middle
/// of other such noise takes 19, surfaces on each other 5; 100,000 points are ended within a second or so
/// (docs/decisions).
const LEAF_PAIRS_A_LEAF: u64 = 128;

/// Node pairs that lead to a leaf pair: two to eight where boxes overlap much.
pub(crate) const NODE_PAIRS_A_LEAF_PAIR: u64 = 4;

/// A budget being spent.
#[derive(Debug)]
pub(crate) struct Meter {
    /// Work units that may be spent.
    most_units: u64,
    /// All work, leaf work included, that may be done, in node pairs.
    most_work: u64,
    deadline: Option<Deadline>,
    /// Leaf work so far, in node pairs.
    leaf_work: u64,
    /// At this much work something has to be looked at.
    next_look: u64,
    /// Below so many node pairs nothing has, if nothing else was done since this was set.
    free_until: u64,
    /// When the clock was looked at last, and the longest time that it was not.
    looked: Option<Instant>,
    pub(crate) longest_stretch: Duration,
    /// What was spent.
    pub(crate) spent: Statistics,
}

impl Meter {
    /// For two scans and so many evaluations for two leaves.
    pub(crate) fn new(budget: &Budget, views: [&Placed<'_>; 2], evaluations: u64) -> Self {
        let leaves = views.map(|view| view.scan().topology().leaves() as u64);
        let points = views.map(|view| u64::from(view.scan().leaf_size()));
        let leaf_pair = points[0] * points[1] / POINTS_A_PAIR
            + NODE_PAIRS_A_LEAF_PAIR
            + PAIRS_AN_EVALUATION * evaluations;
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

    /// The same after this was spent.
    pub(crate) fn after(self, spent: Statistics) -> Self {
        Self { spent, ..self }
    }

    /// Counts what another search has spent.
    pub(crate) fn spend(&mut self, spent: &Statistics) {
        self.spent.evaluations += spent.evaluations;
        self.spent.node_pairs += spent.node_pairs;
        self.spent.leaf_pairs += spent.leaf_pairs;
        self.free_until = 0;
    }

    /// Counts two leaves of so many points each.
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

    /// Counts leaf work that costs as much as so many node pairs.
    #[inline]
    pub(crate) fn leaf_work(&mut self, pairs: u64) {
        self.leaf_work += pairs;
        self.free_until = 0;
    }

    /// Whether anything is left. Once nothing is, nothing ever will be.
    #[inline]
    pub(crate) fn go_on(&mut self) -> ControlFlow<()> {
        if self.spent.node_pairs < self.free_until { ControlFlow::Continue(()) } else { self.count() }
    }

    /// Counts everything together.
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
            // Whoever asks again looks again.
            self.next_look = 0;
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    }
}
