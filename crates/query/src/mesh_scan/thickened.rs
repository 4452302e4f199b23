//! Balls of one radius about the points of a scan against the triangles of a mesh, decided exactly.

use std::ops::ControlFlow;

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{BoxVisitor, NodePair, Open, PairVisitor, Tree};

use crate::ask::answer::Contact;
use crate::mesh_scan::mesh_scan_pair::MeshScanPairing;
use crate::pair::pairing::{ItemPair, Pairing};

/// The search for a point within `reach` of a triangle.
pub(crate) struct Thickened<'s, 'a> {
    pub(crate) pair: MeshScanPairing<'a>,
    /// R + margin in the world.
    reach: f64,
    /// The same in the scan's stored frame, rounded up.
    pub(crate) reach_stored: f32,
    /// The nearest such point and triangle of each leaf pair, if all contacts are requested.
    pub(crate) all: Option<&'s mut Vec<Contact>>,
    /// The first such contact, its point and its triangle.
    pub(crate) found: Option<(Contact, [usize; 2])>,
    /// A lower bound of the distance of all that was compared or pruned, in the world.
    pub(crate) apart: f64,
}

impl<'s, 'a> Thickened<'s, 'a> {
    pub(crate) fn new(pair: MeshScanPairing<'a>, reach: f64, all: Option<&'s mut Vec<Contact>>) -> Self {
        let reach_stored = pair.to_stored(reach);
        Self { pair, reach, reach_stored, all, found: None, apart: f64::INFINITY }
    }
}

impl PairVisitor for Thickened<'_, '_> {
    #[inline]
    fn compared(&mut self, pairs: u32) -> ControlFlow<()> {
        self.pair.meter.spent.node_pairs += u64::from(pairs);
        self.pair.meter.go_on()
    }

    fn leaf_pair(&mut self, leaves: [usize; 2], open: &Open) -> ControlFlow<()> {
        self.compare(leaves, open.pair)
    }
}

impl Thickened<'_, '_> {
    /// Compares the leaves that met last, if there are any and one contact will do. Breaks if they
    /// meet again.
    pub(crate) fn compare_first(&mut self, met: Option<NodePair>) -> ControlFlow<()> {
        let Some(nodes) = met.filter(|&nodes| self.all.is_none() && self.pair.are_leaves(nodes)) else {
            return ControlFlow::Continue(());
        };
        let number = |tree: &Tree<'_>, node| tree.topology().leaf_number(node);
        let flow =
            self.compare([number(&self.pair.a.tree, nodes.a), number(&self.pair.b.tree, nodes.b)], nodes);
        self.apart = f64::INFINITY;
        flow
    }

    fn compare(&mut self, leaves: [usize; 2], nodes: NodePair) -> ControlFlow<()> {
        self.pair.count(leaves);
        let best = ItemPair { distance: self.apart, items: [0; 2] };
        let ItemPair { distance, items } = self.pair.nearest_items(nodes, best);
        if distance > self.reach || distance == self.apart {
            self.apart = distance;
            return self.pair.meter.go_on();
        }
        let (_, foot) = self.pair.apart(items[0], &self.pair.corners(items[1]));
        let p = Vector3::from(self.pair.a.position(items[0]).map(f64::from));
        let contact = Contact {
            point: self.pair.scan.stored_to_world().apply((0.5 * (p + Vector3::from(foot))).into()),
            normals: None,
            residual: 0.5 * distance,
            sources: self.pair.sources(items),
        };
        self.found.get_or_insert((contact, items));
        let Some(all) = &mut self.all else { return ControlFlow::Break(()) };
        all.push(contact);
        self.pair.meter.go_on()
    }
}

impl BoxVisitor for Thickened<'_, '_> {
    const NOTES_GAPS: bool = true;

    #[inline]
    fn least_apart(&mut self, least: f32) {
        let bound = f64::from(least - self.pair.relative.slack()) * self.pair.scan.stored_to_world().scale();
        self.apart = self.apart.min(bound);
    }
}
