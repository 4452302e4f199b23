//! All contacts of two meshes.

use std::ops::ControlFlow;

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{BoxVisitor, Open, PairVisitor, Stack, descend};
use nearmiss_lanes::wide::Bits;
use nearmiss_mesh::triangle_contact;

use crate::mesh::mesh_pair::MeshPairing;
use crate::mesh::penetration::triangle_depth::triangle_depth;
use crate::penetration::survey::{ContactSurvey, Surveyed};

type Vector = Vector3<f64>;

/// A search for all contacts.
struct Gathering<'c, 'a> {
    pair: &'c mut MeshPairing<'a>,
    survey: &'c mut ContactSurvey,
}

impl PairVisitor for Gathering<'_, '_> {
    fn compared(&mut self, pairs: u32) -> ControlFlow<()> {
        self.pair.meter.spent.node_pairs += u64::from(pairs);
        self.pair.meter.go_on()
    }

    fn leaf_pair(&mut self, leaves: [usize; 2], _: &Open) -> ControlFlow<()> {
        for lane in Bits(self.pair.lanes_that_may_meet(leaves)) {
            let [a, b] = self.pair.corners(MeshPairing::triangles(leaves, lane));
            let Some(contact) = triangle_contact(&a, &b) else { continue };
            let pose = self.pair.meshes[0].pose();
            let normals = contact.normals.map(|n| n.map_or(Vector::zeros(), |n| pose.rotate(n).into()));
            let depth = triangle_depth(&a, &b).0 * pose.scale();
            let point = pose.apply(contact.point).into();
            self.survey.add(Surveyed { point, normals, depths: [0.0; 2] }, depth);
        }
        self.pair.meter.go_on()
    }
}

impl BoxVisitor for Gathering<'_, '_> {}

/// Finds all contacts of a pair, as far as its budget lasts. Breaks if the budget ended the search.
pub(crate) fn survey(
    pair: &mut MeshPairing<'_>,
    stack: &mut Stack,
    survey: &mut ContactSurvey,
) -> ControlFlow<()> {
    survey.clear();
    stack.clear();
    let (relative, level) = (pair.relative, pair.level);
    let mut search = Gathering { pair, survey };
    let trees = search.pair.trees(&relative);
    descend(trees, level, stack, &mut search)
}
