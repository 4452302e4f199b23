//! The answers to questions about a scan and a shape.

use nearmiss_geometry::PointId;
use serde::{Deserialize, Serialize};

use crate::ask::answer::{Evidence, Reason};

/// The verdict on whether a shape touches a scan.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum ShapeVerdict {
    /// The shape touches the scan.
    Touching {
        /// A point of the scan's obstacle in the shape, or within the margin of it. World coordinates.
        point: [f64; 3],
        /// The measured point whose disc or ball is there, as the caller numbered it.
        source: PointId,
        /// Certified: `point` is a measured point, part of a ball, or a verified point of the surface.
        /// Estimated: it is part of a tangent disc.
        evidence: Evidence,
    },
    /// The shape is further from the scan than the margin.
    Separated {
        /// Certified: volumes that contain the obstacle are apart from the shape, rounding included.
        evidence: Evidence,
    },
    /// The query could not decide.
    Undecided(Reason),
}

impl ShapeVerdict {
    /// Returns `true` if the shape touches the scan.
    #[must_use]
    pub const fn is_touching(&self) -> bool {
        matches!(self, Self::Touching { .. })
    }

    /// Returns `true` if the shape is apart from the scan.
    #[must_use]
    pub const fn is_separated(&self) -> bool {
        matches!(self, Self::Separated { .. })
    }
}

/// A verdict about a shape, and the length below which the scan does not determine it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ShapeAnswer {
    /// The verdict.
    pub verdict: ShapeVerdict,
    /// The band, in world units: the local radius of the point that the shape touches, otherwise the
    /// greatest of the scan. Nothing is claimed about where the scanned thing itself is within it.
    /// Infinite for invalid shapes and poses.
    pub band: f64,
}

/// Bounds on the distance of a shape and a scan, in world units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ShapeDistance {
    /// A proven lower bound; 0 for scans of the geodesic metric.
    pub lower: f64,
    /// An upper bound: the distance of the nearest disc, ball or measured point. 0 if they touch.
    pub upper: f64,
    /// The nearest points, of the scan's obstacle and of the shape.
    pub points: [[f64; 3]; 2],
    /// The measured point whose disc or ball is nearest, as the caller numbered it.
    pub source: PointId,
    /// The local radius of that point.
    pub band: f64,
    /// The evidence for the upper bound. Certified: the nearest place belongs to a ball. Estimated: it
    /// belongs to a tangent disc, which approximates the surface to first order.
    pub evidence: Evidence,
}

/// A contact of a shape with the surface of a scan, for a physics solver. World coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ShapeContact {
    /// A point of the surface. The deepest point of the shape below its disc is `depth` against the normal.
    /// At the end of a sheet the normal is the way past the end, and the shape is clear of all of the sheet
    /// after `depth`, so there may be nothing of the shape below this point.
    pub point: [f64; 3],
    /// The unit normal of the surface, in the direction in which the shape moves out.
    pub normal: [f64; 3],
    /// The penetration depth along the normal. Negative for a gap within the margin, or within a twentieth of
    /// the local radius, the thickness of discs.
    pub depth: f64,
    /// A number that the contact keeps from frame to frame if a [hint](crate::ShapeHint) is used;
    /// otherwise the number of the measured point there. No two contacts of a manifold share one.
    pub id: u64,
}
