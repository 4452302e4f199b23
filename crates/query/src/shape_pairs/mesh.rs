//! A placed convex shape and a placed mesh.

use crate::mesh::placed::PlacedMesh;
use crate::question::Scratch;
use crate::shape_pairs::mesh_distance::{ShapeMeshDistance, distance};
use crate::solid::core::Solid;
use crate::solid::placed::PlacedShape;

/// A placed convex shape and a placed mesh.
///
/// The shape is solid, the mesh consists of its triangles alone: a shape inside a closed mesh is apart
/// from it, and a mesh inside a shape touches it.
///
/// ```
/// use nearmiss_geometry::{Pose, TriangleMesh};
/// use nearmiss_hierarchy::{MeshBuildOptions, MeshHierarchy};
/// use nearmiss_query::{AsShape, PlacedMesh, Scratch, Shape, ShapeMeshPair};
///
/// let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
/// let mesh = TriangleMesh::new(corners, vec![[0, 1, 2]])?;
/// let mesh = MeshHierarchy::build(&mesh, &MeshBuildOptions::default())?;
/// let rod = Shape::Capsule { ends: [[0.0; 3], [0.0, 0.0, 1.0]], radius: 0.1 };
///
/// let mut scratch = Scratch::default();
/// let at = |z: f64| {
///     let pose = Pose::from_translation([0.2, 0.2, z]);
///     ShapeMeshPair::new(PlacedMesh::new(&mesh, &Pose::IDENTITY), rod.at(&pose))
/// };
/// let found = at(0.5).distance(f64::INFINITY, &mut scratch).expect("both are valid");
/// assert!(found.lower <= 0.4 + 1e-9 && (found.upper - 0.4).abs() < 1e-8);
/// assert!(at(0.5).distance(0.3, &mut scratch).is_none(), "further away than 0.3");
/// assert_eq!(at(-0.5).distance(0.0, &mut scratch).expect("they touch").upper, 0.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct ShapeMeshPair<'a> {
    mesh: PlacedMesh<'a>,
    shape: PlacedShape<'a>,
}

impl<'a> ShapeMeshPair<'a> {
    /// A pair of a mesh and a shape.
    #[inline]
    #[must_use]
    pub fn new(mesh: PlacedMesh<'a>, shape: PlacedShape<'a>) -> Self {
        Self { mesh, shape }
    }

    /// The mesh.
    #[must_use]
    pub fn mesh(&self) -> &PlacedMesh<'a> {
        &self.mesh
    }

    /// The shape.
    #[must_use]
    pub fn shape(&self) -> &PlacedShape<'a> {
        &self.shape
    }

    /// Bounds the distance of the mesh and the shape: lower ≤ distance ≤ upper. `None` if it exceeds
    /// `within`, or if the shape or a pose is invalid. A shape touches the mesh if its distance within 0
    /// is found.
    ///
    /// The bounds agree to about 1e-9 of the distance between the nearest triangle and the core of the
    /// shape. Two things that touch without overlap may be apart by rounding.
    ///
    /// Descends to the triangles that are near, each compared by the algorithm of Gilbert, Johnson &
    /// Keerthi (1988) in about a microsecond, or faster with a sphere. Does not allocate.
    #[must_use]
    pub fn distance(&self, within: f64, scratch: &mut Scratch) -> Option<ShapeMeshDistance> {
        let frame = self.shape.frame_of(self.mesh.stored_to_world())?;
        let solid = Solid::new(self.shape.shape(), &frame)?;
        distance(&self.mesh, &solid, within, scratch.level())
    }
}
