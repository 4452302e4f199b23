//! The bodies of a world: scans and meshes.

use nearmiss_geometry::Pose;

use crate::ask::budget::Budget;
use crate::mesh::pair::MeshPair;
use crate::mesh::placed::PlacedMesh;
use crate::mesh::prepared::PreparedMesh;
use crate::mesh_scan::pair::MeshScanPair;
use crate::pair::placed::Placed;
use crate::pair::prepared::Prepared;
use crate::question::Pair;

/// A preprocessed scan or mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Body<S, M> {
    /// A scan.
    Scan(S),
    /// A mesh.
    Mesh(M),
}

impl<S: Prepared, M: PreparedMesh> Body<S, M> {
    /// Places the body at `pose`, which maps the frame of its input to the world.
    #[inline]
    pub fn at(&self, pose: &Pose) -> PlacedBody<'_> {
        match self {
            Self::Scan(scan) => PlacedBody::Scan(scan.at(pose)),
            Self::Mesh(mesh) => PlacedBody::Mesh(mesh.at(pose)),
        }
    }
}

/// A scan or a mesh at a pose.
#[derive(Debug, Clone, Copy)]
pub enum PlacedBody<'a> {
    /// A placed scan.
    Scan(Placed<'a>),
    /// A placed mesh.
    Mesh(PlacedMesh<'a>),
}

/// A pair of bodies, with the questions that fit it.
///
/// In a pair of a mesh and a scan, the scan comes first in contacts and distances.
#[derive(Debug, Clone, Copy)]
pub enum BodyPair<'a> {
    /// Two scans.
    Scans(Pair<'a>),
    /// A scan and a mesh.
    MeshAndScan {
        /// The pair.
        pair: MeshScanPair<'a>,
        /// `true` if the mesh is the first of the two bodies.
        mesh_is_first: bool,
    },
    /// Two meshes.
    Meshes(MeshPair<'a>),
}

impl<'a> BodyPair<'a> {
    /// A pair with an unlimited budget.
    #[inline]
    #[must_use]
    pub fn new(a: PlacedBody<'a>, b: PlacedBody<'a>) -> Self {
        let beside = |scan, mesh, mesh_is_first| Self::MeshAndScan {
            pair: MeshScanPair::new(scan, mesh),
            mesh_is_first,
        };
        match (a, b) {
            (PlacedBody::Scan(a), PlacedBody::Scan(b)) => Self::Scans(Pair::new(a, b)),
            (PlacedBody::Mesh(a), PlacedBody::Mesh(b)) => Self::Meshes(MeshPair::new(a, b)),
            (PlacedBody::Scan(scan), PlacedBody::Mesh(mesh)) => beside(scan, mesh, false),
            (PlacedBody::Mesh(mesh), PlacedBody::Scan(scan)) => beside(scan, mesh, true),
        }
    }

    /// The same pair with this budget for each question.
    #[inline]
    #[must_use]
    pub fn within(self, budget: &Budget) -> Self {
        match self {
            Self::Scans(pair) => Self::Scans(pair.within(budget)),
            Self::MeshAndScan { pair, mesh_is_first } => {
                Self::MeshAndScan { pair: pair.within(budget), mesh_is_first }
            }
            Self::Meshes(pair) => Self::Meshes(pair.within(budget)),
        }
    }
}
