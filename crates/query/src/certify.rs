//! Certificates of separation: what boxes of discs parted is parted again by enclosures, which provably contain
//! the surfaces.
//!
//! A search that looks at pairs of boxes one by one notes those that its tight boxes exclude; together they cover all pairs
//! of points. A pair whose enclosures are disjoint is proven; one whose enclosures overlap is replaced by its children. The
//! certificate is whole when no pair of leaves overlaps, and given up at the first that does. The nearest
//! pairs are taken first: they are the likeliest to fail. After a search that looks at sixteen pairs at a time and notes nothing the
//! proof begins with the roots, and takes what overlaps most first, for the same reason.
//!
//! A certificate that stops at the first volumes that are disjoint proves little distance. So the pair with the least bound
//! is split further, for about an eighth as long as all took before.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::ops::ControlFlow;

use nearmiss_geometry::NodeId;
use nearmiss_hierarchy::{Frontier, NodePair, Part, Split, Stack, Visitor, descend, resume};

use crate::posed::{Posed, balls_apart};

/// Pairs of either of `a` with either of `b`, some of which were excluded.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Excluded {
    pub(crate) a: [NodeId; 2],
    pub(crate) b: [NodeId; 2],
    /// How far the boxes of those that were excluded are apart.
    pub(crate) gaps: [Option<f32>; 4],
}

impl Excluded {
    /// The pairs that were excluded, with their gaps.
    pub(crate) fn pairs(&self) -> impl Iterator<Item = (f32, NodePair)> {
        let pair = |i: usize| NodePair { a: self.a[i >> 1], b: self.b[i & 1] };
        (0..4).filter_map(move |i| Some((self.gaps[i]?, pair(i))))
    }
}

/// A proof that two scans are apart: pairs of nodes with disjoint enclosures, which together cover the pair of the
/// roots.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Proof {
    /// The pairs, with a lower bound of the distance of their enclosures in world units.
    pub pairs: Vec<(NodePair, f64)>,
}

/// A pair of nodes whose parts of the surfaces are this far apart, in a's stored frame. Ordered so that the least is
/// greatest.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bound {
    pub(crate) gap: f32,
    pub(crate) pair: NodePair,
    /// The pair, or one of its ancestors, whose enclosures show it.
    shown_by: NodePair,
}

impl Ord for Bound {
    fn cmp(&self, other: &Self) -> Ordering {
        let key = |bound: &Self| (bound.pair.a.0, bound.pair.b.0);
        other.gap.total_cmp(&self.gap).then_with(|| key(other).cmp(&key(self)))
    }
}

impl PartialOrd for Bound {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Bound {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Bound {}

/// So many node pairs are compared for a better bound even where hardly any were needed before: a microsecond.
const LEAST_SPLITS: u64 = 16;

/// The search for a pair of leaves whose enclosures are not apart.
pub(crate) struct Certifier<'a> {
    pub(crate) pair: Posed<'a>,
    /// Enclosures must be further apart than this, in a's stored frame.
    pub(crate) reach: f32,
    /// What was proven.
    pub(crate) proven: &'a mut Vec<Bound>,
    /// Leaves whose enclosures are not apart.
    pub(crate) doubtful: Option<NodePair>,
}

impl<'a> Certifier<'a> {
    pub(crate) fn new(pair: Posed<'a>, reach: f32, proven: &'a mut Vec<Bound>) -> Self {
        proven.clear();
        Self { pair, reach, proven, doubtful: None }
    }

    /// Proves all of `excluded`, or all there is if nothing was noted; or breaks.
    pub(crate) fn prove(&mut self, excluded: Option<&[Excluded]>, stack: &mut Stack) -> ControlFlow<()> {
        let (a, b) = (self.pair.a.nodes, self.pair.b.nodes);
        let Some(excluded) = excluded else { return descend(a, b, self, stack) };
        stack.clear();
        for group in excluded.iter().rev() {
            let admitted = self.overlaps(group.a, group.b, group.gaps.map(|gap| gap.is_some()));
            let pair = |i: usize| (admitted[i], NodePair { a: group.a[i >> 1], b: group.b[i & 1] });
            stack.push([pair(0), pair(1), pair(2), pair(3)]);
            resume(a, b, self, stack)?;
        }
        ControlFlow::Continue(())
    }

    /// Proves all of `excluded`, or all there is if nothing was noted, and hands the proof out. Returns the
    /// least gap, in the world, and the band there; `None` where the proof fails.
    pub(crate) fn prove_apart(
        &mut self,
        excluded: Option<&[Excluded]>,
        stack: &mut Stack,
        proof: Option<&mut Proof>,
    ) -> Option<(f64, f64)> {
        if excluded.is_none() {
            self.proven.clear();
        }
        if self.prove(excluded, stack).is_break() {
            return None;
        }
        let distance = self.tighten();
        if let Some(proof) = proof {
            self.hand_out(proof);
        }
        let roots = NodePair { a: NodeId::ROOT, b: NodeId::ROOT };
        Some((distance, self.pair.band_of(self.nearest().unwrap_or(roots))))
    }

    /// Proves these pairs of leaves, which were compared without a hit; or breaks. Their boxes overlap, and
    /// so do their enclosures: only of obstacles may their points tell more.
    pub(crate) fn prove_leaves(&mut self, compared: &[NodePair]) -> ControlFlow<()> {
        for &pair in compared {
            let gap = match self.pair.part {
                Part::Obstacle => self.pair.gap_of_leaves(pair),
                Part::Surface => f32::MIN,
            };
            if gap.is_nan() || gap <= self.reach {
                self.doubtful = Some(pair);
                return ControlFlow::Break(());
            }
            self.proven.push(Bound { gap, pair, shown_by: pair });
        }
        ControlFlow::Continue(())
    }

    /// Splits the pair with the least bound again and again, until that is two leaves, or an eighth as many node pairs
    /// more were compared as until now. The least bound of all then, in the world.
    pub(crate) fn tighten(&mut self) -> f64 {
        let most = self.pair.meter.spent.node_pairs + self.pair.meter.spent.node_pairs / 8 + LEAST_SPLITS;
        let mut heap = BinaryHeap::from(std::mem::take(self.proven));
        while let Some(&least) = heap.peek() {
            let pair = least.pair;
            let nodes = (&self.pair.a.nodes[pair.a.index()], &self.pair.b.nodes[pair.b.index()]);
            let Some([a, b]) = pair.split(nodes.0, nodes.1, || self.pair.split(pair)) else { break };
            if self.pair.meter.spent.node_pairs >= most || self.pair.meter.go_on().is_break() {
                break;
            }
            let (gaps, mask) = (self.pair.gaps_of_enclosures(a, b), distinct(a, b));
            self.pair.meter.spent.node_pairs += mask.iter().map(|&counts| u64::from(counts)).sum::<u64>();
            heap.pop();
            for i in (0..4).filter(|&i| mask[i]) {
                let pair = NodePair { a: a[i >> 1], b: b[i & 1] };
                // Its part is in that of its parents: what is proven of these holds.
                let own = gaps[i] > least.gap;
                heap.push(Bound {
                    gap: if own { gaps[i] } else { least.gap },
                    pair,
                    shown_by: if own { pair } else { least.shown_by },
                });
            }
        }
        let least = heap.peek().map_or(f64::INFINITY, |least| self.in_world(least.gap));
        *self.proven = heap.into_vec();
        // Along the axes of boxes little is seen of a distance between them.
        let balls = balls_apart(self.pair.views, self.pair.part) / self.pair.views[0].placed().scale();
        #[expect(clippy::cast_possible_truncation, reason = "lessened by more than the rounding")]
        let gap = (balls * (1.0 - 1e-6)) as f32;
        if self.in_world(gap) <= least {
            return least;
        }
        let roots = NodePair { a: NodeId::ROOT, b: NodeId::ROOT };
        self.proven.clear();
        self.proven.push(Bound { gap, pair: roots, shown_by: roots });
        self.in_world(gap)
    }

    /// The pair that was proven with the least gap. The last that [`Self::tighten`] left comes first.
    pub(crate) fn nearest(&self) -> Option<NodePair> {
        self.proven.first().map(|bound| bound.pair)
    }

    /// What was proven, in the world.
    pub(crate) fn hand_out(&self, proof: &mut Proof) {
        proof.pairs.extend(self.proven.iter().map(|bound| (bound.shown_by, self.in_world(bound.gap))));
    }

    /// What a gap in a's stored frame proves in the world.
    fn in_world(&self, gap: f32) -> f64 {
        let slack = self.pair.relative.slack();
        // Less the rounding of the scale and of the product.
        f64::from(gap - slack) * self.pair.views[0].placed().scale() * (1.0 - 1e-9)
    }

    /// The depth of overlap of those pairs in `mask` whose enclosures are not apart.
    #[inline]
    fn overlaps(&mut self, a: [NodeId; 2], b: [NodeId; 2], mask: [bool; 4]) -> [Option<f32>; 4] {
        let gaps = self.pair.gaps_of_enclosures(a, b);
        let mut overlaps = [None; 4];
        for i in 0..4 {
            if !mask[i] {
                continue;
            }
            self.pair.meter.spent.node_pairs += 1;
            let pair = NodePair { a: a[i >> 1], b: b[i & 1] };
            let gap = if gaps[i] > self.reach { gaps[i] } else { self.pair.better_gap(pair, gaps[i]) };
            if gap > self.reach {
                self.proven.push(Bound { gap, pair, shown_by: pair });
            } else {
                overlaps[i] = Some(-gaps[i]);
            }
        }
        overlaps
    }
}

impl Visitor for Certifier<'_> {
    #[inline]
    fn admit(&mut self, a: [NodeId; 2], b: [NodeId; 2], _count: u8) -> [Option<f32>; 4] {
        self.overlaps(a, b, distinct(a, b))
    }

    /// Two leaves that nothing parts.
    fn leaves(&mut self, pair: NodePair) -> ControlFlow<()> {
        self.doubtful = Some(pair);
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
