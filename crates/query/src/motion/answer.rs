//! The answer of a sweep.

use serde::{Deserialize, Serialize};

use crate::ask::answer::{Contact, Evidence, Statistics};
use crate::solid::answer::ShapeContact;

/// The verdict on a whole motion. Times are those of the [`Motion`](nearmiss_geometry::Motion).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum SweepVerdict {
    /// Proven: during the whole motion the two things stay further apart than the clearance that
    /// was asked for.
    Free {
        /// A proven lower bound of the distance during the whole motion, in world units.
        clearance: f64,
        /// An upper bound of the least distance: that at time `at`.
        upper: f64,
        /// The time of the least distance that was measured.
        at: f64,
    },
    /// The two things meet, or come within the clearance.
    Impact {
        /// The motion is proven free from its start to this time. 0 if nothing is proven.
        t_free: f64,
        /// The first time at which a contact was found.
        t_hit: f64,
        /// A contact at time `t_hit`.
        contact: Contact,
        /// The certainty of the contact.
        evidence: Evidence,
    },
    /// The motion is proven free up to `t_free`. No contact was found after it, but no proof
    /// either.
    Undecided {
        /// The motion is proven free from its start to this time.
        t_free: f64,
        /// The reason why the proof ends there.
        reason: SweepReason,
    },
}

impl SweepVerdict {
    /// Returns `true` if the whole motion is proven free.
    #[must_use]
    pub const fn is_free(&self) -> bool {
        matches!(self, Self::Free { .. })
    }

    /// Returns `true` if a contact was found.
    #[must_use]
    pub const fn is_impact(&self) -> bool {
        matches!(self, Self::Impact { .. })
    }
}

/// The reason for an undecided sweep.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum SweepReason {
    /// The two things come nearer to each other than their enclosures can prove apart, about two
    /// local spacings, but no contact was found.
    Near,
    /// The budget was spent first.
    Budget,
    /// A pose is invalid; see [`Reason::Pose`](crate::Reason).
    Pose,
    /// The shape is invalid.
    Shape,
    /// The metric is geodesic. Its surfaces have no enclosures, so nothing is proven.
    Geodesic,
}

/// The verdict on the whole motion of a shape past a scan; as [`SweepVerdict`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum ShapeSweepVerdict {
    /// Proven: during the whole motion the shape is further from the scan than the margin of the plan.
    Free {
        /// A proven lower bound of the distance during the whole motion, in world units.
        clearance: f64,
        /// An upper bound of the least distance: that at time `at`.
        upper: f64,
        /// The time of the least distance that was measured.
        at: f64,
    },
    /// The shape touches the scan, or comes within the margin.
    Impact {
        /// The motion is proven free from its start to this time. 0 if nothing is proven.
        t_free: f64,
        /// The first time at which a contact was found.
        t_hit: f64,
        /// The deepest contact at time `t_hit`. Its depth is about zero, or about less the margin.
        contact: ShapeContact,
    },
    /// The motion is proven free up to `t_free`. No contact was found after it, but no proof either.
    Undecided {
        /// The motion is proven free from its start to this time.
        t_free: f64,
        /// The reason why the proof ends there.
        reason: SweepReason,
    },
}

/// The answer of the sweep of a shape.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ShapeSweep {
    /// The verdict.
    pub verdict: ShapeSweepVerdict,
    /// The local spacing where the shape was nearest to the scan, below which the scan does not determine
    /// the truth, in world units. Infinite if the shape, a pose or the scan is invalid.
    pub band: f64,
    /// The number of distance queries.
    pub distances: u32,
}

/// The answer of a sweep and its cost.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SweepAnswer {
    /// The verdict.
    pub verdict: SweepVerdict,
    /// The band where the two things were nearest, as in [`Distance::band`](crate::Distance).
    pub band: f64,
    /// The number of distance queries.
    pub distances: u32,
    /// The number of contact queries.
    pub contacts: u32,
    /// The number of time intervals that were searched.
    pub intervals: u32,
    /// The cost of all of these together.
    pub statistics: Statistics,
}
