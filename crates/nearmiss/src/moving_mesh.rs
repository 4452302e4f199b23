//! `MovingMesh`: a mesh that deforms while it is asked.

use std::ops::Deref;

use nearmiss_geometry::{Pose, TriangleMesh};
use nearmiss_hierarchy::{DeformError, DeformingMesh, MeshBuildError, MeshBuildOptions};
use nearmiss_query::{PlacedMesh, PreparedMesh};

/// The looseness of refitted boxes from which a mesh is prepared anew (docs/theory/moving.md).
const LOOSE: f64 = 1.5;

/// How a moving mesh or scan follows a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Renewal {
    /// The bounds were refitted; the order of triangles or points stayed.
    Refitted,
    /// All points were fitted anew; their order stayed. Not for meshes.
    Renewed,
    /// It was prepared anew.
    Rebuilt,
}

/// A triangle mesh whose vertices move. Queries are exact in every frame.
///
/// Dereferences to its [`DeformingMesh`].
///
/// ```
/// use nearmiss::{MeshBuildOptions, MeshPair, MeshScratch, MovingMesh, Pose, TriangleMesh};
///
/// let frame = |height: f64| vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.3, 0.3, height]];
/// let mesh = TriangleMesh::new(frame(1.0), vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])?;
/// let mut moving = MovingMesh::new(&mesh, &MeshBuildOptions::default())?;
/// let mut scratch = MeshScratch::default();
/// let above = Pose::from_translation([0.0, 0.0, 2.0]);
/// for (height, meets) in [(1.0, false), (1.9, false), (2.5, true)] {
///     moving.move_to(&frame(height))?;
///     let pair = MeshPair::new(moving.at(&Pose::IDENTITY), moving.at(&above));
///     assert_eq!(pair.collide(&mut scratch).verdict.is_intersecting(), meets);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct MovingMesh {
    mesh: DeformingMesh,
}

impl Deref for MovingMesh {
    type Target = DeformingMesh;

    fn deref(&self) -> &DeformingMesh {
        &self.mesh
    }
}

impl PreparedMesh for MovingMesh {
    #[inline]
    fn at(&self, pose: &Pose) -> PlacedMesh<'_> {
        Self::at(self, pose)
    }
}

impl MovingMesh {
    /// Prepares the first frame. All vertices and triangles are kept as given, also those without
    /// area.
    ///
    /// # Errors
    /// As [`DeformingMesh::new`].
    pub fn new(mesh: &TriangleMesh, options: &MeshBuildOptions) -> Result<Self, MeshBuildError> {
        Ok(Self { mesh: DeformingMesh::new(mesh, options)? })
    }

    /// Moves the vertices, given in the order of the first frame: refits all boxes, and prepares the
    /// mesh anew if they have become too [loose](DeformingMesh::looseness).
    ///
    /// # Errors
    /// As [`DeformingMesh::refit`]. The mesh is unchanged then.
    pub fn move_to(&mut self, vertices: &[[f64; 3]]) -> Result<Renewal, DeformError> {
        self.refit(vertices)?;
        if self.mesh.looseness() <= LOOSE {
            return Ok(Renewal::Refitted);
        }
        self.rebuild(vertices)?;
        Ok(Renewal::Rebuilt)
    }

    /// Moves the vertices and refits all boxes, however loose they become.
    ///
    /// # Errors
    /// As [`DeformingMesh::refit`].
    pub fn refit(&mut self, vertices: &[[f64; 3]]) -> Result<(), DeformError> {
        self.mesh.refit(vertices)
    }

    /// Moves the vertices and prepares the mesh anew.
    ///
    /// # Errors
    /// As [`DeformingMesh::refit`].
    pub fn rebuild(&mut self, vertices: &[[f64; 3]]) -> Result<(), DeformError> {
        self.mesh.rebuild(vertices)
    }

    /// Places the mesh at `pose`, which maps the frame of its vertices to the world.
    #[inline]
    #[must_use]
    pub fn at(&self, pose: &Pose) -> PlacedMesh<'_> {
        PlacedMesh::new(&self.mesh, pose)
    }
}
