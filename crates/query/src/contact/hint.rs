//! Temporal coherence: what the last query about two scans found helps the next one, a small motion later.
//!
//! Where they met they probably still meet, so the two points whose discs crossed are tried alone, then their
//! leaves. Where they were apart and move slowly, the pairs of nodes that parted them are a front across the
//! tree of pairs; a pair whose gap was g stays apart until b has travelled so far. So only pairs whose time
//! has come are compared again, and split where they do not part the scans any more; and as long as none has
//! come, nothing at all. Travel is the length of b's way in a's frame, at the point that moves most.

use std::ops::ControlFlow;

use nearmiss_geometry::Pose;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{Ball, Frontier, NodePair, Open, Stack, Topology, descend, resume};

use crate::ask::options::CollideOptions;
use crate::contact::certificate::{Bound, Certifier, ProofScratch, are_doubtful};
use crate::contact::search::{Closer, Surfaces};
use crate::pair::motion::Motion;
use crate::pair::scan_pair::ScanPair;

/// A front that has grown so many times as long as a fresh one is given up: its nodes are smaller than they
/// need be.
const GROWN: usize = 3;

/// Where more than one in so many pairs of the front has expired, a search from the roots is cheaper.
const MOST_EXPIRED: usize = 4;

/// Steps of up to so many sampling radii find enough of a front as it was: after longer ones a search from
/// the roots, sixteen pairs at a time, is faster (benches/record).
const SLOW: f64 = 0.2;

/// A travel of more slacks than this is begun anew: gaps beside it would lose their digits.
const LONGEST: f64 = (1_u64 << 40) as f64;

/// What a query about two scans passes on to the next one; see [`Question::hinted`](crate::Question::hinted).
/// Keep one for each pair of scans.
///
/// Hints cannot be deserialised: a forged hint could forge a certificate.
///
/// A continued proof rests on smaller nodes than a fresh one, and on their earlier positions. So about one
/// separation in a thousand is certified with a hint and estimated without, or the reverse.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PairHint {
    known: Option<Known>,
}

/// What was asked: a hint for anything else is none.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Question {
    options: CollideOptions,
    /// Their [identities](nearmiss_hierarchy::Outline), and which nodes they have.
    scans: [(u64, Topology); 2],
    /// Of a's stored frame in the world.
    scale: f64,
}

/// A pair of nodes that are no nearer each other than b has still to travel until then.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Standing {
    pair: NodePair,
    until: f64,
}

/// What is known of a question. Lengths are in a's stored frame.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Known {
    question: Question,
    /// Of b's stored frame in a's, when last asked.
    pose: Option<Pose>,
    /// How far b has come since the first question.
    travel: f64,
    /// And since the last one.
    step: f64,
    /// The points that met.
    met: Option<[u32; 2]>,
    /// The scans are no nearer each other than b has still to travel until then.
    clear: f64,
    /// Pairs that cover all pairs of points, if whole.
    front: Vec<Standing>,
    is_whole: bool,
    /// Whether it is enclosures that are apart, not boxes.
    is_proof: bool,
    /// How long the front was when it was fresh.
    fresh: usize,
    /// Leaves at which a proof failed.
    doubtful: Option<NodePair>,
}

impl PairHint {
    /// What is known of this question, not yet about this pose: that is for [`Known::come_to`].
    pub(crate) fn recall(&mut self, pair: &ScanPair<'_>, options: &CollideOptions) -> &mut Known {
        let question = Question {
            options: *options,
            scans: pair.views.map(|view| (view.scan().outline().identity, *view.scan().topology())),
            scale: pair.views[0].placed().scale(),
        };
        match &mut self.known {
            Some(known) if known.question == question => {}
            known => *known = Some(Known::nothing(question)),
        }
        self.known.get_or_insert_with(|| Known::nothing(question))
    }
}

/// How far the motion from one pose to another takes any point of b at most.
fn motion(pair: &ScanPair<'_>, from: &Pose, to: &Pose) -> f64 {
    let Ball { centre, radius } = pair.b.outline.surface;
    let shift = (Vector3::from(to.apply(centre)) - Vector3::from(from.apply(centre))).norm();
    let turn = (to.rotation() * to.scale() - from.rotation() * from.scale()).norm();
    (shift + turn * radius) * (1.0 + 1e-9)
}

impl Known {
    fn nothing(question: Question) -> Self {
        Self {
            question,
            pose: None,
            travel: 0.0,
            step: f64::MAX,
            met: None,
            clear: f64::MIN,
            front: Vec::new(),
            is_whole: false,
            is_proof: false,
            fresh: 0,
            doubtful: None,
        }
    }

    /// b is at `pose` now. After too long a way, or one that is no number, all but the question is forgotten.
    pub(crate) fn come_to(&mut self, pose: Pose, pair: &ScanPair<'_>) {
        self.step = self.pose.map_or(f64::MAX, |from| motion(pair, &from, &pose));
        self.pose = Some(pose);
        // Rounded so that no step is lost.
        let travel = if self.step > 0.0 { (self.travel + self.step).next_up() } else { self.travel };
        if self.step >= 0.0 && travel <= LONGEST * f64::from(pair.relative.slack()) {
            self.travel = travel;
        } else {
            self.forget(None);
            self.travel = 0.0;
        }
    }

    /// The points that met last time.
    pub(crate) fn met(&self) -> Option<[usize; 2]> {
        self.met.map(|met| met.map(|i| i as usize))
    }

    /// b has come to `pose`, and the same points meet there: nothing else rests on the way.
    pub(crate) fn still_met(&mut self, pose: Pose) {
        self.pose = Some(pose);
    }

    /// Whether a front is worth its keep: nothing met last time, and b moves slowly.
    pub(crate) fn keeps_front(&self, pair: &ScanPair<'_>) -> bool {
        self.met.is_none() && self.is_slow(pair, SLOW)
    }

    /// Returns `true` if a proof is likely to be continued by the next query, so that its pairs are worth
    /// their keep.
    pub(crate) fn keeps_proof(&self, pair: &ScanPair<'_>) -> bool {
        self.is_slow(pair, SLOW)
    }

    /// Whether b moves no more than so many sampling radii.
    fn is_slow(&self, pair: &ScanPair<'_>, radii: f64) -> bool {
        let scale = f64::from(pair.relative.scale());
        let [a, b] = [pair.a, pair.b].map(|scan| f64::from(scan.sampling_radius));
        self.step <= radii * a.min(b * scale)
    }

    /// A lower bound of the distance of the scans in the world, without any search, if it is beyond `reach`.
    pub(crate) fn distance(&self, pair: &ScanPair<'_>, reach: f64) -> Option<f64> {
        // The pose is rounded now as it was then.
        let left = self.clear - self.travel - f64::from(pair.relative.slack());
        (left > f64::from(pair.stored(reach))).then(|| left * pair.views[0].placed().scale() * (1.0 - 1e-9))
    }

    /// Whether [`Known::look_again`] can replace a search, and a proof if one `certifies`: that would fail
    /// again.
    pub(crate) fn has_front(&self, pair: &ScanPair<'_>, reach: f32, certifies: bool) -> bool {
        let fails = |&leaves: &NodePair| {
            let motion = self.pose.map(|pose| Motion::new(pair.views, &pose));
            pair.are_leaves(leaves) && motion.is_some_and(|motion| are_doubtful(pair, &motion, leaves, reach))
        };
        self.is_slow(pair, SLOW)
            && self.is_whole
            && !self.is_proof
            && (!certifies || self.doubtful.as_ref().is_some_and(fails))
    }

    /// Whether a proof is known to fail, at leaves that [`Known::has_front`] has looked at.
    pub(crate) fn is_doubtful(&self) -> bool {
        self.doubtful.is_some()
    }

    /// Goes on from the front instead of the roots.
    pub(crate) fn look_again(&mut self, search: &mut Surfaces<'_>, stack: &mut Stack) -> ControlFlow<()> {
        stack.clear();
        let (reach, slack, relative) = (search.reach, search.pair.relative.slack(), search.pair.relative);
        let gap = |pair: NodePair| {
            let gap = search.pair.gap(pair);
            search.pair.gap_by_leaf(pair).map_or(gap, |by_points| by_points.max(gap))
        };
        let is_front = self.advance(reach, slack, gap, |pair, key| stack.push(Open { pair, key }));
        let (trees, level) = (search.pair.trees(&relative, reach), search.pair.level);
        if !is_front {
            // After a long way the roots are nearer than what was the front.
            self.forget(None);
            return descend(trees, level, stack, &mut Closer(search));
        }
        resume(&trees, level, stack, &mut Closer(search))
    }

    /// Goes on from the front of a proof, if there is one: how far the scans are apart at least, if it can be
    /// made whole again.
    pub(crate) fn prove_again(
        &mut self,
        pose: &Pose,
        certifier: &mut Certifier<'_, '_>,
        (expired, scratch): (&mut Vec<NodePair>, &mut ProofScratch),
    ) -> Option<f64> {
        let pair = &*certifier.pair;
        if !self.is_proof || !self.is_slow(pair, SLOW) || !self.is_whole {
            return None;
        }
        expired.clear();
        let (reach, slack) = (certifier.reach, certifier.pair.relative.slack());
        let gap = |pair: NodePair| {
            certifier.pair.meter.spent.node_pairs += 1;
            certifier.pair.gap_of_parts(pair)
        };
        let whole = self.advance(reach, slack, gap, |pair, _| expired.push(pair))
            && certifier.prove_on(pose, expired, scratch).is_some();
        if !whole {
            self.forget(None);
            return None;
        }
        self.add(certifier.proven.iter().map(|bound| (bound.gap, bound.pair)), slack);
        self.distance(certifier.pair, 0.0)
    }

    /// Looks at the pairs of the front whose time has come: those that are still apart wait again, the others
    /// leave it and are handed out with their gaps. Returns `false` if they are too many.
    fn advance(
        &mut self,
        reach: f32,
        slack: f32,
        mut gap: impl FnMut(NodePair) -> f32,
        mut open: impl FnMut(NodePair, f32),
    ) -> bool {
        let parted = self.travel + (f64::from(reach) + f64::from(slack));
        let expired = self.front.iter().filter(|standing| standing.until <= parted).count();
        if expired * MOST_EXPIRED > self.front.len() {
            return false;
        }
        let mut i = 0;
        while let Some(&Standing { pair, until }) = self.front.get(i) {
            if until > parted {
                i += 1;
                continue;
            }
            let gap = gap(pair);
            if gap > reach {
                self.front[i].until = self.until(gap, slack);
                i += 1;
            } else {
                self.front.swap_remove(i);
                open(pair, gap);
            }
        }
        true
    }

    /// Until when a pair with this gap is some way apart.
    fn until(&self, gap: f32, slack: f32) -> f64 {
        (self.travel + (f64::from(gap) - f64::from(slack))).next_down()
    }

    /// The points `met`, or nothing is known.
    pub(crate) fn forget(&mut self, met: Option<[usize; 2]>) {
        #[expect(clippy::cast_possible_truncation, reason = "points are counted in 32 bits")]
        let met = met.map(|met| met.map(|i| i as u32));
        self.met = met;
        self.clear = f64::MIN;
        self.front.clear();
        self.is_whole = false;
        self.is_proof = false;
        self.doubtful = None;
    }

    /// Nothing meets: adds what a search has excluded and compared to the front, or begins a new one. A proof
    /// that is wanted has failed, at the leaves `doubtful` if that is known.
    pub(crate) fn parted(
        &mut self,
        (excluded, compared): (&[Bound], &[NodePair]),
        slack: f32,
        proof_failed: bool,
        doubtful: Option<NodePair>,
    ) {
        let apart = excluded.iter().map(|bound| (bound.gap, bound.pair));
        // Leaves that were compared have to be compared again.
        let compared = compared.iter().map(|&pair| (f32::NEG_INFINITY, pair));
        self.add(apart.chain(compared), slack);
        self.doubtful = doubtful.or(self.doubtful);
        if proof_failed {
            // Boxes of discs prove nothing.
            self.clear = f64::MIN;
        }
    }

    /// The scans are proven to be so far apart, in the world, by these pairs.
    pub(crate) fn proven(&mut self, distance: f64, bounds: &[Bound], pair: &ScanPair<'_>) {
        self.forget(None);
        self.add(bounds.iter().map(|bound| (bound.gap, bound.pair)), pair.relative.slack());
        self.is_proof = true;
        self.clear_to(distance, pair);
    }

    /// The scans are proven to be so far apart, in the world, by pairs that were not kept.
    pub(crate) fn proven_alone(&mut self, distance: f64, pair: &ScanPair<'_>) {
        self.forget(None);
        self.clear_to(distance, pair);
    }

    /// Adds pairs with their gaps to the front, or begins a new one.
    fn add(&mut self, pairs: impl Iterator<Item = (f32, NodePair)>, slack: f32) {
        if !self.is_whole {
            self.front.clear();
        }
        let mut front = std::mem::take(&mut self.front);
        front.extend(pairs.map(|(gap, pair)| Standing { pair, until: self.until(gap, slack).max(f64::MIN) }));
        if !self.is_whole {
            self.fresh = front.len();
        }
        self.clear = front.iter().map(|standing| standing.until).fold(f64::MAX, f64::min);
        self.is_whole = front.len() <= self.fresh.saturating_mul(GROWN);
        self.front = front;
        self.met = None;
    }

    /// The scans are so far apart, in the world; nothing else is known.
    pub(crate) fn clear_to(&mut self, distance: f64, pair: &ScanPair<'_>) {
        let distance = distance / pair.views[0].placed().scale() * (1.0 - 1e-9);
        self.clear = (self.travel + (distance - f64::from(pair.relative.slack()))).next_down();
    }
}
