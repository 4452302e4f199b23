//! The bodies of a world: scans, meshes and convex shapes.

use std::convert::Infallible;

use nearmiss_geometry::Pose;
use serde::{Deserialize, Serialize};

use crate::ask::budget::Budget;
use crate::distance::DistancePlan;
use crate::mesh::pair::MeshPair;
use crate::mesh::placed::PlacedMesh;
use crate::mesh::prepared::PreparedMesh;
use crate::mesh_scan::pair::MeshScanPair;
use crate::pair::placed::Placed;
use crate::pair::prepared::Prepared;
use crate::question::{Pair, Scratch};
use crate::shape_pairs::mesh::ShapeMeshPair;
use crate::shape_pairs::scan::ShapeScanPair;
use crate::shape_pairs::shapes::ShapePair;
use crate::solid::as_shape::AsShape;
use crate::solid::placed::PlacedShape;
use crate::solid::plan::ShapePlan;

/// A preprocessed scan, a preprocessed mesh, or a convex shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Body<S, M, H = Infallible> {
    /// A scan.
    Scan(S),
    /// A mesh.
    Mesh(M),
    /// A convex shape.
    Shape(H),
}

impl<S: Prepared, M: PreparedMesh, H: AsShape> Body<S, M, H> {
    /// Places the body at `pose`, which maps the frame of its input to the world.
    #[inline]
    pub fn at(&self, pose: &Pose) -> PlacedBody<'_> {
        match self {
            Self::Scan(scan) => PlacedBody::Scan(scan.at(pose)),
            Self::Mesh(mesh) => PlacedBody::Mesh(mesh.at(pose)),
            Self::Shape(shape) => PlacedBody::Shape(shape.at(pose)),
        }
    }
}

/// A scan, a mesh or a convex shape at a pose.
#[derive(Debug, Clone, Copy)]
pub enum PlacedBody<'a> {
    /// A placed scan.
    Scan(Placed<'a>),
    /// A placed mesh.
    Mesh(PlacedMesh<'a>),
    /// A placed shape.
    Shape(PlacedShape<'a>),
}

/// A pair of bodies, with the questions that fit it.
///
/// In contacts and distances of two different kinds, the scan comes before the mesh or the shape, and the
/// mesh before the shape. [`Self::distance`] answers for all kinds, in the order of the bodies.
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
    /// A scan and a shape.
    ShapeAndScan {
        /// The pair.
        pair: ShapeScanPair<'a>,
        /// `true` if the shape is the first of the two bodies.
        shape_is_first: bool,
    },
    /// A mesh and a shape.
    ShapeAndMesh {
        /// The pair.
        pair: ShapeMeshPair<'a>,
        /// `true` if the shape is the first of the two bodies.
        shape_is_first: bool,
    },
    /// Two shapes.
    Shapes(ShapePair<'a>),
}

/// Bounds on the distance of two bodies, in world units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BodyDistance {
    /// A proven lower bound; 0 if the bodies may touch.
    pub lower: f64,
    /// An upper bound: the distance of [`Self::points`]. 0 if the bodies touch.
    pub upper: f64,
    /// The nearest points, of the first and of the second body.
    pub points: [[f64; 3]; 2],
}

impl<'a> BodyPair<'a> {
    /// A pair with an unlimited budget.
    #[inline]
    #[must_use]
    pub fn new(a: PlacedBody<'a>, b: PlacedBody<'a>) -> Self {
        use PlacedBody::{Mesh, Scan, Shape};
        let mesh_and_scan = |scan, mesh, mesh_is_first| Self::MeshAndScan {
            pair: MeshScanPair::new(scan, mesh),
            mesh_is_first,
        };
        let shape_and_scan = |scan, shape, shape_is_first| Self::ShapeAndScan {
            pair: ShapeScanPair::new(scan, shape),
            shape_is_first,
        };
        let shape_and_mesh = |mesh, shape, shape_is_first| Self::ShapeAndMesh {
            pair: ShapeMeshPair::new(mesh, shape),
            shape_is_first,
        };
        match (a, b) {
            (Scan(a), Scan(b)) => Self::Scans(Pair::new(a, b)),
            (Mesh(a), Mesh(b)) => Self::Meshes(MeshPair::new(a, b)),
            (Shape(a), Shape(b)) => Self::Shapes(ShapePair::new(a, b)),
            (Scan(scan), Mesh(mesh)) => mesh_and_scan(scan, mesh, false),
            (Mesh(mesh), Scan(scan)) => mesh_and_scan(scan, mesh, true),
            (Scan(scan), Shape(shape)) => shape_and_scan(scan, shape, false),
            (Shape(shape), Scan(scan)) => shape_and_scan(scan, shape, true),
            (Mesh(mesh), Shape(shape)) => shape_and_mesh(mesh, shape, false),
            (Shape(shape), Mesh(mesh)) => shape_and_mesh(mesh, shape, true),
        }
    }

    /// The same pair with this budget for each question. Pairs with a shape have no budget.
    #[inline]
    #[must_use]
    pub fn within(self, budget: &Budget) -> Self {
        match self {
            Self::Scans(pair) => Self::Scans(pair.within(budget)),
            Self::MeshAndScan { pair, mesh_is_first } => {
                Self::MeshAndScan { pair: pair.within(budget), mesh_is_first }
            }
            Self::Meshes(pair) => Self::Meshes(pair.within(budget)),
            Self::ShapeAndScan { .. } | Self::ShapeAndMesh { .. } | Self::Shapes(_) => self,
        }
    }

    /// Bounds the distance of the bodies: lower ≤ distance ≤ upper. `None` if the distance is unknown, as
    /// for an invalid pose or shape.
    ///
    /// `plan` is for any two scans of the world, or for one of them and a mesh
    /// ([`DistancePlan::against_mesh`]). It gives scans their meaning; meshes and shapes are exact. See
    /// [`Pair::distance`], [`MeshScanPair::distance`], [`MeshPair::distance`], [`ShapeScanPair::distance`],
    /// [`ShapeMeshPair::distance`] and [`ShapePair::distance`]. Does not allocate once `scratch` is warm.
    pub fn distance(&self, plan: &DistancePlan, scratch: &mut Scratch) -> Option<BodyDistance> {
        let (lower, upper, points, is_swapped) = match self {
            Self::Scans(pair) => {
                let found = pair.distance(plan, scratch);
                (found.lower, found.upper, found.points, false)
            }
            Self::MeshAndScan { pair, mesh_is_first } => {
                let found = pair.distance(plan, scratch);
                (found.lower, found.upper, found.points, *mesh_is_first)
            }
            Self::Meshes(pair) => {
                let found = pair.distance(scratch.meshes());
                (found.lower, found.upper, found.points, false)
            }
            Self::ShapeAndScan { pair, shape_is_first } => {
                let found = pair.distance(&ShapePlan::of_distance(plan), f64::INFINITY, scratch)?;
                (found.lower, found.upper, found.points, *shape_is_first)
            }
            Self::ShapeAndMesh { pair, shape_is_first } => {
                let found = pair.distance(f64::INFINITY, scratch)?;
                (found.lower, found.upper, found.points, *shape_is_first)
            }
            Self::Shapes(pair) => {
                let found = pair.distance()?;
                (found.lower, found.upper, found.points, false)
            }
        };
        let [first, second] = points;
        let points = if is_swapped { [second, first] } else { points };
        upper.is_finite().then_some(BodyDistance { lower, upper, points })
    }
}
