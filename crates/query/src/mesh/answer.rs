//! The answers about two meshes.

use nearmiss_geometry::PointId;
use serde::{Deserialize, Serialize};

use crate::ask::answer::{Contact, Statistics};

/// The verdict on whether two meshes meet.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum MeshVerdict {
    /// A triangle of each shares a point. Decided exactly, for the corners of both triangles as they
    /// are rounded in a's frame.
    Intersecting(MeshContact),
    /// No two triangles share a point.
    Separated,
    /// The search stopped above the leaves, because enough pairs of nodes are likely to collide or
    /// because a budget was spent. The likelihood of the answer says which verdict is more probable.
    Undecided(ContactRegion),
    /// A pose is invalid: it is not finite, not a rotation or has no positive scale.
    Pose,
}

impl MeshVerdict {
    /// Returns `true` if the meshes meet.
    #[must_use]
    pub const fn is_intersecting(&self) -> bool {
        matches!(self, Self::Intersecting(_))
    }

    /// Returns `true` if the meshes are separated.
    #[must_use]
    pub const fn is_separated(&self) -> bool {
        matches!(self, Self::Separated)
    }
}

/// A contact of a triangle of a and a triangle of b, in the world.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MeshContact {
    /// A common point: the middle of [`ends`](Self::ends), or the centre of what triangles in one
    /// plane have in common.
    pub point: [f64; 3],
    /// The ends of the segment that the triangles have in common; equal if they touch in a point.
    pub ends: [[f64; 3]; 2],
    /// Unit normals of both triangles, on the side from which their corners turn counterclockwise.
    pub normals: [[f64; 3]; 2],
    /// The triangles, as the caller numbered them.
    pub triangles: [u32; 2],
}

impl From<&MeshContact> for Contact {
    /// The same contact in the form that contacts of scans have, to be [grouped](crate::ContactGroup::all).
    /// The sources are the triangles.
    fn from(contact: &MeshContact) -> Self {
        let MeshContact { point, normals, triangles, .. } = *contact;
        Self { point, normals: Some(normals), residual: 0.0, sources: triangles.map(PointId) }
    }
}

/// Where two meshes are most likely to meet, in the world.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ContactRegion {
    /// The centre of the intersection of the bounding volumes that are most likely to hold a contact.
    pub centre: [f64; 3],
    /// The radius of a ball about the centre that contains the intersection.
    pub radius: f64,
}

/// A verdict about two meshes and its cost.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MeshAnswer {
    /// The verdict.
    pub verdict: MeshVerdict,
    /// The probability that the meshes meet: 1 or 0 if it is decided, otherwise an estimate.
    pub likelihood: f64,
    /// The cost: node pairs compared, and leaf pairs whose triangles were compared.
    pub statistics: Statistics,
}

impl MeshAnswer {
    /// Returns `true` if the meshes meet or are more likely to meet than not: the best answer to a
    /// query that may be cut short.
    #[must_use]
    pub fn likely_meets(&self) -> bool {
        self.likelihood >= 0.5
    }
}
