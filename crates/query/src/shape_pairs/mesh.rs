//! A placed convex shape and a placed mesh.

use crate::ask::budget::Budget;
use crate::mesh::placed::PlacedMesh;
use crate::mesh::solid::MeshSolid;
use crate::penetration::answer::Penetration;
use crate::question::Scratch;
use crate::shape_pairs::mesh_distance::{ShapeMeshDistance, distance};
use crate::shape_pairs::mesh_penetration::penetration;
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
        self.ask(|solid| distance(&self.mesh, solid, within, scratch.level()))?
    }

    /// Bounds the penetration of the mesh and the shape: how far the shape must at least be shifted, in any
    /// direction, to be separate from the mesh. `parts` tells which parts of the mesh are closed. Unlike for
    /// [`Self::distance`], these are solid. The upper bound is infinite if `parts` are those of another mesh.
    ///
    /// Both bounds are valid whenever the budget ends the search. The upper one comes from a shift that was
    /// tested, and is a local minimum: a shorter shift may exist in a direction that was not tried. The lower
    /// one comes from triangles inside the shape and from places inside both.
    ///
    /// Costs a hundred to a thousand searches for a touching triangle. Does not allocate once `scratch` is
    /// warm.
    ///
    /// ```
    /// use nearmiss_geometry::{Pose, TriangleMesh};
    /// use nearmiss_hierarchy::{MeshBuildOptions, MeshHierarchy};
    /// use nearmiss_query::{AsShape, Budget, MeshSolid, PlacedMesh, Scratch, Shape, ShapeMeshPair};
    ///
    /// // A rod whose lower end is 0.15 below a triangle.
    /// let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    /// let mesh = TriangleMesh::new(corners, vec![[0, 1, 2]])?;
    /// let mesh = MeshHierarchy::build(&mesh, &MeshBuildOptions::default())?;
    /// let rod = Shape::Capsule { ends: [[0.0; 3], [0.0, 0.0, 1.0]], radius: 0.1 };
    /// let rod = rod.at(&Pose::from_translation([0.3, 0.3, -0.05]));
    /// let pair = ShapeMeshPair::new(PlacedMesh::new(&mesh, &Pose::IDENTITY), rod);
    /// let parts = MeshSolid::new(&mesh);
    /// let found = pair.penetration(&parts, &Budget::UNLIMITED, &mut Scratch::default());
    /// assert!(found.lower > 0.149 && found.lower <= 0.15 + 1e-9, "{found:?}");
    /// assert!((found.upper - 0.15).abs() < 1e-5 && found.direction[2] > 0.999, "{found:?}");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn penetration(&self, parts: &MeshSolid, budget: &Budget, scratch: &mut Scratch) -> Penetration {
        let level = scratch.level();
        let search = &mut scratch.penetration.search;
        let found = self.ask(|solid| penetration(self.mesh, parts, solid, (budget, level), search));
        found.unwrap_or(Penetration::UNKNOWN)
    }

    /// Calls `ask` with the shape in the stored frame of the mesh. `None` if the shape or a pose is invalid.
    fn ask<R>(&self, ask: impl FnOnce(&Solid<'_>) -> R) -> Option<R> {
        let frame = self.shape.frame_of(self.mesh.stored_to_world())?;
        Some(ask(&Solid::new(self.shape.shape(), &frame)?))
    }
}
