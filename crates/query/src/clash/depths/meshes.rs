//! The depths of clashes of two meshes.

use nearmiss_geometry::Aabb;

use crate::clash::depths::mesh_part::{MeshPart, PartedMesh};
use crate::clash::depths::{OfParts, depth, each};
use crate::clash::group::ContactGroup;
use crate::mesh::answer::MeshContact;
use crate::mesh::pair::{MeshPair, MeshScratch};
use crate::mesh::penetration::of_pieces;
use crate::mesh::solid::MeshSolid;
use crate::penetration::answer::Penetration;

/// The first parts extend beyond the contacts at least by this share of the penetration of the meshes.
const LEAST: f64 = 1.0 / 32.0;

impl MeshPair<'_> {
    /// Bounds, for each of some groups of contacts, how far b must at least be shifted so that the triangles
    /// that meet at these contacts are separate there.
    ///
    /// Has the definition, the bounds and the arguments of [`Pair::depths`](crate::Pair::depths). The *part*
    /// of a mesh is those triangles whose bounding boxes meet B, the bounding box of the contacts grown by m,
    /// and that are linked to these contacts by common vertices of such triangles. Of a mesh with a closed
    /// part it is all triangles that meet B of the pieces with a contact, and of closed pieces around or
    /// inside of these; other pieces are no solids then. `whole` is the [penetration](Self::penetration) of
    /// the pair with the same `solids`.
    ///
    /// Parts are prepared as meshes of their own, so a depth costs about a microsecond for each triangle
    /// around the clash, and some hundred collision queries. A mesh with more than 200,000 triangles in a
    /// ball about B is used as a whole.
    #[must_use]
    pub fn depths(
        &self,
        (contacts, groups): (&[MeshContact], &[&ContactGroup]),
        solids: [&MeshSolid; 2],
        whole: &Penetration,
        told: &mut dyn FnMut(f64),
    ) -> Vec<Penetration> {
        let meshes = self.meshes();
        let parted = [0, 1].map(|k: usize| {
            PartedMesh::new(&meshes[k], solids[k], || contacts.iter().map(|contact| contact.triangles[k]))
        });
        each(groups, told, MeshScratch::default, |group, scratch| {
            let ends = group.contacts.iter().filter_map(|&i| contacts.get(i)).flat_map(|found| found.ends);
            let at = parted.each_ref().map(|mesh| mesh.at(group));
            depth(&Aabb::of(ends), whole, (LEAST * whole.upper, self.budget()), |bounds| {
                let parts = at.each_ref().map(|mesh| mesh.part(bounds));
                if matches!(parts, [MeshPart::Whole, MeshPart::Whole]) {
                    return OfParts::Whole;
                }
                let [Some(a), Some(b)] = [0, 1].map(|k: usize| at[k].piece(&parts[k])) else {
                    return OfParts::Unknown;
                };
                let (level, stack, search) = scratch.of_penetration();
                OfParts::Found(of_pieces([a, b], self.budget(), (level, stack), search))
            })
        })
    }
}
