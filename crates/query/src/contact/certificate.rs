//! Certificates of separation: a set of node pairs that covers all pairs of points, the enclosures of each
//! pair apart. Enclosures provably contain the surface, or the obstacle, of their nodes.
//!
//! The proof begins with the roots. A pair whose enclosures are apart is proven; one whose enclosures overlap
//! is replaced by its children, sixteen pairs at a time. The certificate is whole when no pair is left, and
//! given up at the first two leaves that nothing parts.
//!
//! A certificate that stops at the first volumes that are disjoint proves little distance. So the pair with
//! the least bound is split further, for about an eighth as long as all took before.

use std::ops::ControlFlow;

use nearmiss_geometry::Pose;
use nearmiss_hierarchy::{Frontier, Heap, NodePair, Open, PairVisitor, Stack, resume};

use crate::pair::bounds::{BoundVisitor, Pairs};
use crate::pair::motion::{Gaps, LANES, Limits, Motion};
use crate::pair::scan_pair::{ScanPair, balls_apart};

/// A proof that two scans are apart: pairs of nodes with disjoint enclosures, which together cover the pair
/// of the roots.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Proof {
    /// The pairs, with a lower bound of the distance of their enclosures in world units.
    pub pairs: Vec<(NodePair, f64)>,
}

/// A pair of nodes that are proven to be this far apart, in a's stored frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bound {
    pub(crate) gap: f32,
    pub(crate) pair: NodePair,
}

/// A gap this many times the least one of a proof is good enough.
const KEPT: f32 = 4.0;

/// The pairs of nodes of a proof. Reused.
#[derive(Debug, Clone, Default)]
pub(crate) struct ProofScratch {
    /// Those that are not yet proven apart.
    open: Stack,
    /// Those that are apart with the least gaps, which are their keys.
    near: Vec<Open>,
    /// The same, the least gap first, while these are split further.
    nearest: Heap,
    /// The others that are apart, if all are wanted.
    rest: Vec<Open>,
}

impl ProofScratch {
    fn clear(&mut self) {
        self.open.clear();
        self.near.clear();
        self.nearest.clear();
        self.rest.clear();
    }

    /// All pairs that are apart.
    fn apart(&self) -> impl Iterator<Item = &Open> {
        self.near.iter().chain(&self.rest)
    }
}

/// Returns `true` if a proof would fail at two leaves: neither their enclosures nor their points are further
/// apart than `reach`.
pub(crate) fn are_doubtful(pair: &ScanPair<'_>, motion: &Motion, leaves: NodePair, reach: f32) -> bool {
    if pair.better_gap(leaves, f32::NEG_INFINITY) > reach || pair.gap_of_enclosures(leaves) > reach {
        return false;
    }
    let gap = gap_of_nodes(pair, motion, leaves);
    gap.is_nan() || gap <= reach
}

/// The gap of the enclosures of two nodes.
fn gap_of_nodes(pair: &ScanPair<'_>, motion: &Motion, nodes: NodePair) -> f32 {
    motion.gap(pair.bounds(motion).of(pair.level, nodes).enclosures[0], pair.relative.slack())
}

/// The search for a pair of leaves whose enclosures are not apart.
pub(crate) struct Certifier<'c, 'a> {
    pub(crate) pair: &'c mut ScanPair<'a>,
    /// Enclosures must be further apart than this, in a's stored frame.
    pub(crate) reach: f32,
    /// What was proven.
    pub(crate) proven: &'c mut Vec<Bound>,
    /// Leaves whose enclosures are not apart.
    pub(crate) doubtful: Option<NodePair>,
}

impl<'c, 'a> Certifier<'c, 'a> {
    pub(crate) fn new(pair: &'c mut ScanPair<'a>, reach: f32, proven: &'c mut Vec<Bound>) -> Self {
        proven.clear();
        Self { pair, reach, proven, doubtful: None }
    }

    /// Proves the two scans, b's stored frame at `pose` in a's, to be apart. Returns the least gap, in the
    /// world, and the band there; `None` where the proof fails. It is likeliest to fail at leaves that were
    /// `compared` because their boxes overlap, so these come first. The pairs are handed out with their gaps
    /// in the world if a `proof` is wanted, and left in `proven` if a hint wants them.
    pub(crate) fn prove(
        &mut self,
        pose: &Pose,
        compared: &[NodePair],
        scratch: &mut ProofScratch,
        (proof, is_hinted): (Option<&mut Proof>, bool),
    ) -> Option<(f64, f64)> {
        let motion = &Motion::new(self.pair.views, pose);
        let (pair, reach) = (&*self.pair, self.reach);
        let fails =
            |&leaves: &NodePair| !pair.are_leaves(leaves) || are_doubtful(pair, motion, leaves, reach);
        if let Some(&leaves) = compared.iter().find(|leaves| fails(leaves)) {
            self.doubtful = Some(leaves);
            return None;
        }
        scratch.clear();
        self.proven.clear();
        let ProofScratch { open, near, nearest, rest } = scratch;
        let before = self.pair.meter.spent.node_pairs;
        let gap = self.pair.gap_of_enclosures(NodePair::ROOTS);
        let mut proving =
            Proving::new(self.pair, motion, self.reach, is_hinted || proof.is_some(), (near, rest));
        if let Some(key) = proving.file(NodePair::ROOTS, f32::NEG_INFINITY, gap) {
            open.push(Open { pair: NodePair::ROOTS, key });
        }
        let is_whole = proving.run(open);
        self.doubtful = proving.doubtful;
        if !is_whole {
            return None;
        }
        let compared = proving.pair.meter.spent.node_pairs - before;
        let least = proving.tighten((compared / 8).max(32), nearest)?;
        let gap = if proving.is_cut { least.key.min(proving.enough) } else { least.key };
        let proven = self.in_world(gap);
        // Far away balls tell more than boxes.
        let balls = balls_apart(self.pair.views, self.pair.part) / self.pair.views[0].placed().scale();
        #[expect(clippy::cast_possible_truncation, reason = "lessened by more than the rounding")]
        let key = (balls * (1.0 - 1e-6)) as f32;
        let distance = self.in_world(key).max(proven);
        if distance > proven {
            scratch.clear();
            scratch.near.push(Open { pair: NodePair::ROOTS, key });
        }
        if is_hinted {
            self.proven.extend(scratch.apart().map(|own| Bound { gap: own.key, pair: own.pair }));
        }
        if let Some(proof) = proof {
            let shown = |own: &Open| (own.pair, self.in_world(own.key));
            proof.pairs.extend(scratch.apart().map(shown));
        }
        Some((distance, self.pair.band_of(least.pair)))
    }

    /// Splits `open` pairs of a proof, b's stored frame at `pose` in a's, until all are apart; `None` where
    /// that fails. The pairs that are apart are left in `proven`.
    pub(crate) fn prove_on(
        &mut self,
        pose: &Pose,
        open: &[NodePair],
        scratch: &mut ProofScratch,
    ) -> Option<()> {
        let motion = &Motion::new(self.pair.views, pose);
        scratch.clear();
        self.proven.clear();
        for &pair in open {
            scratch.open.push(Open { pair, key: f32::NEG_INFINITY });
        }
        let aside = (&mut scratch.near, &mut scratch.rest);
        let mut proving = Proving::new(self.pair, motion, self.reach, true, aside);
        let is_whole = proving.run(&mut scratch.open);
        self.doubtful = proving.doubtful;
        self.proven.extend(scratch.apart().map(|own| Bound { gap: own.key, pair: own.pair }));
        is_whole.then_some(())
    }

    /// What a gap in a's stored frame proves in the world.
    fn in_world(&self, gap: f32) -> f64 {
        let slack = self.pair.relative.slack();
        // Less the rounding of the scale and of the product.
        f64::from(gap - slack) * self.pair.views[0].placed().scale() * (1.0 - 1e-9)
    }
}

/// A proof under way. Pairs that are not apart are split, the nearest child first: if the proof fails at all,
/// it is likeliest to fail there.
struct Proving<'p, 'a> {
    pair: &'p mut ScanPair<'a>,
    motion: &'p Motion,
    /// Enclosures must be further apart than this, in a's stored frame.
    reach: f32,
    /// Whether all pairs are wanted that are apart.
    lists: bool,
    /// [`KEPT`] times the least gap so far. A pair with at least this gap is not split for a better bound.
    enough: f32,
    /// The same as [`Motion::gaps`] tells gaps: less the distance of the scans' centres.
    beyond: f32,
    /// Whether the gap of some pair is known to be at least `enough`, and not kept.
    is_cut: bool,
    /// Pairs that are apart with the least gaps.
    near: &'p mut Vec<Open>,
    /// The others, if all are wanted.
    rest: &'p mut Vec<Open>,
    /// Leaves that nothing parts.
    doubtful: Option<NodePair>,
}

impl<'p, 'a> Proving<'p, 'a> {
    fn new(
        pair: &'p mut ScanPair<'a>,
        motion: &'p Motion,
        reach: f32,
        lists: bool,
        (near, rest): (&'p mut Vec<Open>, &'p mut Vec<Open>),
    ) -> Self {
        let infinite = f32::INFINITY;
        let (enough, beyond) = (infinite, infinite);
        Self { pair, motion, reach, lists, enough, beyond, is_cut: false, near, rest, doubtful: None }
    }

    /// Splits the open pairs until all are apart. Returns `false` where two leaves are not, or the budget
    /// ends.
    fn run(&mut self, open: &mut Stack) -> bool {
        let (bounds, level) = (self.pair.bounds(self.motion), self.pair.level);
        self.doubtful.is_none() && resume(&bounds, level, open, self).is_continue()
    }

    /// Splits the pair with the least gap again and again, until that is two leaves or `most` node pairs more
    /// were compared, but once at least. Returns the pair with the least gap then, or the last that was split
    /// if only pairs with good gaps are left.
    fn tighten(&mut self, most: u64, nearest: &mut Heap) -> Option<Open> {
        let (bounds, level) = (self.pair.bounds(self.motion), self.pair.level);
        nearest.extend(self.near.drain(..));
        let most = self.pair.meter.spent.node_pairs + most;
        let mut tightening = Tightening { proving: self, most, last: None, is_over: false };
        let _ended = resume(&bounds, level, nearest, &mut tightening);
        let last = tightening.last.map(|last| Open { key: self.enough, ..last });
        let least = nearest.peek().or(last);
        self.near.extend(nearest.drain());
        least
    }

    /// Puts a pair that is apart aside, and returns `None`, or the key of one that is not. Leaves that are
    /// not make the proof fail.
    #[inline(always)]
    fn file(&mut self, pair: NodePair, boxes: f32, mut gap: f32) -> Option<f32> {
        // What is no number is not apart.
        let mut is_apart = gap > self.reach;
        if !is_apart {
            let [a, b] = self.pair.which_are_leaves(pair);
            if a || b {
                gap = self.pair.better_gap(pair, gap);
                is_apart = gap > self.reach;
            }
            if a && b && !is_apart {
                gap = self.pair.gap_of_enclosures(pair);
                is_apart = gap > self.reach;
                if !is_apart {
                    self.doubtful = Some(pair);
                    return None;
                }
            }
        }
        if !is_apart {
            return Some(boxes);
        }
        let own = Open { pair, key: gap };
        if self.is_near(&own) {
            self.near.push(own);
        }
        None
    }

    /// Returns `true` if the gap of a pair that is apart is one of the least; otherwise it is put aside.
    #[inline(always)]
    fn is_near(&mut self, own: &Open) -> bool {
        if own.key < self.enough {
            if KEPT * own.key < self.enough {
                self.enough = KEPT * own.key;
                self.beyond = self.motion.beyond_gap(self.enough, self.pair.relative.slack());
            }
            return true;
        }
        self.is_cut = true;
        if self.lists {
            self.rest.push(*own);
        }
        false
    }

    fn compared(&mut self, pairs: u32) -> ControlFlow<()> {
        self.pair.meter.spent.node_pairs += u64::from(pairs);
        if self.doubtful.is_some() { ControlFlow::Break(()) } else { self.pair.meter.go_on() }
    }

    /// Pairs with good gaps need not be looked at, unless all are wanted.
    fn limits(&self) -> Limits {
        let enclosures = if self.lists { f32::INFINITY } else { self.beyond };
        Limits { boxes: f32::NEG_INFINITY, enclosures }
    }
}

impl PairVisitor for Proving<'_, '_> {
    #[inline]
    fn compared(&mut self, pairs: u32) -> ControlFlow<()> {
        Proving::compared(self, pairs)
    }

    /// Leaves of a proof that goes on from a former one.
    fn leaf_pair(&mut self, _: [usize; 2], open: &Open) -> ControlFlow<()> {
        let gap = gap_of_nodes(self.pair, self.motion, open.pair);
        self.file(open.pair, open.key, gap);
        self.compared(1)
    }
}

impl BoundVisitor<f32> for Proving<'_, '_> {
    #[inline]
    fn limits(&self) -> Limits {
        Proving::limits(self)
    }

    #[inline]
    fn may_split(&mut self, _: &Open, pairs: &Pairs, gaps: &Gaps) -> bool {
        self.is_cut |= gaps.near != pairs.lanes;
        true
    }

    #[inline(always)]
    fn key(&mut self, _: &Open, pair: NodePair, boxes: f32, enclosures: f32) -> Option<f32> {
        let gap = self.motion.gap(enclosures, self.pair.relative.slack());
        self.file(pair, boxes, gap)
    }
}

/// A proof whose pairs with the least gaps are split, for greater ones. All pairs are apart, and their gaps
/// are their keys.
struct Tightening<'t, 'p, 'a> {
    proving: &'t mut Proving<'p, 'a>,
    /// So many node pairs may be compared in all.
    most: u64,
    /// The pair that was split last.
    last: Option<Open>,
    is_over: bool,
}

impl PairVisitor for Tightening<'_, '_, '_> {
    #[inline]
    fn compared(&mut self, pairs: u32) -> ControlFlow<()> {
        let flow = self.proving.compared(pairs);
        let is_over = self.is_over || self.proving.pair.meter.spent.node_pairs >= self.most;
        if is_over { ControlFlow::Break(()) } else { flow }
    }

    /// No bound of these leaves is better.
    fn leaf_pair(&mut self, _: [usize; 2], _: &Open) -> ControlFlow<()> {
        ControlFlow::Break(())
    }
}

impl BoundVisitor<f32> for Tightening<'_, '_, '_> {
    #[inline]
    fn limits(&self) -> Limits {
        self.proving.limits()
    }

    /// A pair stays if some of its children show less than it does itself.
    #[inline]
    fn may_split(&mut self, above: &Open, pairs: &Pairs, gaps: &Gaps) -> bool {
        let Proving { motion, pair, .. } = &*self.proving;
        let slack = pair.relative.slack();
        let shows_less =
            |lane: usize| gaps.near >> lane & 1 != 0 && motion.gap(gaps.enclosures[lane], slack) <= above.key;
        self.last = Some(*above);
        self.is_over = (0..LANES).any(shows_less);
        self.proving.is_cut |= !self.is_over && gaps.near != pairs.lanes;
        !self.is_over
    }

    #[inline]
    fn key(&mut self, _: &Open, pair: NodePair, _: f32, enclosures: f32) -> Option<f32> {
        let gap = self.proving.motion.gap(enclosures, self.proving.pair.relative.slack());
        self.proving.is_near(&Open { pair, key: gap }).then_some(gap)
    }
}
