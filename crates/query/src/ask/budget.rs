//! How much a query may cost. The only clock of the libraries.

use std::time::{Duration, Instant};

/// A point in time at which to stop; absolute, so that one can span all queries of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Deadline(pub(crate) Instant);

impl Deadline {
    /// This long from now.
    #[must_use]
    pub fn within(time: Duration) -> Self {
        let now = now();
        // A time too long to represent is as good as a year.
        Self(now.checked_add(time).unwrap_or(now + Duration::from_secs(31_536_000)))
    }

    /// At this instant.
    #[must_use]
    pub const fn at(instant: Instant) -> Self {
        Self(instant)
    }
}

/// What the clock says.
#[expect(clippy::disallowed_methods, reason = "this module is where clocks are read")]
pub(crate) fn now() -> Instant {
    Instant::now()
}

/// How much a query may cost; whatever ends first ends it. The default has no limit but one, and reads no
/// clock.
///
/// That one keeps a damaged file, whose boxes all overlap, from holding a query up for hours: without `work`,
/// a query ends undecided after some 128 leaf pairs for each leaf of the two scans, seven times what the
/// worst honest scans were found to need. Only [`Semantics::Thickened`](crate::Semantics) with a radius of
/// many spacings can come so far, where large parallel sheets are just not near enough; `with_work(u64::MAX)`
/// lifts the limit.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[non_exhaustive]
pub struct Budget {
    /// Work units: evaluations of an implicit function and node pairs. Reproducible. None: what no sound
    /// scans need.
    pub work: Option<u64>,
    /// When to stop. Not reproducible.
    pub deadline: Option<Deadline>,
    /// How fine to look, a length in the world: nodes whose samples are no further from their surface than
    /// this answer for all that is below them (S0 §1). Reproducible; the evidence is then estimated. None: to
    /// the last point.
    pub resolution: Option<f64>,
}

impl Budget {
    /// No limit but that for damaged files, down to the last point.
    pub const UNLIMITED: Self = Self { work: None, deadline: None, resolution: None };

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

    /// Returns `true` if work or time may end a query before it is done.
    pub(crate) const fn may_end(&self) -> bool {
        self.work.is_some() || self.deadline.is_some()
    }

    /// The same budget with nothing looked at more finely than `length`.
    #[must_use]
    pub const fn with_resolution(self, length: f64) -> Self {
        Self { resolution: Some(length), ..self }
    }
}
