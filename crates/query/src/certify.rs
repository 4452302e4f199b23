//! Certificates of separation: what boxes of discs parted is parted again by enclosures, which provably contain
//! the surfaces.
//!
//! The search notes the pairs of nodes that its tight boxes exclude; together they cover all pairs of points.
//! A pair whose enclosures are disjoint is proven; one whose enclosures overlap is replaced by its children. The
//! certificate is whole when no pair of leaves overlaps, and given up at the first that does. The pairs are taken
//! last first: what was excluded last lies deepest, and is the likeliest to fail.

use std::ops::ControlFlow;

use nearmiss_geometry::NodeId;
use nearmiss_hierarchy::{Frontier, NodePair, Split, Stack, Visitor, resume};

use crate::posed::Posed;

/// Pairs of either of `a` with either of `b`, of which those in `mask` were excluded.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Excluded {
    pub(crate) a: [NodeId; 2],
    pub(crate) b: [NodeId; 2],
    pub(crate) mask: [bool; 4],
}

/// A proof that two scans are apart: pairs of nodes with disjoint enclosures, which together cover the pair of the
/// roots.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Proof {
    /// The pairs, with a lower bound of the distance of their enclosures in world units.
    pub pairs: Vec<(NodePair, f64)>,
}

/// The search for a pair of leaves whose enclosures are not apart.
pub(crate) struct Certifier<'a, 'p> {
    pub(crate) pair: Posed<'a>,
    /// Enclosures must be further apart than this, in a's stored frame.
    reach: f32,
    /// A lower bound of the distance of all pairs proven so far, in the world.
    pub(crate) gap: f64,
    proof: Option<&'p mut Proof>,
}

impl<'a, 'p> Certifier<'a, 'p> {
    pub(crate) fn new(pair: Posed<'a>, reach: f32, proof: Option<&'p mut Proof>) -> Self {
        Self { pair, reach, gap: f64::INFINITY, proof }
    }

    /// Proves all of `excluded`, or breaks.
    pub(crate) fn prove(&mut self, excluded: &[Excluded], stack: &mut Stack) -> ControlFlow<()> {
        let (a, b) = (self.pair.a.nodes, self.pair.b.nodes);
        stack.clear();
        for group in excluded.iter().rev() {
            let admitted = self.overlaps(group.a, group.b, group.mask);
            let pair = |i: usize| (admitted[i], NodePair { a: group.a[i >> 1], b: group.b[i & 1] });
            stack.push([pair(0), pair(1), pair(2), pair(3)]);
            resume(a, b, self, stack)?;
        }
        ControlFlow::Continue(())
    }

    /// The depth of overlap of those pairs in `mask` whose enclosures are not apart.
    #[inline]
    fn overlaps(&mut self, a: [NodeId; 2], b: [NodeId; 2], mask: [bool; 4]) -> [Option<f32>; 4] {
        let enclosures_a = a.map(|id| &self.pair.a.enclosures[id.index()]);
        let enclosures_b = b.map(|id| &self.pair.b.enclosures[id.index()]);
        let gaps = self.pair.relative.gaps(enclosures_a, enclosures_b);
        let mut overlaps = [None; 4];
        for i in 0..4 {
            if !mask[i] {
                continue;
            }
            self.pair.meter.spent.node_pairs += 1;
            if gaps[i] > self.reach {
                let bound = bound(&self.pair, gaps[i]);
                self.gap = self.gap.min(bound);
                if let Some(proof) = &mut self.proof {
                    proof.pairs.push((NodePair { a: a[i >> 1], b: b[i & 1] }, bound));
                }
            } else {
                overlaps[i] = Some(-gaps[i]);
            }
        }
        overlaps
    }
}

/// What a gap in a's stored frame proves in the world.
fn bound(pair: &Posed<'_>, gap: f32) -> f64 {
    let slack = pair.relative.slack();
    // Less the rounding of the scale and of the product.
    f64::from(gap - slack) * pair.views[0].placed().scale() * (1.0 - 1e-9)
}

impl Visitor for Certifier<'_, '_> {
    #[inline]
    fn admit(&mut self, a: [NodeId; 2], b: [NodeId; 2], _count: u8) -> [Option<f32>; 4] {
        self.overlaps(a, b, distinct(a, b))
    }

    /// Two leaves that nothing parts.
    fn leaves(&mut self, _pair: NodePair) -> ControlFlow<()> {
        ControlFlow::Break(())
    }

    #[inline]
    fn split(&self, pair: NodePair) -> Split {
        self.pair.split(pair)
    }

    #[inline]
    fn go_on(&mut self) -> ControlFlow<()> {
        self.pair.meter.go_on()
    }
}

/// Which of the four pairs are not doubles of others.
#[inline]
pub(crate) fn distinct(a: [NodeId; 2], b: [NodeId; 2]) -> [bool; 4] {
    let (two_a, two_b) = (a[0] != a[1], b[0] != b[1]);
    [true, two_b, two_a, two_a && two_b]
}
