//! The collision query.
//!
//! The search pops a node pair from the frontier. Pairs with disjoint boxes are pruned, and the
//! points of two leaves are compared. Any other pair is replaced by the children of both nodes, or
//! of the larger node if it is much larger. The pair that overlaps most comes first; after a
//! comparison without contact, that is the best of the whole frontier. If nothing meets and a
//! certificate is requested, pairs of enclosures are compared in the same way.

use std::ops::ControlFlow;
use std::time::Duration;

use fearless_simd::Level;
use nearmiss_geometry::Pose;
use nearmiss_hierarchy::{Heap, NodePair, Plunging, Relative, Stack, descend};

use crate::ask::answer::{Answer, Contacts, Evidence, ManifoldPoint, Reason, Statistics, Verdict};
use crate::ask::budget::Budget;
use crate::ask::options::{CollideOptions, CollidePlan, Detail, Order, Semantics};
use crate::contact::balls::Balls;
use crate::contact::certificate::{Bound, Certifier, Proof, ProofScratch};
use crate::contact::hint::{Known, PairHint};
use crate::contact::manifold::{self, ManifoldScratch};
use crate::contact::search::{Closer, Plain, Surfaces, Workspace};
use crate::leaf::point_pair::PointPair;
use crate::pair::likelihood::likelihood;
use crate::pair::meter::Meter;
use crate::pair::placed::{Placed, ViewScratch};
use crate::pair::placed_balls::relative_pose;
use crate::pair::scan_pair::{ScanPair, relative};

/// A collision question about two scans.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Asked<'q> {
    pub(crate) scans: [&'q Placed<'q>; 2],
    pub(crate) plan: &'q CollidePlan,
    pub(crate) budget: &'q Budget,
}

/// The outputs beside the answer.
#[derive(Debug, Default)]
pub(crate) struct Outputs<'q> {
    pub(crate) hint: Option<&'q mut PairHint>,
    pub(crate) manifold: Option<&'q mut Vec<ManifoldPoint>>,
    pub(crate) contacts: Option<&'q mut Contacts>,
    pub(crate) proof: Option<&'q mut Proof>,
}

/// Memory that is reused between queries.
#[derive(Debug, Clone)]
pub(crate) struct ContactScratch {
    /// The SIMD instructions to use.
    pub(crate) level: Level,
    pub(crate) longest_stretch: Duration,
    pub(crate) gathers: [ViewScratch; 2],
    pub(crate) frontiers: Frontiers,
    excluded: Vec<Bound>,
    pub(crate) compared: Vec<NodePair>,
    pub(crate) proven: Vec<Bound>,
    pub(crate) proof: ProofScratch,
    manifold: ManifoldScratch,
}

impl ContactScratch {
    pub(crate) fn new(level: Level) -> Self {
        Self {
            level,
            longest_stretch: Duration::ZERO,
            gathers: Default::default(),
            frontiers: Frontiers::default(),
            excluded: Vec::new(),
            compared: Vec::new(),
            proven: Vec::new(),
            proof: ProofScratch::default(),
            manifold: ManifoldScratch::default(),
        }
    }
}

/// The open node pairs, in the container of the search order.
#[derive(Debug, Clone, Default)]
pub(crate) struct Frontiers {
    /// For depth-first order.
    pub(crate) stack: Stack,
    /// For order by priority.
    pub(crate) heap: Heap,
}

impl Frontiers {
    pub(crate) fn clear(&mut self) {
        self.stack.clear();
        self.heap.clear();
    }

    /// The open pairs. A search that continues from a frontier is depth first, whatever its order.
    pub(crate) fn open(&self) -> impl Iterator<Item = NodePair> {
        self.stack.iter().chain(self.heap.iter())
    }
}

/// Answers a question and writes the requested outputs.
pub(crate) fn collide(asked: Asked<'_>, scratch: &mut ContactScratch, outputs: Outputs<'_>) -> Answer {
    let by_overlap = asked.plan.options().order.map_or(asked.budget.may_end(), |by| by != Order::DepthFirst);
    collide_by(asked, 0, scratch, outputs, |search, frontiers| from_the_roots(search, by_overlap, frontiers))
}

/// The same as [`collide`], with `look` as the search for contacts of surfaces from the roots on. A
/// leaf pair costs `evaluations` evaluations.
pub(crate) fn collide_by<'q>(
    asked: Asked<'q>,
    evaluations: u64,
    scratch: &mut ContactScratch,
    mut outputs: Outputs<'_>,
    look: impl FnOnce(&mut Surfaces<'_>, &mut Frontiers) -> ControlFlow<()>,
) -> Answer {
    if let Some(points) = &mut outputs.manifold {
        points.clear();
    }
    if let Some(contacts) = &mut outputs.contacts {
        contacts.contacts.clear();
        contacts.complete = false;
    }
    if let Some(proof) = &mut outputs.proof {
        proof.pairs.clear();
    }
    let Asked { scans: [a, b], plan, budget } = asked;
    let options = plan.options();
    let hint = outputs.hint.as_deref_mut().filter(|_| outputs.contacts.is_none());
    let met = hint.and_then(|hint| still_met(asked, hint));
    if let (Some(answer), None) = (met, &outputs.manifold) {
        return answer;
    }
    let meter = Meter::new(budget, [a, b], evaluations);
    let (pose, relative) = match relative(a, b, plan) {
        Ok(relative_pose) => relative_pose,
        Err(early) => return without_a_search(asked, early, meter.spent, outputs),
    };
    let by = (scratch.level, options.semantics.part());
    let (arrays_a, arrays_b) = (a.scan().arrays(), b.scan().arrays());
    let arrays = [&arrays_a, &arrays_b];
    let pair = ScanPair::new([a, b], arrays, relative, meter, by);
    let manifold = outputs.manifold.take();
    let answer = met.unwrap_or_else(|| decide(pair, &pose, asked, scratch, outputs, look));
    match (answer.verdict, manifold) {
        (Verdict::Intersecting { contact, .. }, Some(points)) => {
            let meter = Meter::new(budget, [a, b], evaluations).after(answer.statistics);
            let mut pair = ScanPair::new([a, b], arrays, relative, meter, by);
            manifold::gather(&mut pair, options, &contact, &mut scratch.manifold, points);
            Answer { statistics: pair.meter.spent, ..answer }
        }
        _ => answer,
    }
}

/// The answer if the bounding balls of the scans are `distance` apart, or if a pose is invalid.
fn without_a_search(
    asked: Asked<'_>,
    distance: Option<f64>,
    spent: Statistics,
    outputs: Outputs<'_>,
) -> Answer {
    let statistics = Statistics { node_pairs: 1, ..spent };
    let Some(distance) = distance else {
        let verdict = Verdict::Undecided(Reason::Pose);
        return Answer { verdict, band: f64::INFINITY, distance_estimate: None, statistics };
    };
    if let Some(contacts) = outputs.contacts {
        contacts.complete = true;
    }
    let verdict = apart(asked.plan.options(), distance, true);
    if let Some(proof) = outputs.proof.filter(|_| asked.plan.options().certifies()) {
        proof.pairs.push((NodePair::ROOTS, distance));
    }
    let reach = |view: &Placed<'_>| f64::from(view.scan().root_box().reach) * view.stored_to_world().scale();
    let band = asked.scans.map(reach).into_iter().fold(0.0, f64::max);
    Answer { verdict, band, distance_estimate: None, statistics }
}

/// Decides a question from the hint if possible, and otherwise by a search.
fn decide(
    pair: ScanPair<'_>,
    pose: &Pose,
    asked: Asked<'_>,
    scratch: &mut ContactScratch,
    outputs: Outputs<'_>,
    look: impl FnOnce(&mut Surfaces<'_>, &mut Frontiers) -> ControlFlow<()>,
) -> Answer {
    let (plan, options) = (asked.plan, asked.plan.options());
    let mut known = outputs.hint.map(|hint| hint.recall(pair.views, options));
    let early = known.as_mut().and_then(|known| {
        known.come_to(*pose, &pair);
        // A distance known from earlier poses has no list of node pairs to prove it.
        let distance = known.distance(&pair, plan.reach()).filter(|_| outputs.proof.is_none())?;
        Some((apart(options, distance, true), pair.band_of(NodePair::ROOTS)))
    });
    if let Some((verdict, band)) = early {
        if let Some(contacts) = outputs.contacts {
            contacts.complete = true;
        }
        return Answer { verdict, band, distance_estimate: None, statistics: pair.meter.spent };
    }
    match options.semantics {
        Semantics::Obstacle | Semantics::Surface => {
            let beside = (known, outputs.proof, outputs.contacts);
            surfaces((pair, pose), options, scratch, beside, look)
        }
        Semantics::Thickened(_) => balls(pair, plan, scratch, (known, outputs.contacts)),
    }
}

/// Returns the answer if the points that met in the last query still show a contact. Reads nothing
/// but these two points.
fn still_met(asked: Asked<'_>, hint: &mut PairHint) -> Option<Answer> {
    let Asked { scans, plan, .. } = asked;
    let options = plan.options();
    let (known, met) = hint.met(scans, options)?;
    let pose = relative_pose(scans.map(Placed::stored_to_world))?;
    let pair = PointPair::new(scans, met);
    let (contact, evidence) = match options.semantics {
        Semantics::Thickened(_) => {
            (pair.distance() <= plan.reach()).then(|| (pair.midpoint(), Evidence::Certified))
        }
        Semantics::Obstacle if !pair.are_sheets() => pair.ball_contact(plan.reach()),
        // A witness needs its own search.
        _ if options.detail == Detail::Witness => None,
        // The slack of the pose plays no part in the test.
        _ => pair
            .cross(&Relative::new(&pose, 0.0), options.semantics.part())
            .then(|| (pair.shared_chord(), Evidence::Estimated)),
    }?;
    known.still_met(pose);
    let verdict = Verdict::Intersecting { contact, evidence };
    Some(Answer { verdict, band: pair.band(), distance_estimate: None, statistics: Statistics::default() })
}

/// Compares pairs of tangent discs, and then pairs of enclosures if the discs show no contact and a
/// certificate is requested.
fn surfaces(
    (mut pair, pose): (ScanPair<'_>, &Pose),
    options: &CollideOptions,
    scratch: &mut ContactScratch,
    (mut known, proof, contacts): (Option<&mut Known>, Option<&mut Proof>, Option<&mut Contacts>),
    look: impl FnOnce(&mut Surfaces<'_>, &mut Frontiers) -> ControlFlow<()>,
) -> Answer {
    let ContactScratch { frontiers, gathers, excluded, compared, proven, proof: open, .. } = scratch;
    let reach = pair.stored(options.margin);
    // Enclosures contain the boxes of discs, so a pair that they separate has no contact.
    if let Some(known) = known.as_mut().filter(|_| proof.is_none())
        && let Some(distance) =
            known.prove_again(pose, &mut Certifier::new(&mut pair, reach, proven), (compared, open))
    {
        if let Some(contacts) = contacts {
            contacts.complete = true;
        }
        scratch.longest_stretch = pair.meter.longest_stretch;
        let (verdict, band) = (apart(options, distance, true), pair.band_of(NodePair::ROOTS));
        return Answer { verdict, band, distance_estimate: None, statistics: pair.meter.spent };
    }
    let is_slow = known.as_ref().is_some_and(|known| known.keeps_front(&pair));
    let (all, complete) = contacts.map(Contacts::parts).unzip();
    let mut search = Surfaces::new(pair, options, is_slow, Workspace { gathers, excluded, compared, all });
    frontiers.clear();
    let ended = from_before(&mut search, options, known.as_deref_mut(), frontiers, look).is_break();
    if let Some(complete) = complete {
        *complete = !ended;
    }
    let Surfaces { pair, found, doubt, excluded, compared, met, .. } = &mut search;
    let parted = !ended && found.is_none();
    let mut band = met.map_or_else(|| pair.band_of(NodePair::ROOTS), |met| pair.band(met));
    let mut doubtful = None;
    let verdict = match (*found, *doubt) {
        (Some((contact, evidence)), _) => Verdict::Intersecting { contact, evidence },
        _ if ended => {
            let likelihood = likelihood(pair, reach, frontiers.open());
            Verdict::Undecided(Reason::Budget { likelihood })
        }
        (None, Some(reason)) => Verdict::Undecided(reason),
        _ if !options.certifies() => apart(options, 0.0, false),
        _ if known.as_ref().is_some_and(|known| known.is_doubtful()) => apart(options, 0.0, false),
        _ => {
            let keeps_proof = known.as_ref().is_some_and(|known| known.keeps_proof(pair));
            let mut certifier = Certifier::new(pair, reach, proven);
            let proven = certifier.prove(pose, compared, open, (proof, keeps_proof));
            if let Some((distance, near)) = proven {
                band = near;
                match &mut known {
                    Some(known) if keeps_proof => known.proven(distance, certifier.proven, certifier.pair),
                    Some(known) => known.proven_alone(distance, certifier.pair),
                    None => {}
                }
            }
            doubtful = certifier.doubtful;
            apart(options, proven.map_or(0.0, |(distance, _)| distance), proven.is_some())
        }
    };
    if let Some(known) = known
        && !is_certified(&verdict)
    {
        if parted && is_slow {
            known.parted((excluded, compared), pair.relative.slack(), options.certifies(), doubtful);
        } else {
            known.forget(*met);
        }
    }
    scratch.longest_stretch = pair.meter.longest_stretch;
    Answer { verdict, band, distance_estimate: None, statistics: pair.meter.spent }
}

/// Searches for a contact: at the last contact first, then from the frontier of the last query if
/// there is one, otherwise with `look`.
fn from_before(
    search: &mut Surfaces<'_>,
    options: &CollideOptions,
    known: Option<&mut Known>,
    frontiers: &mut Frontiers,
    look: impl FnOnce(&mut Surfaces<'_>, &mut Frontiers) -> ControlFlow<()>,
) -> ControlFlow<()> {
    let Some(known) = known else { return look(search, frontiers) };
    // The list of all contacts comes from a search from the roots, in its order.
    if search.all.is_none() {
        if let Some(points) = known.met() {
            let leaves = search.pair.numbers(search.pair.leaves_of(points));
            search.leaf_pair(leaves)?;
            search.compared.clear();
        }
        if known.has_front(&search.pair, search.reach, options.certifies()) {
            return known.look_again(search, &mut frontiers.stack);
        }
    }
    known.forget(None);
    look(search, frontiers)
}

/// Searches for a contact from the pair of the roots on.
fn from_the_roots(
    search: &mut Surfaces<'_>,
    by_overlap: bool,
    Frontiers { stack, heap }: &mut Frontiers,
) -> ControlFlow<()> {
    let (relative, level) = (search.pair.relative, search.pair.level);
    let trees = search.pair.trees(&relative, search.reach);
    match (by_overlap, search.notes) {
        (false, false) if search.wants_any() => {
            descend(trees, level, &mut Plunging::new(stack), &mut Plain(search))
        }
        (false, false) => descend(trees, level, stack, &mut Plain(search)),
        (false, true) => descend(trees, level, stack, &mut Closer(search)),
        (true, false) => descend(trees, level, heap, &mut Plain(search)),
        (true, true) => descend(trees, level, heap, &mut Closer(search)),
    }
}

/// Compares balls about points.
fn balls(
    pair: ScanPair<'_>,
    plan: &CollidePlan,
    scratch: &mut ContactScratch,
    (mut known, contacts): (Option<&mut Known>, Option<&mut Contacts>),
) -> Answer {
    let (all, complete) = contacts.map(Contacts::parts).unzip();
    let mut search = Balls::new(pair, plan.reach(), all);
    let Frontiers { stack, .. } = &mut scratch.frontiers;
    stack.clear();
    let again = known.as_ref().and_then(|known| known.met()).filter(|_| search.all.is_none());
    let mut ended = again.is_some_and(|points| search.compare(search.pair.leaves_of(points)).is_break());
    if !ended {
        search.apart = f64::INFINITY;
        let (relative, level) = (search.pair.relative, search.pair.level);
        let trees = search.pair.trees(&relative, search.reach_stored);
        let flow = if search.all.is_none() {
            descend(trees, level, &mut Plunging::new(stack), &mut search)
        } else {
            descend(trees, level, stack, &mut search)
        };
        ended = flow.is_break();
    }
    if let Some(complete) = complete {
        *complete = !ended;
    }
    let verdict = match search.found {
        Some((contact, _)) => Verdict::Intersecting { contact, evidence: Evidence::Certified },
        None if ended => {
            let likelihood = likelihood(&search.pair, search.reach_stored, stack.iter());
            Verdict::Undecided(Reason::Budget { likelihood })
        }
        None => apart(plan.options(), search.apart, true),
    };
    if let Some(known) = &mut known {
        known.forget(search.found.map(|(_, points)| points));
        if verdict.is_separated() {
            known.clear_to(search.apart, &search.pair);
        }
    }
    scratch.longest_stretch = search.pair.meter.longest_stretch;
    let band = search
        .found
        .map_or_else(|| search.pair.band_of(NodePair::ROOTS), |(_, points)| search.pair.band(points));
    Answer { verdict, band, distance_estimate: None, statistics: search.pair.meter.spent }
}

/// The verdict for a separation by `distance` between surfaces or points, which is certified if
/// `proven`.
pub(crate) fn apart(options: &CollideOptions, distance: f64, proven: bool) -> Verdict {
    match options.semantics {
        Semantics::Thickened(radius) => {
            Verdict::Separated { gap: (distance - 2.0 * radius).max(0.0), evidence: Evidence::Certified }
        }
        _ if proven && options.certifies() => {
            Verdict::Separated { gap: distance.max(0.0), evidence: Evidence::Certified }
        }
        _ => Verdict::Separated { gap: 0.0, evidence: Evidence::Estimated },
    }
}

fn is_certified(verdict: &Verdict) -> bool {
    matches!(verdict, Verdict::Separated { evidence: Evidence::Certified, .. })
}
