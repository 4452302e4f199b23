//! Meshes and parts of them.

use fearless_simd::Level;
use nearmiss_hierarchy::{MeshHierarchy, MeshView};

use crate::mesh::placed::PlacedMesh;
use crate::mesh::solid::{MeshSolid, SolidView, SomePieces};

/// A placed mesh or a part of one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MeshPiece<'s> {
    pub(crate) part: PlacedMesh<'s>,
    /// A place on each piece of the part, in the frame of the mesh's input; `None` for a whole mesh.
    pub(crate) places: Option<&'s [[f64; 3]]>,
    /// The whole mesh, at the same pose.
    pub(crate) whole: &'s MeshHierarchy,
    /// The solid of the whole mesh.
    pub(crate) solid: &'s MeshSolid,
    /// The pieces of the whole mesh that count, if not all do.
    pub(crate) some: Option<SomePieces<'s>>,
}

impl<'s> MeshPiece<'s> {
    pub(crate) fn whole(mesh: PlacedMesh<'s>, solid: &'s MeshSolid) -> Self {
        Self { part: mesh, places: None, whole: mesh.mesh(), solid, some: None }
    }

    /// Returns `true` for a whole mesh.
    pub(crate) fn is_whole(&self) -> bool {
        self.places.is_none()
    }

    /// The solid of the mesh, whose arrays these are.
    pub(crate) fn solid_view(&self, view: &'s MeshView<'s>, level: Level) -> SolidView<'s> {
        let Self { whole: mesh, solid, some, .. } = *self;
        SolidView { mesh, view, solid, some, level }
    }

    /// Calls `is_met` with a place on each piece, in the frame of the mesh's input, until it returns `true`.
    /// `view` has the arrays of the whole mesh. Returns `true` if it did.
    pub(crate) fn any_place(&self, view: &MeshView<'_>, is_met: impl FnMut([f64; 3]) -> bool) -> bool {
        match self.places {
            Some(places) => places.iter().copied().any(is_met),
            None => self.solid.places(view).any(is_met),
        }
    }
}
