//! [`DeformingMesh`]: a prepared mesh whose vertices move.

use std::ops::Deref;

use nearmiss_geometry::{Aabb, Frame, TriangleMesh};
use nearmiss_lanes::parallel::fill;
use nearmiss_lanes::vector::{cross, dot, sub};

use crate::mesh::block::LEAF_TRIANGLES;
use crate::mesh::build::{FARTHEST, MeshHierarchy, block, build_as_given, too_far};
use crate::mesh::options::{MeshBuildError, MeshBuildOptions};
use crate::mesh::refit::refit;
use crate::scan::deform_error::{DeformError, bounds_of};
use crate::scan::outline::Ball;

/// A prepared mesh whose vertices move while its triangles stay.
///
/// All triangles and vertices are kept as given. No vertex is welded, so that seams may open;
/// triangles without area stay, as they may get one. A triangle that loses its area counts as the
/// segment or the point that it has become. Queries of the mesh are exact in every frame.
///
/// Dereferences to its [`MeshHierarchy`].
///
/// ```
/// use nearmiss_geometry::TriangleMesh;
/// use nearmiss_hierarchy::{DeformingMesh, MeshBuildOptions};
///
/// let square = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
/// let mesh = TriangleMesh::new(square, vec![[0, 1, 2], [0, 2, 3]])?;
/// let mut moving = DeformingMesh::new(&mesh, &MeshBuildOptions::default())?;
/// moving.refit(&[[0.0, 0.0, 5.0], [1.0, 0.0, 5.0], [1.0, 1.0, 6.0], [0.0, 1.0, 5.0]])?;
/// assert_eq!(moving.bounds().max, [1.0, 1.0, 6.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct DeformingMesh {
    mesh: MeshHierarchy,
    options: MeshBuildOptions,
    /// The vertices in the stored frame.
    local: Vec<[f32; 3]>,
    /// The cost of the boxes when they were fitted anew.
    fresh: f64,
}

impl Deref for DeformingMesh {
    type Target = MeshHierarchy;

    fn deref(&self) -> &MeshHierarchy {
        &self.mesh
    }
}

impl DeformingMesh {
    /// Prepares the first frame. Costs as much as [`MeshHierarchy::build`]. How the mesh would be
    /// cleaned is ignored.
    ///
    /// # Errors
    /// As [`MeshHierarchy::build`], except that triangles need not have an area.
    pub fn new(mesh: &TriangleMesh, options: &MeshBuildOptions) -> Result<Self, MeshBuildError> {
        nearmiss_mesh::validate(mesh.vertices(), mesh.triangles())?;
        Self::of(mesh.vertices().to_vec(), mesh.triangles(), options)
    }

    fn of(
        vertices: Vec<[f64; 3]>,
        triangles: &[[u32; 3]],
        options: &MeshBuildOptions,
    ) -> Result<Self, MeshBuildError> {
        let local = vec![[0.0; 3]; vertices.len()];
        let mesh = build_as_given(vertices, triangles, options)?;
        let mut moving = Self { mesh, options: *options, local, fresh: 0.0 };
        moving.fresh = moving.cost();
        Ok(moving)
    }

    /// Moves the vertices, given in the order of the first frame, and refits the boxes in place.
    /// Every node keeps its triangles and the axes of its box. O(n) on all cores; does not allocate
    /// once warm.
    ///
    /// Exact afterwards: triangles, bounds, boxes, and with them every answer. Carried along from
    /// the last build: the well-filled cells of nodes, which order time-critical searches and enter
    /// likelihoods.
    ///
    /// # Errors
    /// If the number of vertices differs from that of the first frame, or a coordinate is not finite
    /// or too large. The mesh is unchanged then.
    pub fn refit(&mut self, vertices: &[[f64; 3]]) -> Result<(), DeformError> {
        let bounds = self.check(vertices)?;
        let frame = Frame::around(bounds.min, bounds.max);
        fill(&mut self.local, |v| frame.to_local(vertices[v]));
        let MeshHierarchy { meta, topology, arrays } = &mut self.mesh;
        arrays.vertices.to_mut().copy_from_slice(vertices);
        let (local, triangles): (&[_], &[[u32; 3]]) = (&self.local, &arrays.triangles);
        let corners = |i: usize| triangles[i].map(|v| local[v as usize]);
        let blocks = arrays.blocks.to_mut();
        fill(blocks, |number| block(topology, number, corners));
        refit(topology, blocks, arrays.siblings.to_mut(), &mut meta.root);
        (meta.frame, meta.bounds, meta.ball) = (frame, bounds, Ball::about(&meta.root.bounds));
        self.mesh.meta.identity = self.mesh.hashed();
        Ok(())
    }

    /// Moves the vertices and prepares the mesh anew, with another order of its triangles. Costs as
    /// much as [`DeformingMesh::new`].
    ///
    /// # Errors
    /// As [`DeformingMesh::refit`].
    pub fn rebuild(&mut self, vertices: &[[f64; 3]]) -> Result<(), DeformError> {
        self.check(vertices)?;
        let mut triangles = vec![[0; 3]; self.mesh.len()];
        for (triangle, source) in self.mesh.arrays.triangles.iter().zip(&self.mesh.arrays.source) {
            triangles[*source as usize] = *triangle;
        }
        // Everything that a build rejects has been excluded, or was in the first frame.
        if let Ok(anew) = Self::of(vertices.to_vec(), &triangles, &self.options) {
            *self = anew;
            return Ok(());
        }
        self.refit(vertices)
    }

    /// Returns the cost of the boxes relative to that after the last build: the sum of the areas of
    /// all boxes, in areas of the triangles (Goldsmith & Salmon 1987). 1 after a build; the greater,
    /// the looser the boxes. O(n), a small part of a refit.
    #[must_use]
    pub fn looseness(&self) -> f64 {
        let looseness = self.cost() / self.fresh;
        if looseness.is_finite() { looseness } else { 1.0 }
    }

    /// The areas of all boxes, in areas of the triangles.
    fn cost(&self) -> f64 {
        let corners = |i: usize| self.mesh.arrays.blocks[i / LEAF_TRIANGLES].get(i % LEAF_TRIANGLES);
        let area = |[p, q, r]: [[f32; 3]; 3]| {
            let normal = cross(sub(q, p), sub(r, p));
            f64::from(dot(normal, normal).sqrt())
        };
        self.mesh.arrays().tree.area() / (0..self.mesh.len()).map(|i| area(corners(i))).sum::<f64>()
    }

    /// Checks the vertices of a frame and returns their bounds.
    fn check(&self, vertices: &[[f64; 3]]) -> Result<Aabb, DeformError> {
        let expected = self.mesh.vertices();
        if vertices.len() != expected {
            return Err(DeformError::Count { what: "vertices", expected, got: vertices.len() });
        }
        let bounds = bounds_of("vertex", vertices)?;
        match too_far(&bounds) {
            Some(got) => Err(DeformError::TooFar { limit: FARTHEST, got }),
            None => Ok(bounds),
        }
    }
}
