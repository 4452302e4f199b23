//! How much a query may cost. The only clock of the libraries.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use crate::verdict::Statistics;

/// Work units between two looks at the clock, which cost 22 ns each; a unit costs 20 to 500 ns.
const UNITS_A_LOOK: u64 = 16;

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
    next_look: u64,
    /// What was spent.
    pub(crate) spent: Statistics,
}

impl Meter {
    pub(crate) fn new(budget: &Budget) -> Self {
        Self { budget: *budget, next_look: 0, spent: Statistics::default() }
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
        if let Some(deadline) = self.budget.deadline
            && units >= self.next_look
        {
            self.next_look = units + UNITS_A_LOOK;
            if deadline.is_past() {
                return ControlFlow::Break(());
            }
        }
        ControlFlow::Continue(())
    }
}
