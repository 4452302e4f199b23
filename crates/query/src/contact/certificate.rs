//! Certificates of separation: a set of node pairs with disjoint enclosures that covers all pairs
//! of points. An enclosure provably contains its node's part of the surface, or of the obstacle.
//!
//! The proof starts with the pair of the roots. A pair with disjoint enclosures is proven; a pair
//! with overlapping enclosures is replaced by its children, sixteen pairs at a time. The
//! certificate is complete when no pair is left. The proof fails at the first two leaves that
//! cannot be separated.
//!
//! A certificate that stops at the first disjoint volumes proves only a small distance. So the pair
//! with the smallest gap is split further, for about an eighth of the work done so far.

use std::ops::ControlFlow;

use nearmiss_geometry::Pose;
use nearmiss_hierarchy::{Frontier, Heap, NodePair, Open, PairVisitor, Stack, resume};

use crate::pair::bounds::{BoundVisitor, Pairs};
use crate::pair::pairing::Pairing;
use crate::pair::relative_pose::{Gaps, LANES, Limits, RelativePose};

/// A proof that two scans are separated: node pairs with disjoint enclosures that together cover
/// the pair of the roots.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Proof {
    /// The node pairs, each with a lower bound of the distance of their enclosures in world units.
    pub pairs: Vec<(NodePair, f64)>,
}

/// A node pair with a proven gap, in a's stored frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bound {
    pub(crate) gap: f32,
    pub(crate) pair: NodePair,
}

/// Pairs whose gap is at least this many times the smallest gap of the proof are not split further.
const KEPT: f32 = 4.0;

/// Reusable memory for the node pairs of a proof.
#[derive(Debug, Clone, Default)]
pub(crate) struct ProofScratch {
    /// The pairs that are not yet proven disjoint.
    open: Stack,
    /// The disjoint pairs with the smallest gaps, which are their keys.
    near: Vec<Open>,
    /// The same pairs, smallest gap first, while they are split further.
    nearest: Heap,
    /// The other disjoint pairs, if all are requested.
    rest: Vec<Open>,
}

impl ProofScratch {
    fn clear(&mut self) {
        self.open.clear();
        self.near.clear();
        self.nearest.clear();
        self.rest.clear();
    }

    /// All disjoint pairs.
    fn apart(&self) -> impl Iterator<Item = &Open> {
        self.near.iter().chain(&self.rest)
    }
}

/// Returns `true` if a proof would fail at these leaves: neither their enclosures nor their points
/// are further apart than `reach`.
pub(crate) fn are_doubtful<P: Pairing>(
    pair: &P,
    relative_pose: &RelativePose,
    leaves: NodePair,
    reach: f32,
) -> bool {
    if pair.better_gap(leaves, f32::NEG_INFINITY) > reach || pair.gap_of_enclosures(leaves) > reach {
        return false;
    }
    let gap = gap_of_nodes(pair, relative_pose, leaves);
    gap.is_nan() || gap <= reach
}

/// The gap of the enclosures of two nodes.
fn gap_of_nodes<P: Pairing>(pair: &P, relative_pose: &RelativePose, nodes: NodePair) -> f32 {
    relative_pose.gap(pair.bounds(relative_pose).of(pair.level(), nodes).enclosures[0], pair.slack())
}

/// The search for a proof, or for two leaves at which it fails.
pub(crate) struct Certifier<'c, P> {
    pub(crate) pair: &'c mut P,
    /// Enclosures must be further apart than this, in a's stored frame.
    pub(crate) reach: f32,
    /// The proven pairs.
    pub(crate) proven: &'c mut Vec<Bound>,
    /// The leaves at which the proof failed.
    pub(crate) doubtful: Option<NodePair>,
}

impl<'c, P: Pairing> Certifier<'c, P> {
    pub(crate) fn new(pair: &'c mut P, reach: f32, proven: &'c mut Vec<Bound>) -> Self {
        proven.clear();
        Self { pair, reach, proven, doubtful: None }
    }

    /// Proves that the two scans are separated, with b's stored frame at `pose` in a's. Returns the
    /// smallest gap, in the world, and the band there; `None` if the proof fails. The leaves in
    /// `compared` are tried first: their boxes overlap, so the proof is likeliest to fail there.
    /// Writes the pairs to `proof` if one is requested, with gaps in the world, and to
    /// `self.proven` for a hint if `is_hinted`.
    pub(crate) fn prove(
        &mut self,
        pose: &Pose,
        compared: &[NodePair],
        scratch: &mut ProofScratch,
        (proof, is_hinted): (Option<&mut Proof>, bool),
    ) -> Option<(f64, f64)> {
        let relative_pose = &self.pair.relative_pose(pose);
        let (pair, reach) = (&*self.pair, self.reach);
        let fails =
            |&leaves: &NodePair| !pair.are_leaves(leaves) || are_doubtful(pair, relative_pose, leaves, reach);
        if let Some(&leaves) = compared.iter().find(|leaves| fails(leaves)) {
            self.doubtful = Some(leaves);
            return None;
        }
        scratch.clear();
        self.proven.clear();
        let ProofScratch { open, near, nearest, rest } = scratch;
        let before = self.pair.meter().spent.node_pairs;
        let gap = self.pair.gap_of_enclosures(NodePair::ROOTS);
        let mut proving =
            Proving::new(self.pair, relative_pose, self.reach, is_hinted || proof.is_some(), (near, rest));
        if let Some(key) = proving.file(NodePair::ROOTS, f32::NEG_INFINITY, gap) {
            open.push(Open { pair: NodePair::ROOTS, key });
        }
        let is_whole = proving.run(open);
        self.doubtful = proving.doubtful;
        if !is_whole {
            return None;
        }
        let compared = proving.pair.meter().spent.node_pairs - before;
        let least = proving.tighten((compared / 8).max(32), nearest)?;
        let gap = if proving.is_cut { least.key.min(proving.enough) } else { least.key };
        let proven = self.in_world(gap);
        // For distant scans the bounding balls prove more than boxes.
        let balls = self.pair.balls_apart() / self.pair.to_world();
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

    /// Splits the `open` pairs of a proof, with b's stored frame at `pose` in a's, until all are
    /// disjoint. Returns `None` if that fails. Leaves the disjoint pairs in `self.proven`.
    pub(crate) fn prove_on(
        &mut self,
        pose: &Pose,
        open: &[NodePair],
        scratch: &mut ProofScratch,
    ) -> Option<()> {
        let relative_pose = &self.pair.relative_pose(pose);
        scratch.clear();
        self.proven.clear();
        for &pair in open {
            scratch.open.push(Open { pair, key: f32::NEG_INFINITY });
        }
        let aside = (&mut scratch.near, &mut scratch.rest);
        let mut proving = Proving::new(self.pair, relative_pose, self.reach, true, aside);
        let is_whole = proving.run(&mut scratch.open);
        self.doubtful = proving.doubtful;
        self.proven.extend(scratch.apart().map(|own| Bound { gap: own.key, pair: own.pair }));
        is_whole.then_some(())
    }

    /// The distance in the world that a gap in a's stored frame proves.
    fn in_world(&self, gap: f32) -> f64 {
        let slack = self.pair.slack();
        // Minus the rounding errors of the scale and the product.
        f64::from(gap - slack) * self.pair.to_world() * (1.0 - 1e-9)
    }
}

/// A proof in progress. Pairs that are not disjoint are split, the nearest child first, as the
/// proof is likeliest to fail there.
struct Proving<'p, P> {
    pair: &'p mut P,
    relative_pose: &'p RelativePose,
    /// Enclosures must be further apart than this, in a's stored frame.
    reach: f32,
    /// `true` if all disjoint pairs are requested.
    lists: bool,
    /// [`KEPT`] times the smallest gap so far. A pair with at least this gap is not split further.
    enough: f32,
    /// The same limit in the unit of [`RelativePose::gaps`]: minus the distance of the scans' centres.
    beyond: f32,
    /// `true` if a pair with a gap of at least `enough` was dropped.
    is_cut: bool,
    /// The disjoint pairs with the smallest gaps.
    near: &'p mut Vec<Open>,
    /// The other disjoint pairs, if all are requested.
    rest: &'p mut Vec<Open>,
    /// The leaves at which the proof failed.
    doubtful: Option<NodePair>,
}

impl<'p, P: Pairing> Proving<'p, P> {
    fn new(
        pair: &'p mut P,
        relative_pose: &'p RelativePose,
        reach: f32,
        lists: bool,
        (near, rest): (&'p mut Vec<Open>, &'p mut Vec<Open>),
    ) -> Self {
        let infinite = f32::INFINITY;
        let (enough, beyond) = (infinite, infinite);
        Self { pair, relative_pose, reach, lists, enough, beyond, is_cut: false, near, rest, doubtful: None }
    }

    /// Splits the open pairs until all are disjoint. Returns `false` if that fails at two leaves,
    /// or if the budget ends.
    fn run(&mut self, open: &mut Stack) -> bool {
        let (bounds, level) = (self.pair.bounds(self.relative_pose), self.pair.level());
        self.doubtful.is_none() && resume(&bounds, level, open, self).is_continue()
    }

    /// Splits the pair with the smallest gap again and again, at least once, until that pair
    /// consists of leaves or `most` more node pairs were compared. Returns the pair with the
    /// smallest gap, or the last pair that was split if only pairs with sufficient gaps remain.
    fn tighten(&mut self, most: u64, nearest: &mut Heap) -> Option<Open> {
        let (bounds, level) = (self.pair.bounds(self.relative_pose), self.pair.level());
        nearest.extend(self.near.drain(..));
        let most = self.pair.meter().spent.node_pairs + most;
        let mut tightening = Tightening { proving: self, most, last: None, is_over: false };
        let _ended = resume(&bounds, level, nearest, &mut tightening);
        let last = tightening.last.map(|last| Open { key: self.enough, ..last });
        let least = nearest.peek().or(last);
        self.near.extend(nearest.drain());
        least
    }

    /// Stores a disjoint pair and returns `None`, or returns the key of a pair that must be split.
    /// Leaves that are not disjoint make the proof fail.
    #[inline(always)]
    fn file(&mut self, pair: NodePair, boxes: f32, mut gap: f32) -> Option<f32> {
        // This is `false` for NaN.
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

    /// Returns `true` if the gap of a disjoint pair is one of the smallest. Otherwise stores the
    /// pair with the rest.
    #[inline(always)]
    fn is_near(&mut self, own: &Open) -> bool {
        if own.key < self.enough {
            if KEPT * own.key < self.enough {
                self.enough = KEPT * own.key;
                self.beyond = self.relative_pose.beyond_gap(self.enough, self.pair.slack());
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
        let meter = self.pair.meter();
        meter.spent.node_pairs += u64::from(pairs);
        if self.doubtful.is_some() { ControlFlow::Break(()) } else { self.pair.meter().go_on() }
    }

    /// Pairs with sufficient gaps can be skipped unless all are requested.
    fn limits(&self) -> Limits {
        let enclosures = if self.lists { f32::INFINITY } else { self.beyond };
        Limits { boxes: f32::NEG_INFINITY, enclosures }
    }
}

impl<P: Pairing> PairVisitor for Proving<'_, P> {
    #[inline]
    fn compared(&mut self, pairs: u32) -> ControlFlow<()> {
        Proving::compared(self, pairs)
    }

    /// Leaves reached when a proof is continued from an earlier one.
    fn leaf_pair(&mut self, _: [usize; 2], open: &Open) -> ControlFlow<()> {
        let gap = gap_of_nodes(self.pair, self.relative_pose, open.pair);
        self.file(open.pair, open.key, gap);
        self.compared(1)
    }
}

impl<P: Pairing> BoundVisitor<f32> for Proving<'_, P> {
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
        let gap = self.relative_pose.gap(enclosures, self.pair.slack());
        self.file(pair, boxes, gap)
    }
}

/// The improvement of a complete proof: the pairs with the smallest gaps are split to increase the
/// gap. All pairs are disjoint, with their gaps as keys.
struct Tightening<'t, 'p, P> {
    proving: &'t mut Proving<'p, P>,
    /// The total count of compared node pairs at which to stop.
    most: u64,
    /// The pair that was split last.
    last: Option<Open>,
    is_over: bool,
}

impl<P: Pairing> PairVisitor for Tightening<'_, '_, P> {
    #[inline]
    fn compared(&mut self, pairs: u32) -> ControlFlow<()> {
        let flow = self.proving.compared(pairs);
        let is_over = self.is_over || self.proving.pair.meter().spent.node_pairs >= self.most;
        if is_over { ControlFlow::Break(()) } else { flow }
    }

    /// Leaves cannot be split for a better bound, so the smallest gap is final.
    fn leaf_pair(&mut self, _: [usize; 2], _: &Open) -> ControlFlow<()> {
        ControlFlow::Break(())
    }
}

impl<P: Pairing> BoundVisitor<f32> for Tightening<'_, '_, P> {
    #[inline]
    fn limits(&self) -> Limits {
        self.proving.limits()
    }

    /// A pair stays unsplit if some of its children have no greater gap than the pair itself.
    #[inline]
    fn may_split(&mut self, above: &Open, pairs: &Pairs, gaps: &Gaps) -> bool {
        let Proving { relative_pose, pair, .. } = &*self.proving;
        // The gap increases with the bound, so the least of them tells.
        let mut least = f32::INFINITY;
        for lane in 0..LANES {
            let bound = gaps.enclosures[lane];
            least = if gaps.near >> lane & 1 != 0 && bound < least { bound } else { least };
        }
        self.last = Some(*above);
        self.is_over = gaps.near != 0 && relative_pose.gap(least, pair.slack()) <= above.key;
        self.proving.is_cut |= !self.is_over && gaps.near != pairs.lanes;
        !self.is_over
    }

    #[inline]
    fn key(&mut self, _: &Open, pair: NodePair, _: f32, enclosures: f32) -> Option<f32> {
        let gap = self.proving.relative_pose.gap(enclosures, self.proving.pair.slack());
        self.proving.is_near(&Open { pair, key: gap }).then_some(gap)
    }
}
