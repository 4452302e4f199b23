//! The depths of clashes of two scans.

use nearmiss_surface::Metric;

use crate::ask::answer::Contact;
use crate::ask::options::CollidePlan;
use crate::clash::default_link;
use crate::clash::depths::scan_part::{PartedScan, ScanPart};
use crate::clash::depths::{OfParts, depth, each};
use crate::clash::group::ContactGroup;
use crate::clash::stored::stored_of;
use crate::penetration::answer::{Interior, Penetration};
use crate::penetration::interior::counted;
use crate::penetration::scans::{Piece, of_pieces};
use crate::question::{Pair, Scratch};

impl Pair<'_> {
    /// Bounds, for each of some groups of contacts, how far b must at least be shifted so that the surfaces
    /// that meet at these contacts are separate there.
    ///
    /// Let B be the bounding box of the contacts of a group, grown by a length m to every side. The *part*
    /// of a scan is what of it is in B and linked to these contacts, by steps of at most four sampling
    /// radii from point to point. Of a [solid](Interior::Solid) scan it is everything in B, as all of its
    /// surface bounds its inside. The depth is the penetration of both parts for the smallest tried m that
    /// is at least twice its upper bound: then nothing from outside B comes within m/2 of the contacts.
    /// After the shift the parts are separate, and the part of one scan is not inside the other scan if
    /// that is solid. They may meet other pieces of a hollow scan.
    ///
    /// `contacts` are all contacts of the pair, and `whole` is the [penetration](Self::penetration) of the
    /// pair with the same plan and insides. The upper bound is never greater than that of `whole`, whose
    /// shift separates all groups at once. It is also the upper bound for a clash through which a
    /// scan passes, for scans of the geodesic metric, whose parts are not known, and if the budget ends the
    /// search too early.
    ///
    /// Parts are prepared as scans of their own, so a depth costs about a microsecond for each point around
    /// the clash, and some hundred collision queries. A scan with more than 200,000 points in a ball about
    /// B is used as a whole. Groups are shared among all threads; each query may spend the whole budget.
    /// Passes the share of the groups that are done to `told`, again and again. Indices of groups that are
    /// out of range are ignored. Allocates. Deterministic unless the budget has a deadline.
    #[must_use]
    pub fn depths(
        &self,
        (contacts, groups): (&[Contact], &[&ContactGroup]),
        (plan, interiors): (&CollidePlan, [Interior; 2]),
        whole: &Penetration,
        told: &mut dyn FnMut(f64),
    ) -> Vec<Penetration> {
        let scans = self.scans();
        let parted = [0, 1].map(|k: usize| PartedScan {
            scan: &scans[k],
            interior: counted(plan.options().semantics, interiors[k]),
            stored: stored_of(&scans[k], contacts, k),
        });
        let first = (0.5 * default_link(scans.each_ref())).max(plan.reach());
        let knows_parts = plan.options().metric != Some(Metric::Geodesic);
        each(groups, told, Scratch::default, |group, scratch| {
            if !knows_parts {
                return Penetration { lower: 0.0, ..*whole };
            }
            depth(&group.bounds, whole, (first, &self.budget), |bounds| {
                let parts = parted.each_ref().map(|scan| scan.part(group, bounds));
                if matches!(parts, [ScanPart::Whole, ScanPart::Whole]) {
                    return OfParts::Whole;
                }
                let [Some(a), Some(b)] = [0, 1].map(|k: usize| parts[k].of(&scans[k])) else {
                    return OfParts::Unknown;
                };
                let Scratch { contact, solid, penetration: own, .. } = &mut *scratch;
                let pieces = [Piece { part: a, whole: scans[0] }, Piece { part: b, whole: scans[1] }];
                let working = (contact, &mut solid.crossings);
                OfParts::Found(of_pieces(pieces, (plan, interiors), &self.budget, working, own))
            })
        })
    }
}
