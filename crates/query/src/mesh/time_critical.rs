//! Time-critical collision: the most probable pair of nodes first (Klein & Zachmann, slides on
//! average-case collision detection, 2003).
//!
//! The search keeps the pairs of nodes in a queue by the probability that their surfaces collide
//! ([`CellTable`]). It reports a collision as soon as `k_min`
//! pairs have reached the probability `p_min`. Bounding volumes alone prune pairs, so a separation
//! is exact; and pairs of leaves are decided exactly. Stopped by these two, a search therefore errs
//! by false hits only. A budget may stop it too.

use std::ops::ControlFlow;

use nearmiss_hierarchy::{Heap, NodePair, Open, PairVisitor, resume};
use nearmiss_lanes::wide::Bits;
use nearmiss_mesh::triangles_meet;

use crate::mesh::answer::{MeshAnswer, MeshVerdict};
use crate::mesh::mesh_pair::MeshPairing;
use crate::mesh::odds::{Odds, OddsVisitor};
use crate::mesh::quality::MeshQuality;
use crate::mesh::region::region;
use crate::pair::cell_table::CellTable;

struct Search<'a> {
    pair: MeshPairing<'a>,
    table: &'a CellTable,
    /// Pairs with at most this probability of no collision count; negative if none counts.
    threshold: f32,
    /// The number of such pairs at which the search stops.
    enough: u32,
    /// The number of such pairs so far.
    count: u32,
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
    fn overlapping(&mut self, _: NodePair, filled: [f32; 2]) {
        if self.threshold >= 0.0 {
            self.count += u32::from(self.table.fewer(filled) <= self.threshold);
        }
    }
}

/// The number of open pairs from which the likelihood of a contact is estimated.
const LOOKED_AT: usize = 16;

/// The likelihood that open pairs contain a contact. Their keys are the negated numbers of cells
/// that both surfaces are expected to fill; the sum Λ of the greatest numbers decides.
///
/// A logistic function of ln Λ, fitted to five objects against themselves with equal weight, at 16
/// to 256 node pairs (docs/theory/meshes.md).
fn likelihood(open: &[Open]) -> f64 {
    let sum: f64 = open.iter().take(LOOKED_AT).map(|open| -f64::from(open.key)).sum();
    let logit = LIKELIHOOD[0] + LIKELIHOOD[1] * sum.max(1e-9).ln();
    1.0 / (1.0 + (-logit).exp())
}

/// The constant and the factor of ln Λ.
const LIKELIHOOD: [f64; 2] = [-9.68, 2.86];

/// Decides whether two meshes meet, as well as `quality` and the budget ask for.
pub(crate) fn collide<'a>(
    pair: MeshPairing<'a>,
    quality: &MeshQuality,
    table: &'a CellTable,
    (heap, open): (&mut Heap, &mut Vec<Open>),
) -> MeshAnswer {
    let relative = pair.relative;
    let level = pair.level;
    let odds = Odds {
        trees: [&pair.a.tree, &pair.b.tree],
        relative: &relative,
        cells: [pair.a.cells, pair.b.cells],
    };
    #[expect(clippy::cast_possible_truncation, reason = "a probability")]
    let threshold = if quality.p_min < 1.0 { (1.0 - quality.p_min) as f32 } else { -1.0 };
    let mut search = Search { table, threshold, enough: quality.k_min.max(1), count: 0, met: None, pair };
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
            open.clear();
            open.extend(heap.drain());
            let most = LOOKED_AT.min(open.len());
            // Equal keys come in the order of their nodes.
            let order = |a: &Open, b: &Open| a.key.total_cmp(&b.key).then(a.pair.cmp(&b.pair));
            if most > 0 {
                open.select_nth_unstable_by(most - 1, order);
                open[..most].sort_unstable_by(order);
            }
            // Before the first comparison nothing is known.
            let is_compared = search.pair.meter.spent.node_pairs > 0;
            let likelihood = if is_compared { likelihood(open) } else { 0.5 };
            // Enough pairs are likely to collide, which the open pairs alone may not show.
            let likelihood = if search.count >= search.enough { likelihood.max(0.5) } else { likelihood };
            let best = open.first().map_or(NodePair::ROOTS, |open| open.pair);
            (MeshVerdict::Undecided(region(&search.pair, best)), likelihood)
        }
        None => (MeshVerdict::Separated, 0.0),
    };
    MeshAnswer { verdict, likelihood, statistics: search.pair.meter.spent }
}
