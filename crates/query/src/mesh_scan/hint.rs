//! The state that queries of a mesh and a scan pass on to the next one.

use nearmiss_hierarchy::NodePair;

use crate::ask::options::CollideOptions;
use crate::mesh_scan::mesh_scan_pair::MeshScanPairing;
use crate::pair::clearance::Clearance;

/// Where a mesh and a scan met or were nearest in the last query, and how far apart they were proven to
/// be.
///
/// The next query compares the same leaves first. While the mesh has moved by less than it was apart, it
/// needs no search. A hint never changes a verdict, except one that a budget cuts short; the contact
/// and the proven gap may differ. It pays off for contacts, for certified separations and for
/// [`Semantics::Thickened`](crate::Semantics::Thickened).
///
/// Keep one for each pair. A hint of another pair or another question is ignored.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MeshScanHint {
    /// The leaves that met.
    pub(crate) met: Option<NodePair>,
    /// The nearest point and triangle.
    pub(crate) nearest: Option<[u32; 2]>,
    /// The question whose separation is known.
    clear: Option<(CollideOptions, Clearance)>,
}

impl MeshScanHint {
    /// A proven distance, in the world, that exceeds `reach`, from an earlier query.
    pub(crate) fn distance(
        &self,
        pair: &MeshScanPairing<'_>,
        options: &CollideOptions,
        reach: f64,
    ) -> Option<f64> {
        let (asked, known) = self.clear.as_ref()?;
        if asked != options {
            return None;
        }
        let left = known.at(pair.things(), &pair.stored, pair.b.ball, pair.relative.slack())?;
        (left > f64::from(pair.to_stored(reach)))
            .then(|| left * pair.scan.stored_to_world().scale() * (1.0 - 1e-9))
    }

    /// Remembers a separation that was proven to be `distance` wide in the world; `None` for a contact
    /// of these leaves, if known, or an estimated separation.
    pub(crate) fn keep(
        &mut self,
        pair: &MeshScanPairing<'_>,
        options: &CollideOptions,
        distance: Option<f64>,
        met: Option<NodePair>,
    ) {
        let clear = distance.and_then(|distance| {
            let stored = distance * (1.0 - 1e-9) / pair.scan.stored_to_world().scale();
            Clearance::new(pair.things(), &pair.stored, stored - f64::from(pair.relative.slack()))
        });
        self.clear = clear.map(|clear| (*options, clear));
        self.met = met;
    }
}
