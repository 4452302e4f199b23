//! What a query answers.

use nearmiss_geometry::PointId;
use serde::{Deserialize, Serialize};

/// Whether two scans meet.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Verdict {
    /// They do, and this is where.
    Intersecting {
        /// A place where they meet.
        contact: Contact,
        /// How sure that is.
        evidence: Evidence,
    },
    /// They do not.
    Separated {
        /// If certified, a proven lower bound of the distance in world units of their surfaces, or of their
        /// balls; else 0.
        gap: f64,
        /// How sure that is.
        evidence: Evidence,
    },
    /// That cannot be told.
    Undecided(Reason),
}

impl Verdict {
    /// Whether the verdict is that they meet.
    #[must_use]
    pub const fn is_intersecting(&self) -> bool {
        matches!(self, Self::Intersecting { .. })
    }

    /// Whether the verdict is that they are apart.
    #[must_use]
    pub const fn is_separated(&self) -> bool {
        matches!(self, Self::Separated { .. })
    }
}

/// How sure a verdict is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Evidence {
    /// Separated: volumes that contain the surfaces are disjoint, rounding included. Intersecting: a verified
    /// point on both surfaces.
    Certified,
    /// The search was exhaustive, or found the surfaces crossing to first order, but proves nothing.
    Estimated,
}

/// Why there is no verdict.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Reason {
    /// The budget was spent first; without one, so much that a file must be damaged
    /// ([`Budget`](crate::Budget)).
    Budget {
        /// An estimate of the probability that they meet, 0 to 1, from how deeply the volumes still open
        /// overlap.
        likelihood: f64,
    },
    /// They come near each other only where a scan's points lie on lines or too sparsely.
    Undersampled,
    /// They come near each other only where a scan's points do not look like one sheet.
    Ambiguous,
    /// [`Method::Interpolation`](crate::Method) searches along the graph of the one scan, which has none, or
    /// was placed [without](crate::Placed::with_graph).
    NoGraph,
    /// A pose is not finite, no rotation, has no positive scale, leads further than squares of double
    /// precision reach, or makes one scan's frame more than 2⁶⁰ times as large as the other's.
    Pose,
}

/// A place where two scans meet, in the world.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Contact {
    /// The place.
    pub point: [f64; 3],
    /// Unit normals of both surfaces there, of arbitrary sign; none where points are compared, not surfaces.
    pub normals: Option<[[f64; 3]; 2]>,
    /// How far off the place may be, in world units. Certified: the greater |f| of the two surfaces there.
    /// Estimated: the greater distance of either point from the other's tangent plane. Balls, and
    /// surfaces nearer than a margin: half the distance of the two points.
    pub residual: f64,
    /// The points whose discs (or balls) meet there, as the caller numbered them.
    pub sources: [PointId; 2],
}

/// The places where two scans meet, beside the [`Answer`].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Contacts {
    /// One of every pair of leaves that meets, unrefined, in the order of the search.
    pub contacts: Vec<Contact>,
    /// Whether these are all: the budget lasted.
    pub complete: bool,
}

impl Contacts {
    pub(crate) fn parts(&mut self) -> (&mut Vec<Contact>, &mut bool) {
        (&mut self.contacts, &mut self.complete)
    }
}

/// One place of a contact, in the world.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ManifoldPoint {
    /// Midway between the surfaces, or the balls.
    pub point: [f64; 3],
    /// The unit direction in which a leaves b.
    pub normal: [f64; 3],
    /// How far apart they are along it: less than zero where one is in the other. No deeper than the greater
    /// sampling radius, for what is further behind a surface is not seen from its points.
    pub gap: f64,
    /// The points of a and b that are nearest there, as the caller numbered them.
    pub sources: [PointId; 2],
}

/// What a query cost.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Statistics {
    /// Evaluations of an implicit function.
    pub evaluations: u64,
    /// Node pairs whose boxes were compared.
    pub node_pairs: u64,
    /// Pairs of leaves whose points were compared.
    pub leaf_pairs: u64,
    /// Nodes looked at to find nearest points, by [`Method::Interpolation`](crate::Method).
    pub neighbour_steps: u64,
}

/// A verdict and what it cost.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// Whether they meet.
    pub verdict: Verdict,
    /// The band, a length in the world: nothing is promised of where the scanned things themselves are within
    /// it. Where scans meet, the greater local radius of the two points that show it; otherwise that of all
    /// points near the narrowest gap that was proven, or of the scans. Never more than the greater
    /// [reach](nearmiss_hierarchy::PointHierarchy::reach); infinite for invalid poses.
    pub band: f64,
    /// By [`Method::Sampling`](crate::Method), the least |f_A| + |f_B| of all test points on which both mean
    /// something, in world units (S0 eq. 8): an estimate, from above, of the distance of the surfaces. By a
    /// flat [`Method::Interpolation`](crate::Method) the least distance of any point drawn of a from b. None
    /// otherwise, and where there was no such point.
    pub distance_estimate: Option<f64>,
    /// What that cost.
    pub statistics: Statistics,
}

impl Answer {
    /// The answer to a question that was not asked: nothing was spent, and nothing is known.
    pub const UNASKED: Self = Self {
        verdict: Verdict::Undecided(Reason::Budget { likelihood: 0.5 }),
        band: f64::INFINITY,
        distance_estimate: None,
        statistics: Statistics { evaluations: 0, node_pairs: 0, leaf_pairs: 0, neighbour_steps: 0 },
    };
}
