//! How much a query may cost. The only clock of the libraries.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use crate::verdict::Statistics;
use crate::view::ScanView;

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

/// A point in time at which to stop; absolute, so that one can span all queries of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Deadline(Instant);

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

    /// The same budget with nothing looked at more finely than `length`.
    #[must_use]
    pub const fn with_resolution(self, length: f64) -> Self {
        Self { resolution: Some(length), ..self }
    }
}

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
    /// When the clock was looked at last, and the longest time that it was not.
    looked: Option<Instant>,
    pub(crate) longest_stretch: Duration,
    /// What was spent.
    pub(crate) spent: Statistics,
}

impl Meter {
    /// For two scans with so many leaves of so many points, and so many evaluations for two leaves.
    pub(crate) fn new(budget: &Budget, leaves: [u64; 2], points: [u64; 2], evaluations: u64) -> Self {
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
            looked: None,
            longest_stretch: Duration::ZERO,
            spent: Statistics::default(),
        }
    }

    /// One that goes on after `spent`, with evaluations along curves in steps of so many sampling radii.
    pub(crate) fn resumed(budget: &Budget, views: [&ScanView<'_>; 2], step: f64, spent: Statistics) -> Self {
        /// For each of the pairs of leaves that sound scans may have at most, of which few are on a curve: a
        /// tenth of what it takes to follow one through.
        const EVALUATIONS: f64 = 10.0;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to 2¹⁶")]
        let evaluations = (EVALUATIONS / step).clamp(1.0, 65536.0) as u64;
        let leaves = views.map(|view| view.scan().topology().leaves() as u64);
        let points = views.map(|view| u64::from(view.scan().leaf_size()));
        Self { spent, ..Self::new(budget, leaves, points, evaluations) }
    }

    /// Counts two leaves of so many points each.
    #[inline]
    pub(crate) fn leaf_pair(&mut self, a: usize, b: usize) {
        self.spent.leaf_pairs += 1;
        self.leaf_work += (a * b) as u64 / POINTS_A_PAIR;
    }

    /// Counts leaf work that costs as much as so many node pairs.
    #[inline]
    pub(crate) fn leaf_work(&mut self, pairs: u64) {
        self.leaf_work += pairs;
    }

    /// Whether anything is left. Once nothing is, nothing ever will be.
    #[inline]
    pub(crate) fn go_on(&mut self) -> ControlFlow<()> {
        let Statistics { evaluations, node_pairs, .. } = self.spent;
        if evaluations + node_pairs >= self.most_units {
            return ControlFlow::Break(());
        }
        let work = PAIRS_AN_EVALUATION * evaluations + node_pairs + self.leaf_work;
        if work < self.next_look { ControlFlow::Continue(()) } else { self.look(work) }
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
