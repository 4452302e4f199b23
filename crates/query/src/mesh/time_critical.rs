//! Time-critical collision: the most probable pair of nodes first (Klein & Zachmann, slides on
//! average-case collision detection, 2003).
//!
//! The search orders the pairs of nodes by the probability that their surfaces collide
//! ([`CellTable`]). It reports a collision as soon as `k_min` pairs have reached the probability
//! `p_min`. Bounding volumes alone prune pairs, so a separation is exact; and pairs of leaves are
//! decided exactly. Stopped by these two, a search therefore errs by false hits only. A budget may
//! stop it too.
//!
//! The slides keep all pairs in a priority queue. So does a search with a budget: when it ends, only less
//! probable pairs are left. Without a budget, the search continues with the most probable child of the
//! last pair ([`Plunging`]). That takes about a seventh less time, with as many wrong answers
//! (docs/theory/meshes.md).

use std::ops::ControlFlow;

use nearmiss_hierarchy::{Frontier, Heap, NodePair, Open, PairVisitor, Plunging, Stack, resume};
use nearmiss_lanes::wide::Bits;
use nearmiss_mesh::triangles_meet;

use crate::mesh::answer::{MeshAnswer, MeshVerdict};
use crate::mesh::mesh_pair::MeshPairing;
use crate::mesh::odds::{Odds, OddsVisitor};
use crate::mesh::quality::MeshQuality;
use crate::mesh::region::region;
use crate::pair::cell_table::CellTable;

struct Search<'s, 'a> {
    pair: &'s mut MeshPairing<'a>,
    table: &'s CellTable,
    /// Pairs with at most this probability of no collision count; negative if none counts.
    threshold: f32,
    /// The least expected number of shared cells of pairs that may count; infinite if none counts.
    least: f32,
    /// The number of such pairs at which the search stops.
    enough: u32,
    /// The number of such pairs so far.
    count: u32,
    met: Option<[usize; 2]>,
}

impl PairVisitor for Search<'_, '_> {
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

impl OddsVisitor for Search<'_, '_> {
    #[inline]
    fn least_expected(&self) -> f32 {
        self.least
    }

    #[inline]
    fn likely(&mut self, filled: [f32; 2]) -> ControlFlow<()> {
        self.count += u32::from(self.table.fewer(filled) <= self.threshold);
        if self.count >= self.enough { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// The number of open pairs from which the likelihood of a contact is estimated.
const LOOKED_AT: usize = 16;

/// Moves the most probable of the open pairs to the front, [`LOOKED_AT`] at most. Returns them, and
/// the first of all.
fn most_probable(open: &mut [Open]) -> (&[Open], NodePair) {
    // Equal keys come in the order of their nodes.
    let order = |a: &Open, b: &Open| a.key.total_cmp(&b.key).then(a.pair.cmp(&b.pair));
    if open.len() > LOOKED_AT {
        open.select_nth_unstable_by(LOOKED_AT, order);
    }
    let most = &open[..LOOKED_AT.min(open.len())];
    (most, most.iter().copied().min_by(order).map_or(NodePair::ROOTS, |open| open.pair))
}

/// The likelihood that open pairs contain a contact. The keys of the most probable ones are the
/// negated numbers of cells that both surfaces are expected to fill; the sum Λ of the numbers decides.
///
/// A logistic function of ln Λ, fitted to five objects against themselves with equal weight, at 1 to
/// 256 node pairs (docs/theory/meshes.md).
fn likelihood(most: &[Open]) -> f64 {
    let sum: f64 = most.iter().map(|open| -f64::from(open.key)).sum();
    let logit = LIKELIHOOD[0] + LIKELIHOOD[1] * sum.max(1e-9).ln();
    1.0 / (1.0 + (-logit).exp())
}

/// The constant and the factor of ln Λ.
const LIKELIHOOD: [f64; 2] = [-6.91, 2.12];

/// Decides whether two meshes meet, as well as `quality` and the budget ask for.
pub(crate) fn collide(
    pair: &mut MeshPairing<'_>,
    quality: &MeshQuality,
    table: &CellTable,
    may_end: bool,
    memory: (&mut Heap, &mut Stack, &mut Vec<Open>),
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
    let least = if threshold < 0.0 { f32::INFINITY } else { table.least_expected(threshold) };
    let mut search =
        Search { table, threshold, least, enough: quality.k_min.max(1), count: 0, met: None, pair };
    let (heap, stack, open) = memory;
    let roots = Open { pair: NodePair::ROOTS, key: 0.0 };
    open.clear();
    let apart = search.pair.gap > 0.0;
    let mut flow = search.pair.meter.go_on();
    if flow.is_break() {
        open.push(roots);
    } else if !apart && may_end {
        heap.clear();
        heap.push(roots);
        flow = resume(&odds, level, heap, &mut search);
        open.extend(heap.drain());
    } else if !apart {
        stack.clear();
        stack.push(roots);
        flow = resume(&odds, level, &mut Plunging::new(stack), &mut search);
        open.extend(stack.drain());
    }
    let (verdict, likelihood) = match search.met.and_then(|met| search.pair.contact(met)) {
        Some(contact) => (MeshVerdict::Intersecting(contact), 1.0),
        None if flow.is_break() && !apart => {
            let (most, best) = most_probable(open);
            // Before the first comparison nothing is known.
            let is_compared = search.pair.meter.spent.node_pairs > 0;
            let likelihood = if is_compared { likelihood(most) } else { 0.5 };
            // Enough pairs are likely to collide, which the open pairs alone may not show.
            let likelihood = if search.count >= search.enough { likelihood.max(0.5) } else { likelihood };
            (MeshVerdict::Undecided(region(search.pair, best)), likelihood)
        }
        None => (MeshVerdict::Separated, 0.0),
    };
    MeshAnswer { verdict, likelihood, statistics: search.pair.meter.spent }
}
