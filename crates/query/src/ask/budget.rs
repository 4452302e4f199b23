//! Limits on the cost of a query. The only module of the libraries that reads a clock.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

/// A point in time at which to stop. Absolute, so that one deadline can span all queries of a
/// frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Deadline(pub(crate) Instant);

impl Deadline {
    /// Returns the deadline `time` from now.
    #[must_use]
    pub fn within(time: Duration) -> Self {
        let now = now();
        // A time too long to represent is replaced by a year.
        Self(now.checked_add(time).unwrap_or(now + Duration::from_secs(31_536_000)))
    }

    /// Returns the deadline at `instant`.
    #[must_use]
    pub const fn at(instant: Instant) -> Self {
        Self(instant)
    }
}

/// Reads the clock.
#[expect(clippy::disallowed_methods, reason = "this module is where clocks are read")]
pub(crate) fn now() -> Instant {
    Instant::now()
}

/// Limits on the cost of a query, which stops at the first limit it reaches. The default has a
/// single limit, and reads no clock.
///
/// That limit keeps a damaged file, whose boxes all overlap, from occupying a query for hours.
/// Without `work`, a query ends undecided after about 128 leaf pairs per leaf of the two scans,
/// seven times the need of the worst valid scans that were tested. Only
/// [`Semantics::Thickened`](crate::Semantics) with a radius of many spacings can reach it, for
/// large parallel sheets that are just too far apart to touch. `with_work(u64::MAX)` removes the
/// limit.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[non_exhaustive]
pub struct Budget {
    /// The limit of work units: evaluations of an implicit function plus node pairs. Reproducible.
    /// `None`: the limit that no valid scans need.
    pub work: Option<u64>,
    /// The time at which to stop. Not reproducible.
    pub deadline: Option<Deadline>,
    /// The finest resolution, a length in the world. A node whose samples cover its surface within
    /// this length is compared by its samples instead of its children (Klein & Zachmann 2004, §1).
    /// Reproducible; the evidence is then estimated. `None`: compare all points.
    pub resolution: Option<f64>,
}

impl Budget {
    /// Full resolution, with no limit except the one for damaged files.
    pub const UNLIMITED: Self = Self { work: None, deadline: None, resolution: None };

    /// The same budget with a limit of `units` work units.
    #[must_use]
    pub const fn with_work(self, units: u64) -> Self {
        Self { work: Some(units), ..self }
    }

    /// The same budget with this deadline.
    #[must_use]
    pub const fn with_deadline(self, deadline: Deadline) -> Self {
        Self { deadline: Some(deadline), ..self }
    }

    /// Returns `true` if work or time may end a query early.
    pub(crate) const fn may_end(&self) -> bool {
        self.work.is_some() || self.deadline.is_some()
    }

    /// The rest of the budget after `spent` units of work.
    pub(crate) fn less(&self, spent: u64) -> Self {
        Self { work: self.work.map(|work| work.saturating_sub(spent)), ..*self }
    }

    /// Breaks if `spent` units of work, or the time, have reached a limit.
    pub(crate) fn go_on(&self, spent: u64) -> ControlFlow<()> {
        let is_over = self.work.is_some_and(|work| spent >= work)
            || self.deadline.is_some_and(|deadline| now() >= deadline.0);
        if is_over { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    /// The same budget with the resolution `length`.
    #[must_use]
    pub const fn with_resolution(self, length: f64) -> Self {
        Self { resolution: Some(length), ..self }
    }
}
