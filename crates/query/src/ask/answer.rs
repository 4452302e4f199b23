//! The answer of a query.

use nearmiss_geometry::PointId;
use serde::{Deserialize, Serialize};

/// The verdict on whether two scans meet.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Verdict {
    /// The scans meet.
    Intersecting {
        /// A point where the scans meet.
        contact: Contact,
        /// The certainty of the contact.
        evidence: Evidence,
    },
    /// The scans are separated.
    Separated {
        /// A proven lower bound of the distance of the surfaces, or of the balls, in world units if
        /// the separation is certified; 0 otherwise.
        gap: f64,
        /// The certainty of the separation.
        evidence: Evidence,
    },
    /// The query could not decide.
    Undecided(Reason),
}

impl Verdict {
    /// Returns `true` if the scans meet.
    #[must_use]
    pub const fn is_intersecting(&self) -> bool {
        matches!(self, Self::Intersecting { .. })
    }

    /// Returns `true` if the scans are separated.
    #[must_use]
    pub const fn is_separated(&self) -> bool {
        matches!(self, Self::Separated { .. })
    }
}

/// The certainty of a verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Evidence {
    /// A separation: volumes that contain the surfaces are disjoint, rounding included. An
    /// intersection: a point on both surfaces was verified.
    Certified,
    /// The search was exhaustive, or found that the surfaces cross to first order, but it proves
    /// nothing.
    Estimated,
}

/// The reason for an undecided verdict.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Reason {
    /// The budget was spent first. Without a budget, the query exceeded a limit that only damaged
    /// files reach ([`Budget`](crate::Budget)).
    Budget {
        /// An estimate of the probability that the scans meet, 0 to 1, from how deeply the open
        /// volumes overlap.
        likelihood: f64,
    },
    /// The scans come near each other only where the points of one are on lines or too sparse.
    Undersampled,
    /// The scans come near each other only where the points of one do not fit a single sheet.
    Ambiguous,
    /// [`Method::Interpolation`](crate::Method) needs the graph of the first scan, which has none
    /// or was placed [without it](crate::Placed::with_graph).
    NoGraph,
    /// A pose is invalid: it is not finite, not a rotation or has no positive scale, or its lengths
    /// have squares outside double precision. Also returned if one scan's frame is more than 2⁶⁰
    /// times as large as the other's.
    Pose,
    /// A shape is invalid: a length of it is negative, infinite or NaN, or a point is not finite.
    Shape,
}

/// A point where two scans meet, in the world.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Contact {
    /// The position.
    pub point: [f64; 3],
    /// Unit normals of both surfaces at the point, of arbitrary sign. `None` if points are compared
    /// instead of surfaces.
    pub normals: Option<[[f64; 3]; 2]>,
    /// The uncertainty of the position, in world units. Certified: the greater |f| of the two
    /// surfaces. Estimated: the greater distance of either source point from the other's tangent
    /// plane. For balls, and for surfaces within a margin: half the distance of the two points.
    pub residual: f64,
    /// The points whose discs or balls meet there, as the caller numbered them.
    pub sources: [PointId; 2],
}

/// All contacts of two scans, an output beside the [`Answer`].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Contacts {
    /// A contact of each pair of intersecting leaves, unrefined, in the order of the search.
    pub contacts: Vec<Contact>,
    /// `true` if the list is complete: the budget was not spent.
    pub complete: bool,
}

impl Contacts {
    pub(crate) fn parts(&mut self) -> (&mut Vec<Contact>, &mut bool) {
        (&mut self.contacts, &mut self.complete)
    }
}

/// A point of a contact manifold, in the world.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ManifoldPoint {
    /// The point midway between the surfaces, or between the balls.
    pub point: [f64; 3],
    /// The unit direction in which a moves out of b.
    pub normal: [f64; 3],
    /// The distance along the normal; negative for penetration. Never deeper than the greater
    /// sampling radius, as points further behind a surface are not recognised as being behind it.
    pub gap: f64,
    /// The nearest points of a and b there, as the caller numbered them.
    pub sources: [PointId; 2],
}

/// The cost of a query.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Statistics {
    /// Evaluations of an implicit function.
    pub evaluations: u64,
    /// Node pairs whose boxes were compared.
    pub node_pairs: u64,
    /// Leaf pairs whose points were compared.
    pub leaf_pairs: u64,
    /// Nodes visited by nearest-point searches of [`Method::Interpolation`](crate::Method).
    pub neighbour_steps: u64,
}

impl Statistics {
    /// Adds the cost of a part of a query.
    pub(crate) fn add(&mut self, part: &Self) {
        self.evaluations += part.evaluations;
        self.node_pairs += part.node_pairs;
        self.leaf_pairs += part.leaf_pairs;
    }

    /// Returns the work of a query that consists of others.
    pub(crate) fn work(&self) -> u64 {
        self.evaluations + self.node_pairs
    }
}

/// A verdict and its cost.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// The verdict.
    pub verdict: Verdict,
    /// The band, a length in world units: nothing is claimed about where the scanned things
    /// themselves are within it. If the scans meet, it is the greater local radius of the two
    /// points that show the contact. Otherwise it is the greatest local radius near the narrowest
    /// proven gap, or of the scans. Never more than the greater
    /// [reach](nearmiss_hierarchy::PointHierarchy::reach); infinite for invalid poses.
    pub band: f64,
    /// An estimate of the distance of the surfaces from above, in world units. For
    /// [`Method::Sampling`](crate::Method), the least |f_A| + |f_B| of all test points at which
    /// both functions are defined (Klein & Zachmann 2004, eq. 8). For a flat
    /// [`Method::Interpolation`](crate::Method), the least distance of any drawn point of a from b.
    /// `None` otherwise, and if there was no such point.
    pub distance_estimate: Option<f64>,
    /// The cost of the query.
    pub statistics: Statistics,
}

impl Answer {
    /// The answer to a query that was never run: undecided, at no cost.
    pub const UNASKED: Self = Self {
        verdict: Verdict::Undecided(Reason::Budget { likelihood: 0.5 }),
        band: f64::INFINITY,
        distance_estimate: None,
        statistics: Statistics { evaluations: 0, node_pairs: 0, leaf_pairs: 0, neighbour_steps: 0 },
    };
}
