//! The penetration of two meshes: how far and in which direction to shift one out of the other.

mod contacts;
mod probe;
mod triangle_depth;

use fearless_simd::Level;
use nearmiss_hierarchy::Stack;

use crate::ask::answer::Evidence;
use crate::ask::budget::Budget;
use crate::mesh::placed::PlacedMesh;
use crate::mesh::solid::MeshSolid;
use crate::penetration::answer::Penetration;
use crate::penetration::search::search;
use crate::penetration::survey::ContactSurvey;
use probe::MeshProbe;

/// Bounds the penetration of two placed meshes with these solids.
pub(crate) fn penetration(
    meshes: [PlacedMesh<'_>; 2],
    solids: [&MeshSolid; 2],
    budget: &Budget,
    (level, stack): (Level, &mut Stack),
    survey: &mut ContactSurvey,
) -> Penetration {
    if !(solids[0].is_of(meshes[0].mesh()) && solids[1].is_of(meshes[1].mesh())) {
        return Penetration::UNKNOWN;
    }
    let views = meshes.map(|placed| placed.mesh().arrays());
    let mut probe = MeshProbe::new(meshes, &views, solids, budget, (level, stack));
    let Some(out) = probe.out_of_balls() else { return Penetration::UNKNOWN };
    let bounds = search(&mut probe, out, survey);
    Penetration::new(&bounds, (1.0, |way| way.into()), (Evidence::Certified, 0.0), probe.spent)
}
