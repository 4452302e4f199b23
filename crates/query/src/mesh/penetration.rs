//! The penetration of two meshes: how far and in which direction to shift one out of the other.

mod contacts;
pub(crate) mod piece;
mod probe;
mod triangle_depth;

use fearless_simd::Level;
use nearmiss_hierarchy::Stack;

use crate::ask::answer::Evidence;
use crate::ask::budget::Budget;
use crate::mesh::penetration::piece::MeshPiece;
use crate::mesh::placed::PlacedMesh;
use crate::mesh::solid::MeshSolid;
use crate::penetration::answer::Penetration;
use crate::penetration::search::{SearchScratch, search};
use probe::MeshProbe;

/// Bounds the penetration of two placed meshes with these solids.
pub(crate) fn penetration(
    [a, b]: [PlacedMesh<'_>; 2],
    solids: [&MeshSolid; 2],
    budget: &Budget,
    working: (Level, &mut Stack),
    scratch: &mut SearchScratch,
) -> Penetration {
    if !(solids[0].is_of(a.mesh()) && solids[1].is_of(b.mesh())) {
        return Penetration::UNKNOWN;
    }
    of_pieces([MeshPiece::whole(a, solids[0]), MeshPiece::whole(b, solids[1])], budget, working, scratch)
}

/// Bounds the penetration of two placed meshes or parts of meshes.
pub(crate) fn of_pieces(
    pieces: [MeshPiece<'_>; 2],
    budget: &Budget,
    (level, stack): (Level, &mut Stack),
    scratch: &mut SearchScratch,
) -> Penetration {
    let views = pieces.map(|piece| piece.part.mesh().arrays());
    let wholes = pieces.map(|piece| piece.whole.arrays());
    let mut probe = MeshProbe::new(pieces, [&views, &wholes], budget, (level, stack));
    let Some(out) = probe.out_of_balls() else { return Penetration::UNKNOWN };
    let bounds = search(&mut probe, out, scratch);
    Penetration::new(&bounds, (1.0, |way| way.into()), (Evidence::Certified, 0.0), probe.spent)
}
