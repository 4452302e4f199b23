//! Temporal coherence: the result of a query about two scans speeds up the next query after a small
//! motion.
//!
//! Scans that met probably still meet, so the two points whose discs crossed are tested first, then
//! their leaves. Scans that were separated and move slowly keep the pruned node pairs of the last
//! query as a frontier. A pair with gap g stays disjoint until b has travelled the distance g. So
//! only pairs whose gap has been used up are compared again, and split if they are no longer
//! disjoint; while no gap is used up, nothing is compared. Travel is the length of b's path in a's
//! frame, at the point that moves most.

use std::ops::ControlFlow;

use nearmiss_geometry::Pose;
use nearmiss_hierarchy::{Frontier, NodePair, Open, Stack, Topology, descend, resume};

use crate::ask::options::CollideOptions;
use crate::contact::certificate::{Bound, Certifier, ProofScratch, are_doubtful};
use crate::contact::search::{Closer, Surfaces};
use crate::pair::clearance::motion;
use crate::pair::pairing::Pairing;
use crate::pair::placed::Placed;
use crate::pair::scan_pair::ScanPair;

/// A frontier that has grown to this many times its fresh length is dropped: its nodes are smaller
/// than necessary.
const GROWN: usize = 3;

/// If more than one in this many pairs of the frontier has expired, a search from the roots is
/// cheaper.
const MOST_EXPIRED: usize = 4;

/// The longest step, in sampling radii, after which enough of a frontier is still valid. After
/// longer steps a search from the roots, sixteen pairs at a time, is faster (benches/record).
const SLOW: f64 = 0.2;

/// The travel, in slacks, at which counting starts anew: beyond it gaps would lose their digits.
const LONGEST: f64 = (1_u64 << 40) as f64;

/// The state that a query about two scans passes on to the next one; see
/// [`Question::hinted`](crate::Question::hinted). Keep one for each pair of scans.
///
/// Hints cannot be deserialised, as a forged hint could forge a certificate.
///
/// A continued proof relies on smaller nodes than a fresh one, and on their earlier positions. So
/// about one separation in a thousand is certified with a hint and estimated without, or the
/// reverse.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PairHint {
    known: Option<Known>,
}

/// The identity of a question. A hint is ignored for any other question.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Question {
    options: CollideOptions,
    /// The [identities](nearmiss_hierarchy::Outline) of the scans, and their topologies.
    scans: [(u64, Topology); 2],
    /// The scale from a's stored frame to the world.
    scale: f64,
}

impl Question {
    fn new(views: [&Placed<'_>; 2], options: &CollideOptions) -> Self {
        Self {
            options: *options,
            scans: views.map(|view| (view.scan().outline().identity, *view.scan().topology())),
            scale: views[0].stored_to_world().scale(),
        }
    }

    /// Returns `true` if this is the question about `views`.
    fn is(&self, views: [&Placed<'_>; 2], options: &CollideOptions) -> bool {
        let is_of = |side: usize| {
            let (identity, topology) = &self.scans[side];
            let scan = views[side].scan();
            *identity == scan.outline().identity && topology == scan.topology()
        };
        is_of(0)
            && is_of(1)
            && self.scale.to_bits() == views[0].stored_to_world().scale().to_bits()
            && self.options == *options
    }
}

/// A node pair that is disjoint until b's travel reaches `until`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct FrontierPair {
    pair: NodePair,
    until: f64,
}

/// The knowledge about a question. Lengths are in a's stored frame.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Known {
    question: Question,
    /// The pose of b's stored frame in a's at the last query.
    pose: Option<Pose>,
    /// The travel of b since the first query.
    travel: f64,
    /// The step of b since the last query.
    step: f64,
    /// The points that met.
    met: Option<[u32; 2]>,
    /// The scans are separated until b's travel reaches this value.
    clear: f64,
    /// The frontier: if `is_whole`, pairs that cover all pairs of points.
    frontier: Vec<FrontierPair>,
    is_whole: bool,
    /// `true` if the enclosures of the frontier's pairs are disjoint, `false` if only their boxes
    /// are.
    is_proof: bool,
    /// The length of the frontier when it was fresh.
    fresh: usize,
    /// The leaves at which a proof failed.
    doubtful: Option<NodePair>,
}

impl PairHint {
    /// Returns the knowledge about this question, not yet updated to its pose; see
    /// [`Known::come_to`].
    pub(crate) fn recall(&mut self, views: [&Placed<'_>; 2], options: &CollideOptions) -> &mut Known {
        self.known.take_if(|known| !known.question.is(views, options));
        self.known.get_or_insert_with(|| Known::nothing(Question::new(views, options)))
    }

    /// Returns the knowledge about this question and the points that met in the last query, if any.
    pub(crate) fn met(
        &mut self,
        views: [&Placed<'_>; 2],
        options: &CollideOptions,
    ) -> Option<(&mut Known, [usize; 2])> {
        let known = self.known.as_mut()?;
        let met = known.met()?;
        known.question.is(views, options).then_some((known, met))
    }
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
            frontier: Vec::new(),
            is_whole: false,
            is_proof: false,
            fresh: 0,
            doubtful: None,
        }
    }

    /// Records that b is at `pose`. If the travel is too long or NaN, everything but the question
    /// is forgotten.
    pub(crate) fn come_to(&mut self, pose: Pose, pair: &ScanPair<'_>) {
        self.step = self.pose.map_or(f64::MAX, |from| motion(&pair.b.outline.surface, &from, &pose));
        self.pose = Some(pose);
        // Rounded up so that no step is lost.
        let travel = if self.step > 0.0 { (self.travel + self.step).next_up() } else { self.travel };
        if self.step >= 0.0 && travel <= LONGEST * f64::from(pair.relative.slack()) {
            self.travel = travel;
        } else {
            self.forget(None);
            self.travel = 0.0;
        }
    }

    /// The points that met in the last query.
    pub(crate) fn met(&self) -> Option<[usize; 2]> {
        self.met.map(|met| met.map(|i| i as usize))
    }

    /// Records that the same points still meet with b at `pose`. Nothing else depends on the travel
    /// then.
    pub(crate) fn still_met(&mut self, pose: Pose) {
        self.pose = Some(pose);
    }

    /// Returns `true` if a frontier is worth keeping: the last query found no contact and b moves
    /// slowly.
    pub(crate) fn keeps_front(&self, pair: &ScanPair<'_>) -> bool {
        self.met.is_none() && self.is_slow(pair, SLOW)
    }

    /// Returns `true` if the next query is likely to continue a proof, so that its pairs are worth
    /// keeping.
    pub(crate) fn keeps_proof(&self, pair: &ScanPair<'_>) -> bool {
        self.is_slow(pair, SLOW)
    }

    /// Returns `true` if the last step of b is at most this many sampling radii.
    fn is_slow(&self, pair: &ScanPair<'_>, radii: f64) -> bool {
        let scale = f64::from(pair.relative.scale());
        let [a, b] = [pair.a, pair.b].map(|scan| f64::from(scan.sampling_radius));
        self.step <= radii * a.min(b * scale)
    }

    /// A lower bound of the distance of the scans in the world, known without a search, if it
    /// exceeds `reach`.
    pub(crate) fn distance(&self, pair: &ScanPair<'_>, reach: f64) -> Option<f64> {
        // Now as then, the pose has a rounding error.
        let left = self.clear - self.travel - f64::from(pair.relative.slack());
        (left > f64::from(pair.stored(reach)))
            .then(|| left * pair.views[0].stored_to_world().scale() * (1.0 - 1e-9))
    }

    /// Returns `true` if [`Known::look_again`] can replace a search. If the question `certifies`,
    /// this also requires that the proof would fail again.
    pub(crate) fn has_front(&self, pair: &ScanPair<'_>, reach: f32, certifies: bool) -> bool {
        let fails = |&leaves: &NodePair| {
            let relative_pose = self.pose.map(|pose| pair.relative_pose(&pose));
            pair.are_leaves(leaves)
                && relative_pose
                    .is_some_and(|relative_pose| are_doubtful(pair, &relative_pose, leaves, reach))
        };
        self.is_slow(pair, SLOW)
            && self.is_whole
            && !self.is_proof
            && (!certifies || self.doubtful.as_ref().is_some_and(fails))
    }

    /// Returns `true` if a proof is known to fail, at leaves that [`Known::has_front`] has tested.
    pub(crate) fn is_doubtful(&self) -> bool {
        self.doubtful.is_some()
    }

    /// Searches from the frontier instead of the roots.
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
            // After long travel, starting from the roots is cheaper than from the old frontier.
            self.forget(None);
            return descend(trees, level, stack, &mut Closer(search));
        }
        resume(&trees, level, stack, &mut Closer(search))
    }

    /// Continues the proof of the last query, if there is one. Returns a lower bound of the scans'
    /// distance if the proof can be completed again.
    pub(crate) fn prove_again(
        &mut self,
        pose: &Pose,
        certifier: &mut Certifier<'_, ScanPair<'_>>,
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

    /// Compares the expired pairs of the frontier again. Pairs that are still disjoint stay; the
    /// others are removed and passed to `open` with their gaps. Returns `false` if too many have
    /// expired.
    fn advance(
        &mut self,
        reach: f32,
        slack: f32,
        mut gap: impl FnMut(NodePair) -> f32,
        mut open: impl FnMut(NodePair, f32),
    ) -> bool {
        let parted = self.travel + (f64::from(reach) + f64::from(slack));
        let expired = self.frontier.iter().filter(|entry| entry.until <= parted).count();
        if expired * MOST_EXPIRED > self.frontier.len() {
            return false;
        }
        let mut i = 0;
        while let Some(&FrontierPair { pair, until }) = self.frontier.get(i) {
            if until > parted {
                i += 1;
                continue;
            }
            let gap = gap(pair);
            if gap > reach {
                self.frontier[i].until = self.until(gap, slack);
                i += 1;
            } else {
                self.frontier.swap_remove(i);
                open(pair, gap);
            }
        }
        true
    }

    /// The travel until which a pair with this gap stays disjoint.
    fn until(&self, gap: f32, slack: f32) -> f64 {
        (self.travel + (f64::from(gap) - f64::from(slack))).next_down()
    }

    /// Forgets everything except that these points met, if any.
    pub(crate) fn forget(&mut self, met: Option<[usize; 2]>) {
        #[expect(clippy::cast_possible_truncation, reason = "points are counted in 32 bits")]
        let met = met.map(|met| met.map(|i| i as u32));
        self.met = met;
        self.clear = f64::MIN;
        self.frontier.clear();
        self.is_whole = false;
        self.is_proof = false;
        self.doubtful = None;
    }

    /// Records that nothing meets: adds the pairs that a search pruned and compared to the
    /// frontier, or starts a new one. If `proof_failed`, a requested proof failed, at the leaves
    /// `doubtful` if known.
    pub(crate) fn parted(
        &mut self,
        (excluded, compared): (&[Bound], &[NodePair]),
        slack: f32,
        proof_failed: bool,
        doubtful: Option<NodePair>,
    ) {
        let apart = excluded.iter().map(|bound| (bound.gap, bound.pair));
        // Leaves that were compared must be compared again next time.
        let compared = compared.iter().map(|&pair| (f32::NEG_INFINITY, pair));
        self.add(apart.chain(compared), slack);
        self.doubtful = doubtful.or(self.doubtful);
        if proof_failed {
            // Disjoint boxes of discs prove nothing.
            self.clear = f64::MIN;
        }
    }

    /// Records a proof by these pairs that the scans are `distance` apart in the world.
    pub(crate) fn proven(&mut self, distance: f64, bounds: &[Bound], pair: &ScanPair<'_>) {
        self.forget(None);
        self.add(bounds.iter().map(|bound| (bound.gap, bound.pair)), pair.relative.slack());
        self.is_proof = true;
        self.clear_to(distance, pair);
    }

    /// Records a proof, by pairs that were not kept, that the scans are `distance` apart in the
    /// world.
    pub(crate) fn proven_alone(&mut self, distance: f64, pair: &ScanPair<'_>) {
        self.forget(None);
        self.clear_to(distance, pair);
    }

    /// Adds pairs with their gaps to the frontier, or starts a new one.
    fn add(&mut self, pairs: impl Iterator<Item = (f32, NodePair)>, slack: f32) {
        if !self.is_whole {
            self.frontier.clear();
        }
        let mut frontier = std::mem::take(&mut self.frontier);
        frontier.extend(
            pairs.map(|(gap, pair)| FrontierPair { pair, until: self.until(gap, slack).max(f64::MIN) }),
        );
        if !self.is_whole {
            self.fresh = frontier.len();
        }
        self.clear = frontier.iter().map(|entry| entry.until).fold(f64::MAX, f64::min);
        self.is_whole = frontier.len() <= self.fresh.saturating_mul(GROWN);
        self.frontier = frontier;
        self.met = None;
    }

    /// Records only that the scans are `distance` apart in the world.
    pub(crate) fn clear_to(&mut self, distance: f64, pair: &ScanPair<'_>) {
        let distance = distance / pair.views[0].stored_to_world().scale() * (1.0 - 1e-9);
        self.clear = (self.travel + (distance - f64::from(pair.relative.slack()))).next_down();
    }
}
