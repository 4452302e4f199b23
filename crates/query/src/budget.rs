//! How much a query may cost. The only clock of the libraries.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use crate::verdict::Statistics;

/// Between two looks at the clock, which cost some 22 ns each, lies work of about this many node pairs, which cost
/// about 15 ns each.
const PAIRS_A_LOOK: u64 = 64;

/// An evaluation costs as much as so many node pairs.
const PAIRS_AN_EVALUATION: u64 = 64;

/// So many pairs of points cost as much as a node pair.
const POINTS_A_PAIR: u64 = 4;

/// A point in time at which to stop; absolute, so that one can span all queries of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Deadline(Instant);

impl Deadline {
    /// This long from now.
    #[must_use]
    #[expect(clippy::disallowed_methods, reason = "this module is where clocks are read")]
    pub fn within(time: Duration) -> Self {
        let now = Instant::now();
        // A time too long to represent is as good as a year.
        Self(now.checked_add(time).unwrap_or(now + Duration::from_secs(31_536_000)))
    }

    /// At this instant.
    #[must_use]
    pub const fn at(instant: Instant) -> Self {
        Self(instant)
    }

    #[expect(clippy::disallowed_methods, reason = "this module is where clocks are read")]
    fn is_past(self) -> bool {
        Instant::now() >= self.0
    }
}

/// How much a query may cost; whatever ends first ends it. The default has no limit, and reads no clock.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[non_exhaustive]
pub struct Budget {
    /// Work units: evaluations of an implicit function and node pairs. Reproducible.
    pub work: Option<u64>,
    /// When to stop. Not reproducible.
    pub deadline: Option<Deadline>,
}

impl Budget {
    /// No limit.
    pub const UNLIMITED: Self = Self { work: None, deadline: None };

    /// The same budget with this many work units.
    #[must_use]
    pub const fn with_work(self, units: u64) -> Self {
        Self { work: Some(units), ..self }
    }

    /// The same budget until `deadline`.
    #[must_use]
    pub const fn with_deadline(self, deadline: Deadline) -> Self {
        Self { deadline: Some(deadline), ..self }
    }
}

/// A budget being spent.
#[derive(Debug)]
pub(crate) struct Meter {
    budget: Budget,
    /// Leaf work so far, in node pairs.
    leaf_work: u64,
    next_look: u64,
    /// What was spent.
    pub(crate) spent: Statistics,
}

impl Meter {
    pub(crate) fn new(budget: &Budget) -> Self {
        Self { budget: *budget, leaf_work: 0, next_look: 0, spent: Statistics::default() }
    }

    /// Counts two leaves of so many points each.
    #[inline]
    pub(crate) fn leaf_pair(&mut self, a: u32, b: u32) {
        self.spent.leaf_pairs += 1;
        self.leaf_work += u64::from(a) * u64::from(b) / POINTS_A_PAIR;
    }

    /// Whether anything is left.
    #[inline]
    pub(crate) fn go_on(&mut self) -> ControlFlow<()> {
        if self.budget.work.is_none() && self.budget.deadline.is_none() {
            return ControlFlow::Continue(());
        }
        let units = self.spent.evaluations + self.spent.node_pairs;
        if self.budget.work.is_some_and(|most| units >= most) {
            return ControlFlow::Break(());
        }
        if let Some(deadline) = self.budget.deadline {
            let work = PAIRS_AN_EVALUATION * self.spent.evaluations + self.spent.node_pairs + self.leaf_work;
            if work >= self.next_look {
                self.next_look = work + PAIRS_A_LOOK;
                if deadline.is_past() {
                    return ControlFlow::Break(());
                }
            }
        }
        ControlFlow::Continue(())
    }
}
