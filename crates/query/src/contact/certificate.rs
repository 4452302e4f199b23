//! Certificates of separation: a set of node pairs that covers all pairs of points, the enclosures of each
//! pair apart. Enclosures provably contain the surface, or the obstacle, of their nodes.
//!
//! The proof begins with the roots. A pair whose enclosures are apart is proven; one whose enclosures overlap
//! is replaced by its children, sixteen pairs at a time. The certificate is whole when no pair is left, and
//! given up at the first two leaves that nothing parts.
//!
//! A certificate that stops at the first volumes that are disjoint proves little distance. So the pair with
//! the least bound is split further, for about an eighth as long as all took before.

use std::collections::BinaryHeap;

use nearmiss_geometry::Pose;
use nearmiss_hierarchy::NodePair;
use nearmiss_lanes::order::Near;

use crate::contact::bounds::{LANES, Limits, Motion};
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

/// A pair of nodes in a proof, and their gap.
type Open = Near<NodePair>;

/// The pairs of nodes of a proof. Reused.
#[derive(Debug, Clone, Default)]
pub(crate) struct ProofScratch {
    /// Those that are not yet proven apart.
    open: Vec<Open>,
    /// Those that are apart with the least gaps.
    near: Vec<Open>,
    /// The same, the least gap first, while these are split further.
    nearest: BinaryHeap<Open>,
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

/// A proof under way.
struct Run<'m> {
    motion: &'m Motion,
    /// Whether all pairs are wanted that are apart.
    lists: bool,
    /// [`KEPT`] times the least gap so far. A pair with at least this gap is not split for a better bound.
    enough: f32,
    /// The same as [`Motion::gaps`] tells gaps: less the distance of the scans' centres.
    beyond: f32,
    /// Whether the gap of some pair is known to be at least `enough`, and not kept.
    is_cut: bool,
}

/// A gap this many times the least one of a proof is good enough.
const KEPT: f32 = 4.0;

impl Run<'_> {
    /// A pair is apart with this gap, the least so far. `slack` is that of the gap.
    fn found(&mut self, gap: f32, slack: f32) {
        self.enough = KEPT * gap;
        self.beyond = self.motion.beyond_gap(self.enough, slack);
    }
}

/// Returns `true` if a proof would fail at two leaves: neither their enclosures nor their points are further
/// apart than `reach`.
pub(crate) fn are_doubtful(pair: &ScanPair<'_>, motion: &Motion, leaves: NodePair, reach: f32) -> bool {
    if pair.better_gap(leaves, f32::NEG_INFINITY) > reach || pair.gap_of_enclosures(leaves) > reach {
        return false;
    }
    let all = Limits { boxes: f32::INFINITY, enclosures: f32::INFINITY };
    let (_, gaps) = motion.split(([pair.a, pair.b], pair.part), leaves, all);
    let gap = motion.gap(gaps.enclosures[0], pair.relative.slack());
    gap.is_nan() || gap <= reach
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
        let motion = &Motion::new(self.pair.level, self.pair.views, pose);
        let (pair, reach) = (&*self.pair, self.reach);
        let fails =
            |&leaves: &NodePair| !pair.are_leaves(leaves) || are_doubtful(pair, motion, leaves, reach);
        if let Some(&leaves) = compared.iter().find(|leaves| fails(leaves)) {
            self.doubtful = Some(leaves);
            return None;
        }
        let infinite = f32::INFINITY;
        let lists = is_hinted || proof.is_some();
        let mut run = Run { motion, lists, enough: infinite, beyond: infinite, is_cut: false };
        scratch.clear();
        self.proven.clear();
        let before = self.pair.meter.spent.node_pairs;
        let gap = self.pair.gap_of_enclosures(NodePair::ROOTS);
        self.file(Open { distance: gap, item: NodePair::ROOTS }, &mut run, scratch)?;
        while let Some(next) = scratch.open.pop() {
            self.split(&next, &mut run, scratch)?;
        }
        let compared = self.pair.meter.spent.node_pairs - before;
        let nearest = self.tighten((compared / 8).max(32), &mut run, scratch)?;
        let least =
            self.in_world(if run.is_cut { nearest.distance.min(run.enough) } else { nearest.distance });
        // Far away balls tell more than boxes.
        let balls = balls_apart(self.pair.views, self.pair.part) / self.pair.views[0].placed().scale();
        #[expect(clippy::cast_possible_truncation, reason = "lessened by more than the rounding")]
        let gap = (balls * (1.0 - 1e-6)) as f32;
        let distance = self.in_world(gap).max(least);
        if distance > least {
            scratch.clear();
            scratch.near.push(Open { distance: gap, item: NodePair::ROOTS });
        }
        if is_hinted {
            let bound = |own: &Open| Bound { gap: own.distance, pair: own.item };
            self.proven.extend(scratch.apart().map(bound));
        }
        if let Some(proof) = proof {
            let shown = |own: &Open| (own.item, self.in_world(own.distance));
            proof.pairs.extend(scratch.apart().map(shown));
        }
        Some((distance, self.pair.band_of(nearest.item)))
    }

    /// Splits `open` pairs of a proof, b's stored frame at `pose` in a's, until all are apart; `None` where
    /// that fails. The pairs that are apart are left in `proven`.
    pub(crate) fn prove_on(
        &mut self,
        pose: &Pose,
        open: &[NodePair],
        scratch: &mut ProofScratch,
    ) -> Option<()> {
        let motion = &Motion::new(self.pair.level, self.pair.views, pose);
        let infinite = f32::INFINITY;
        let mut run = Run { motion, lists: true, enough: infinite, beyond: infinite, is_cut: false };
        scratch.clear();
        self.proven.clear();
        scratch.open.extend(open.iter().map(|&item| Open { distance: f32::NEG_INFINITY, item }));
        while let Some(next) = scratch.open.pop() {
            self.split(&next, &mut run, scratch)?;
        }
        self.proven.extend(scratch.apart().map(|own| Bound { gap: own.distance, pair: own.item }));
        Some(())
    }

    /// Replaces a pair by its children. A pair that is apart stays if some of its children show less than it
    /// does: then the answer is `false`. `None` where two leaves are not apart, or the budget ends.
    fn split(&mut self, next: &Open, run: &mut Run<'_>, scratch: &mut ProofScratch) -> Option<bool> {
        if self.pair.meter.go_on().is_break() {
            return None;
        }
        let pair = &mut *self.pair;
        let enclosures = if run.lists { f32::INFINITY } else { run.beyond };
        let limits = Limits { boxes: f32::NEG_INFINITY, enclosures };
        let (pairs, gaps) = run.motion.split(([pair.a, pair.b], pair.part), next.item, limits);
        pair.meter.spent.node_pairs += u64::from(pairs.lanes.count_ones());
        let slack = pair.relative.slack();
        let mut lanes = gaps.near;
        let shows_less = |lane: usize| {
            lanes >> lane & 1 != 0 && run.motion.gap(gaps.enclosures[lane], slack) <= next.distance
        };
        if next.distance > self.reach && (0..LANES).any(shows_less) {
            return Some(false);
        }
        run.is_cut |= lanes != pairs.lanes;
        // The nearest child comes next: if the proof fails at all, it is likeliest to fail there.
        let (mut nearest, mut least) = (None, f32::INFINITY);
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize;
            lanes &= lanes - 1;
            let pair = pairs.pair(lane);
            let gap = run.motion.gap(gaps.enclosures[lane], slack);
            let mut own = Open { distance: gap, item: pair };
            if gaps.boxes[lane] < least {
                least = gaps.boxes[lane];
                match nearest.replace(own) {
                    Some(known) => own = known,
                    None => continue,
                }
            }
            self.file(own, run, scratch)?;
        }
        if let Some(nearest) = nearest {
            self.file(nearest, run, scratch)?;
        }
        Some(true)
    }

    /// Puts a pair where it belongs. `None` where two leaves are not apart.
    #[inline]
    fn file(&mut self, mut own: Open, run: &mut Run<'_>, scratch: &mut ProofScratch) -> Option<()> {
        let [a, b] = self.pair.which_are_leaves(own.item);
        let mut is_apart = own.distance > self.reach;
        if !is_apart && (a || b) {
            let nodes = own.item;
            let mut gap = self.pair.better_gap(nodes, own.distance);
            if a && b && gap <= self.reach {
                gap = self.pair.gap_of_enclosures(nodes);
            }
            is_apart = gap > self.reach;
            if is_apart {
                own.distance = gap;
            } else if a && b {
                self.doubtful = Some(nodes);
                return None;
            }
        }
        if !is_apart {
            scratch.open.push(own);
        } else if own.distance < run.enough {
            scratch.near.push(own);
            if KEPT * own.distance < run.enough {
                run.found(own.distance, self.pair.relative.slack());
            }
        } else {
            run.is_cut = true;
            if run.lists {
                scratch.rest.push(own);
            }
        }
        Some(())
    }

    /// Splits the pair with the least gap again and again, until that is two leaves or `most` node pairs more
    /// were compared, but once at least. Returns the pair with the least gap then, or the last that was split
    /// if only pairs with good gaps are left.
    fn tighten(&mut self, most: u64, run: &mut Run<'_>, scratch: &mut ProofScratch) -> Option<Open> {
        let most = self.pair.meter.spent.node_pairs + most.max(1);
        let mut nearest = std::mem::take(&mut scratch.nearest);
        nearest.extend(scratch.near.drain(..));
        let mut last = None;
        while let Some(&least) = nearest.peek() {
            last = Some(least);
            let are_leaves = self.pair.which_are_leaves(least.item) == [true; 2];
            if are_leaves
                || self.pair.meter.spent.node_pairs >= most
                || self.split(&least, run, scratch) != Some(true)
            {
                break;
            }
            nearest.pop();
            nearest.extend(scratch.near.drain(..));
        }
        let good = last.map(|last| Open { distance: run.enough, ..last });
        let least = nearest.peek().copied().or(good);
        scratch.near.extend(nearest.drain());
        scratch.nearest = nearest;
        least
    }

    /// What a gap in a's stored frame proves in the world.
    fn in_world(&self, gap: f32) -> f64 {
        let slack = self.pair.relative.slack();
        // Less the rounding of the scale and of the product.
        f64::from(gap - slack) * self.pair.views[0].placed().scale() * (1.0 - 1e-9)
    }
}
