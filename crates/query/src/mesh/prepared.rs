//! The trait of preprocessed meshes.

use std::convert::Infallible;
use std::rc::Rc;
use std::sync::Arc;

use nearmiss_geometry::Pose;
use nearmiss_hierarchy::MeshHierarchy;

use crate::mesh::placed::PlacedMesh;

/// A preprocessed mesh, however it is owned: `nearmiss::Mesh`, [`MeshHierarchy`], or a reference,
/// `Arc`, `Rc` or `Box` of one.
pub trait PreparedMesh {
    /// Places the mesh at `pose`, which maps the frame of its input to the world.
    fn at(&self, pose: &Pose) -> PlacedMesh<'_>;
}

impl PreparedMesh for MeshHierarchy {
    fn at(&self, pose: &Pose) -> PlacedMesh<'_> {
        PlacedMesh::new(self, pose)
    }
}

/// For worlds without meshes.
impl PreparedMesh for Infallible {
    fn at(&self, _: &Pose) -> PlacedMesh<'_> {
        match *self {}
    }
}

impl<M: PreparedMesh + ?Sized> PreparedMesh for &M {
    fn at(&self, pose: &Pose) -> PlacedMesh<'_> {
        (**self).at(pose)
    }
}

impl<M: PreparedMesh + ?Sized> PreparedMesh for Arc<M> {
    fn at(&self, pose: &Pose) -> PlacedMesh<'_> {
        (**self).at(pose)
    }
}

impl<M: PreparedMesh + ?Sized> PreparedMesh for Rc<M> {
    fn at(&self, pose: &Pose) -> PlacedMesh<'_> {
        (**self).at(pose)
    }
}

impl<M: PreparedMesh + ?Sized> PreparedMesh for Box<M> {
    fn at(&self, pose: &Pose) -> PlacedMesh<'_> {
        (**self).at(pose)
    }
}
