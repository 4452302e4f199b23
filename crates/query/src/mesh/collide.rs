//! Exact collision of two meshes: one contact, or all.

use std::ops::ControlFlow;

use nearmiss_hierarchy::{BoxVisitor, NodePair, Open, PairVisitor, Plunging, Stack, descend};
use nearmiss_lanes::wide::Bits;
use nearmiss_mesh::{triangle_distance, triangles_meet};

use crate::mesh::answer::{MeshAnswer, MeshContact, MeshVerdict};
use crate::mesh::hint::MeshHint;
use crate::mesh::mesh_pair::MeshPairing;
use crate::mesh::region::region;

/// A search for triangles that meet.
struct Search<'s, 'a> {
    pair: &'s mut MeshPairing<'a>,
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

/// The same search, which also finds a lower bound of the distance of meshes that do not meet.
struct Measuring<'x, 's, 'a> {
    search: &'x mut Search<'s, 'a>,
    /// The bound so far, in a's stored frame.
    apart: f64,
}

impl PairVisitor for Measuring<'_, '_, '_> {
    #[inline]
    fn compared(&mut self, pairs: u32) -> ControlFlow<()> {
        self.search.compared(pairs)
    }

    fn leaf_pair(&mut self, leaves: [usize; 2], _: &Open) -> ControlFlow<()> {
        let pair = &mut *self.search.pair;
        let (gaps, lanes) = (pair.least_distances(leaves), pair.lanes(leaves));
        for lane in Bits(lanes) {
            let mut gap = f64::from(gaps[lane]);
            if gap <= 0.0 {
                let triangles = MeshPairing::triangles(leaves, lane);
                let [a, b] = pair.corners(triangles);
                if triangles_meet(&a, &b) {
                    self.search.met = Some(triangles);
                    return ControlFlow::Break(());
                }
                gap = pair.to_stored(triangle_distance(&a, &b).distance);
            }
            self.apart = self.apart.min(gap);
        }
        pair.meter.go_on()
    }
}

impl BoxVisitor for Measuring<'_, '_, '_> {
    const NOTES_GAPS: bool = true;

    #[inline]
    fn least_apart(&mut self, least: f32) {
        self.apart = self.apart.min(f64::from(least - self.search.pair.relative.slack()));
    }
}

/// Decides whether two meshes meet, from what `hint` knows if possible.
pub(crate) fn collide(
    pair: &mut MeshPairing<'_>,
    stack: &mut Stack,
    mut hint: Option<&mut MeshHint>,
    contacts: Option<(&mut Vec<MeshContact>, &mut bool)>,
) -> MeshAnswer {
    stack.clear();
    let (all, complete) = contacts.unzip();
    let mut search = Search { pair, met: None, all };
    let ended = match hint.as_deref_mut() {
        Some(hint) => search.run_hinted(stack, hint),
        None => search.run(stack),
    };
    let ended = ended.is_break();
    if let Some(complete) = complete {
        *complete = !ended;
    }
    if let Some(hint) = hint {
        hint.met = search.met.map(|met| met.map(nearmiss_lanes::id32));
    }
    let (verdict, likelihood) = match search.met.and_then(|met| search.pair.contact(met)) {
        Some(contact) => (MeshVerdict::Intersecting(contact), 1.0),
        None if ended => (MeshVerdict::Undecided(region(search.pair, NodePair::ROOTS)), 0.5),
        None => (MeshVerdict::Separated, 0.0),
    };
    MeshAnswer { verdict, likelihood, statistics: search.pair.meter.spent }
}

/// Looks for two triangles that meet. Breaks if the search was ended, by a contact or by the budget.
pub(crate) fn first_met(
    pair: &mut MeshPairing<'_>,
    stack: &mut Stack,
) -> (ControlFlow<()>, Option<[usize; 2]>) {
    stack.clear();
    let mut search = Search { pair, met: None, all: None };
    let flow = search.run(stack);
    (flow, search.met)
}

impl Search<'_, '_> {
    /// Searches from the pair of the roots on. Breaks if it was ended.
    fn run(&mut self, stack: &mut Stack) -> ControlFlow<()> {
        if self.pair.gap > 0.0 {
            return ControlFlow::Continue(());
        }
        self.pair.meter.go_on()?;
        let (relative, level) = (self.pair.relative, self.pair.level);
        let trees = self.pair.trees(&relative);
        if self.all.is_none() {
            descend(trees, level, &mut Plunging::new(stack), self)
        } else {
            descend(trees, level, stack, self)
        }
    }

    /// The same for one contact, from what is known. Updates the clearance.
    fn run_hinted(&mut self, stack: &mut Stack, hint: &mut MeshHint) -> ControlFlow<()> {
        if self.pair.is_clear(hint.clear.as_ref()) {
            return ControlFlow::Continue(());
        }
        hint.clear = None;
        self.pair.meter.go_on()?;
        if let Some([i, j]) = hint.met.map(|met| met.map(|i| i as usize))
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
        let balls = self.pair.gap / self.pair.meshes[0].stored_to_world().scale();
        let mut measuring = Measuring { search: self, apart: f64::INFINITY };
        if balls > 0.0 {
            measuring.apart = balls;
        } else {
            let trees = measuring.search.pair.trees(&relative);
            descend(trees, level, &mut Plunging::new(stack), &mut measuring)?;
        }
        let apart = measuring.apart;
        hint.clear = self.pair.clearance(apart);
        ControlFlow::Continue(())
    }
}
