//! Time-critical collision: the most probable pair of nodes first (Klein & Zachmann, slides on
//! average-case collision detection, 2003).
//!
//! The search keeps the pairs of nodes in a queue by the probability that their surfaces collide
//! ([`CellTable`](crate::mesh::cell_table::CellTable)). It reports a collision as soon as `k_min`
//! pairs have reached the probability `p_min`. Bounding volumes alone prune pairs, so a separation
//! is exact; and pairs of leaves are decided exactly. Stopped by these two, a search therefore errs
//! by false hits only. A budget may stop it too.

use std::ops::ControlFlow;

use nearmiss_hierarchy::{Heap, NodePair, Open, PairVisitor, resume};
use nearmiss_lanes::wide::Bits;
use nearmiss_mesh::triangles_meet;

use crate::mesh::answer::{MeshAnswer, MeshVerdict};
use crate::mesh::cell_table::CellTable;
use crate::mesh::mesh_pair::MeshPairing;
use crate::mesh::odds::{Odds, OddsVisitor};
use crate::mesh::pair::MeshQuality;
use crate::mesh::region::region;

struct Search<'a> {
    pair: MeshPairing<'a>,
    /// Pairs with at most this probability of no collision count.
    threshold: f32,
    /// The number of such pairs at which the search stops.
    enough: u32,
    /// The number of such pairs so far.
    count: u32,
    /// The pair that is least likely not to collide, and that probability.
    best: (NodePair, f32),
    met: Option<[usize; 2]>,
}

impl PairVisitor for Search<'_> {
    #[inline]
    fn compared(&mut self, pairs: u32) -> ControlFlow<()> {
        self.pair.meter.spent.node_pairs += u64::from(pairs);
        if self.count >= self.enough {
            return ControlFlow::Break(());
        }
        self.pair.meter.go_on()
    }

    fn leaf_pair(&mut self, leaves: [usize; 2], _: &Open) -> ControlFlow<()> {
        for lane in Bits(self.pair.lanes_that_may_meet(leaves)) {
            let triangles = MeshPairing::triangles(leaves, lane);
            let [a, b] = self.pair.corners(triangles);
            if triangles_meet(&a, &b) {
                self.met = Some(triangles);
                return ControlFlow::Break(());
            }
        }
        self.pair.meter.go_on()
    }
}

impl OddsVisitor for Search<'_> {
    #[inline]
    fn likely(&mut self, pair: NodePair, fewer: f32) -> f32 {
        self.count += u32::from(fewer <= self.threshold);
        if fewer < self.best.1 {
            self.best = (pair, fewer);
        }
        fewer
    }
}

/// Decides whether two meshes meet, as well as `quality` and the budget ask for.
pub(crate) fn collide(
    pair: MeshPairing<'_>,
    quality: &MeshQuality,
    table: &CellTable,
    heap: &mut Heap,
) -> MeshAnswer {
    let relative = pair.relative;
    let level = pair.level;
    let odds = Odds {
        trees: [&pair.a.tree, &pair.b.tree],
        relative: &relative,
        cells: [pair.a.cells, pair.b.cells],
        table,
    };
    #[expect(clippy::cast_possible_truncation, reason = "a probability")]
    let threshold = (1.0 - quality.p_min) as f32;
    let mut search = Search {
        threshold,
        enough: if quality.p_min < 1.0 { quality.k_min } else { u32::MAX },
        count: 0,
        best: (NodePair::ROOTS, f32::INFINITY),
        met: None,
        pair,
    };
    heap.clear();
    heap.extend(std::iter::once(Open { pair: NodePair::ROOTS, key: 0.0 }));
    let mut flow = search.pair.meter.go_on();
    let apart = search.pair.gap > 0.0;
    if flow.is_continue() && !apart {
        flow = resume(&odds, level, heap, &mut search);
    }
    let (verdict, likelihood) = match search.met.and_then(|met| search.pair.contact(met)) {
        Some(contact) => (MeshVerdict::Intersecting(contact), 1.0),
        None if flow.is_break() && !apart => {
            let likelihood = f64::from(1.0 - search.best.1.min(1.0));
            (MeshVerdict::Undecided(region(&search.pair, search.best.0)), likelihood)
        }
        None => (MeshVerdict::Separated, 0.0),
    };
    MeshAnswer { verdict, likelihood, statistics: search.pair.meter.spent }
}
