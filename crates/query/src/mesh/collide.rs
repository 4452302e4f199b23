//! Exact collision of two meshes: one contact, or all.

use std::ops::ControlFlow;

use nearmiss_hierarchy::{BoxVisitor, NodePair, Open, PairVisitor, Plunging, Stack, descend};
use nearmiss_lanes::wide::Bits;
use nearmiss_mesh::triangles_meet;

use crate::mesh::answer::{MeshAnswer, MeshContact, MeshVerdict};
use crate::mesh::mesh_pair::MeshPairing;
use crate::mesh::region::region;

/// A search for triangles that meet.
struct Search<'s, 'a> {
    pair: MeshPairing<'a>,
    /// The triangles that were found to meet first.
    met: Option<[usize; 2]>,
    /// All contacts, if requested.
    all: Option<&'s mut Vec<MeshContact>>,
}

impl PairVisitor for Search<'_, '_> {
    #[inline]
    fn compared(&mut self, pairs: u32) -> ControlFlow<()> {
        self.pair.meter.spent.node_pairs += u64::from(pairs);
        self.pair.meter.go_on()
    }

    fn leaf_pair(&mut self, leaves: [usize; 2], _: &Open) -> ControlFlow<()> {
        for lane in Bits(self.pair.lanes_that_may_meet(leaves)) {
            let triangles = MeshPairing::triangles(leaves, lane);
            if !self.pair.compares(triangles) {
                continue;
            }
            if let Some(all) = &mut self.all {
                if let Some(contact) = self.pair.contact(triangles) {
                    self.met.get_or_insert(triangles);
                    all.push(contact);
                }
            } else {
                let [a, b] = self.pair.corners(triangles);
                if triangles_meet(&a, &b) {
                    self.met = Some(triangles);
                    return ControlFlow::Break(());
                }
            }
        }
        self.pair.meter.go_on()
    }
}

impl BoxVisitor for Search<'_, '_> {}

/// Decides whether two meshes meet. `hint` has the triangles that met last.
pub(crate) fn collide(
    pair: MeshPairing<'_>,
    stack: &mut Stack,
    hint: Option<&mut Option<[u32; 2]>>,
    contacts: Option<(&mut Vec<MeshContact>, &mut bool)>,
) -> MeshAnswer {
    stack.clear();
    let (all, complete) = contacts.unzip();
    let mut search = Search { pair, met: None, all };
    let ended = search.run(stack, hint.as_deref().copied().flatten()).is_break();
    if let Some(complete) = complete {
        *complete = !ended;
    }
    if let Some(hint) = hint {
        *hint = search.met.map(|met| met.map(nearmiss_lanes::id32));
    }
    let (verdict, likelihood) = match search.met.and_then(|met| search.pair.contact(met)) {
        Some(contact) => (MeshVerdict::Intersecting(contact), 1.0),
        None if ended => (MeshVerdict::Undecided(region(&search.pair, NodePair::ROOTS)), 0.5),
        None => (MeshVerdict::Separated, 0.0),
    };
    MeshAnswer { verdict, likelihood, statistics: search.pair.meter.spent }
}

impl Search<'_, '_> {
    /// Searches from the pair of the roots on. Breaks if it was ended.
    fn run(&mut self, stack: &mut Stack, hint: Option<[u32; 2]>) -> ControlFlow<()> {
        if self.pair.gap > 0.0 {
            return ControlFlow::Continue(());
        }
        self.pair.meter.go_on()?;
        if self.all.is_none()
            && let Some([i, j]) = hint.map(|hint| hint.map(|i| i as usize))
            && i < self.pair.a.triangles.len()
            && j < self.pair.b.triangles.len()
        {
            let [a, b] = self.pair.corners([i, j]);
            if triangles_meet(&a, &b) {
                self.met = Some([i, j]);
                return ControlFlow::Break(());
            }
        }
        let (relative, level) = (self.pair.relative, self.pair.level);
        let trees = self.pair.trees(&relative);
        if self.all.is_none() {
            descend(trees, level, &mut Plunging::new(stack), self)
        } else {
            descend(trees, level, stack, self)
        }
    }
}
