//! The depths of clashes of a scan and a mesh.

use nearmiss_surface::Metric;

use crate::ask::answer::Contact;
use crate::clash::default_link;
use crate::clash::depths::mesh_part::{MeshPart, PartedMesh};
use crate::clash::depths::scan_part::{PartedScan, ScanPart};
use crate::clash::depths::{OfParts, depth, each};
use crate::clash::group::ContactGroup;
use crate::clash::stored::stored_of;
use crate::mesh::solid::MeshSolid;
use crate::mesh_scan::pair::MeshScanPair;
use crate::mesh_scan::penetration::of_pieces;
use crate::mesh_scan::plan::MeshScanPlan;
use crate::penetration::answer::{Interior, Penetration};
use crate::penetration::interior::counted;
use crate::penetration::scans::Piece;
use crate::question::Scratch;

impl MeshScanPair<'_> {
    /// Bounds, for each of some groups of contacts, how far the mesh must at least be shifted so that it is
    /// separate from the scan there.
    ///
    /// Has the definition, the bounds, the arguments and the cost of [`Pair::depths`](crate::Pair::depths);
    /// parts of the mesh are those of [`MeshPair::depths`](crate::MeshPair::depths). `whole` is the
    /// [penetration](Self::penetration) of the pair with the same plan and insides.
    #[must_use]
    pub fn depths(
        &self,
        (contacts, groups): (&[Contact], &[&ContactGroup]),
        (plan, interior, solid): (&MeshScanPlan, Interior, &MeshSolid),
        whole: &Penetration,
        told: &mut dyn FnMut(f64),
    ) -> Vec<Penetration> {
        let (scan, mesh) = (self.scan(), self.mesh());
        let interior_of_part = counted(plan.options().semantics, interior);
        let stored = stored_of(scan, contacts, 0);
        let parted_scan = PartedScan { scan, interior: interior_of_part, stored };
        let parted_mesh =
            PartedMesh::new(mesh, solid, || contacts.iter().map(|contact| contact.sources[1].0));
        let first = (0.5 * default_link([scan; 2])).max(plan.reach());
        let knows_parts = plan.options().metric != Some(Metric::Geodesic);
        each(groups, told, Scratch::default, |group, scratch| {
            if !knows_parts {
                return Penetration { lower: 0.0, ..*whole };
            }
            let at = parted_mesh.at(group);
            depth(&group.bounds, whole, (first, self.budget()), |bounds| {
                let of_scan = parted_scan.part(group, bounds);
                let of_mesh = at.part(bounds);
                if matches!((&of_scan, &of_mesh), (ScanPart::Whole, MeshPart::Whole)) {
                    return OfParts::Whole;
                }
                let (Some(part), Some(piece)) = (of_scan.of(scan), at.piece(&of_mesh)) else {
                    return OfParts::Unknown;
                };
                let Scratch { contact, solid: shapes, penetration: own, .. } = &mut *scratch;
                let (pieces, working) =
                    ((Piece { part, whole: *scan }, piece), (contact, &mut shapes.crossings));
                OfParts::Found(of_pieces(pieces, interior, (plan, self.budget()), working, own))
            })
        })
    }
}
