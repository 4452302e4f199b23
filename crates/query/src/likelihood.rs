//! How likely two scans meet when a budget ends the search.
//!
//! Boxes that share a centre mostly hold parts of surfaces that cross, boxes that just touch hardly ever: what tells is the
//! distance of the centres along each face normal, as a share of how far the boxes reach along it. The pair of open nodes
//! whose greatest share is least decides; how many others are open, how deep in absolute terms they overlap or how large
//! they are adds next to nothing. Chances of the share were counted on six objects near contact and in sweeps, with
//! budgets of 1 to 128 node pairs (docs/results; `calibration` of the benches repeats that).

use nearmiss_geometry::NodeId;
use nearmiss_hierarchy::NodePair;

use crate::posed::Posed;

/// Open pairs that are looked at, those next to be split first: a microsecond.
const LOOKED_AT: usize = 64;

/// The chance is 1/(1 + exp(−(`SLOPE`·s − `OFFSET`))) where s is one minus the share.
const SLOPE: f64 = 13.5;
const OFFSET: f64 = 4.65;

/// The chance that the pairs still open, or all if none was looked at, hide a contact or what is within `reach`.
pub(crate) fn likelihood(pair: &Posed<'_>, reach: f32, open: impl Iterator<Item = NodePair>) -> f64 {
    let together = |nodes: NodePair| {
        let (a, b) = (&pair.a.boxes[nodes.a.index()], &pair.b.boxes[nodes.b.index()]);
        f64::from(pair.relative.gaps_and_overlaps([a; 2], [b; 2], reach).1[0])
    };
    let mut open = open.take(LOOKED_AT).peekable();
    let roots = open.peek().is_none().then_some(NodePair { a: NodeId::ROOT, b: NodeId::ROOT });
    // What is no number, as of boxes that overflow, says nothing.
    let most = open.chain(roots).map(together).filter(|s| s.is_finite()).fold(0.0, f64::max);
    1.0 / (1.0 + (OFFSET - SLOPE * most).exp())
}
