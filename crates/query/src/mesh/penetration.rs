//! The penetration of two meshes: how far and in which direction to shift one out of the other.

mod contacts;
mod probe;
mod triangle_depth;

use fearless_simd::Level;
use nearmiss_hierarchy::{MeshHierarchy, MeshView, Stack};

use crate::ask::answer::Evidence;
use crate::ask::budget::Budget;
use crate::mesh::placed::PlacedMesh;
use crate::mesh::solid::{MeshSolid, SolidView, SomePieces};
use crate::penetration::answer::Penetration;
use crate::penetration::search::search;
use crate::penetration::survey::ContactSurvey;
use probe::MeshProbe;

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

/// Bounds the penetration of two placed meshes with these solids.
pub(crate) fn penetration(
    [a, b]: [PlacedMesh<'_>; 2],
    solids: [&MeshSolid; 2],
    budget: &Budget,
    working: (Level, &mut Stack),
    survey: &mut ContactSurvey,
) -> Penetration {
    if !(solids[0].is_of(a.mesh()) && solids[1].is_of(b.mesh())) {
        return Penetration::UNKNOWN;
    }
    of_pieces([MeshPiece::whole(a, solids[0]), MeshPiece::whole(b, solids[1])], budget, working, survey)
}

/// Bounds the penetration of two placed meshes or parts of meshes.
pub(crate) fn of_pieces(
    pieces: [MeshPiece<'_>; 2],
    budget: &Budget,
    (level, stack): (Level, &mut Stack),
    survey: &mut ContactSurvey,
) -> Penetration {
    let views = pieces.map(|piece| piece.part.mesh().arrays());
    let wholes = pieces.map(|piece| piece.whole.arrays());
    let mut probe = MeshProbe::new(pieces, [&views, &wholes], budget, (level, stack));
    let Some(out) = probe.out_of_balls() else { return Penetration::UNKNOWN };
    let bounds = search(&mut probe, out, survey);
    Penetration::new(&bounds, (1.0, |way| way.into()), (Evidence::Certified, 0.0), probe.spent)
}
