//! The query: do two scans meet?
//!
//! next node pair → boxes apart? drop → two leaves? compare their points: a crossing is a hit → otherwise the
//! children of both, or of the much larger one; the deepest overlap first, after nothing that of all that is
//! left.

use std::ops::ControlFlow;
use std::time::Duration;

use fearless_simd::Level;
use nearmiss_geometry::Pose;
use nearmiss_hierarchy::{Heap, NodePair, Plunging, Stack, descend};

use crate::budget::{Budget, Meter, NODE_PAIRS_A_LEAF_PAIR};
use crate::certify::{Bound, Certifier, Proof, ProofScratch};
use crate::hint::{Known, PairHint};
use crate::interpolation::InterpolationScratch;
use crate::leaf_pair::Instructions;
use crate::likelihood::likelihood;
use crate::manifold::{self, ManifoldPoint, ManifoldScratch};
use crate::options::{CollideOptions, CollidePlan, Detail, Method, Order, Semantics};
use crate::posed::{Posed, relative};
use crate::surface::{Closer, Plain, Surfaces, Workspace};
use crate::thickened::{Balls, balls_meet};
use crate::verdict::{Answer, Contact, Evidence, Reason, Statistics, Verdict};
use crate::view::{ScanView, ViewScratch};

/// Reused between queries, one a thread; never influences an answer.
#[derive(Debug, Clone, Default)]
pub struct CollideScratch {
    frontiers: Frontiers,
    instructions: Instructions,
    gathers: [ViewScratch; 2],
    excluded: Vec<Bound>,
    compared: Vec<NodePair>,
    members: Vec<u32>,
    interpolation: InterpolationScratch,
    proven: Vec<Bound>,
    proof: ProofScratch,
    longest_stretch: Duration,
    manifold: ManifoldScratch,
}

/// The pairs of nodes still to be looked at, by how a search goes on.
#[derive(Debug, Clone, Default)]
struct Frontiers {
    /// Depth first.
    stack: Stack,
    /// The most urgent first.
    heap: Heap,
}

impl Frontiers {
    fn clear(&mut self) {
        self.stack.clear();
        self.heap.clear();
    }

    /// What is still there. A search goes on from a front depth first, whatever its order.
    fn open(&self) -> impl Iterator<Item = NodePair> {
        self.stack.iter().chain(self.heap.iter())
    }
}

impl CollideScratch {
    /// For code in lanes by this level instead of the best there is, to compare: answers are the same by any.
    #[must_use]
    pub fn by_level(level: Level) -> Self {
        Self { instructions: Instructions(level), ..Self::default() }
    }

    /// The longest time that the last query with a deadline did not look at the clock; zero without a
    /// deadline. What a query may be late by, beside what the machine takes away.
    #[must_use]
    pub fn longest_stretch(&self) -> Duration {
        self.longest_stretch
    }

    /// Where the scans of the last query with [`Detail::Manifold`] meet: the deepest place first, then ever
    /// again the one furthest from those before it, up to eight. Empty after any other answer than that they
    /// meet.
    #[must_use]
    pub fn manifold(&self) -> &[ManifoldPoint] {
        &self.manifold.points
    }
}

/// Whether `a` and `b` meet. Allocates a scratch of its own; see [`collide_with`].
#[must_use]
pub fn collide(a: &ScanView<'_>, b: &ScanView<'_>, plan: &CollidePlan, budget: &Budget) -> Answer {
    collide_with(a, b, plan, budget, &mut CollideScratch::default())
}

/// Whether `a` and `b` meet, as `plan` means it, within `budget`.
///
/// Does not allocate once `scratch` is warm. The same question with the same work budget has the same answer
/// whatever was asked before.
pub fn collide_with(
    a: &ScanView<'_>,
    b: &ScanView<'_>,
    plan: &CollidePlan,
    budget: &Budget,
    scratch: &mut CollideScratch,
) -> Answer {
    search(a, b, plan, budget, scratch, Extras::default())
}

/// As [`collide_with`], and leaves in `proof` what a certified separation of surfaces rests on; nothing after
/// any other answer.
pub fn collide_proving(
    a: &ScanView<'_>,
    b: &ScanView<'_>,
    plan: &CollidePlan,
    budget: &Budget,
    scratch: &mut CollideScratch,
    proof: &mut Proof,
) -> Answer {
    proof.pairs.clear();
    let answer = search(a, b, plan, budget, scratch, Extras { proof: Some(proof), ..Extras::default() });
    if !matches!(answer.verdict, Verdict::Separated { evidence: Evidence::Certified, .. }) {
        proof.pairs.clear();
    }
    answer
}

/// As [`collide_with`], for two scans that were asked about before in poses not far from these: `hint`
/// remembers where they met, or what kept them apart.
///
/// Changes no verdict but those that a budget ends, whatever `hint` was used for before. Evidence may differ:
/// a certified gap may be less than without a hint, and about one separation in a thousand is certified with
/// a hint and estimated without, or the reverse. A hint is not checked: read back only one that was written
/// here. Searches with a resolution and those by any other method than [`Method::Traversal`] do without. What
/// it remembers is worth most for small motions: a step of a tenth of a sampling radius, as a simulation
/// makes, takes a fraction of a query.
pub fn collide_hinted(
    a: &ScanView<'_>,
    b: &ScanView<'_>,
    plan: &CollidePlan,
    budget: &Budget,
    hint: &mut PairHint,
    scratch: &mut CollideScratch,
) -> Answer {
    search(a, b, plan, budget, scratch, Extras { hint: Some(hint), ..Extras::default() })
}

/// The places where two scans meet, beside the [`Answer`].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Contacts {
    /// One of every pair of leaves that meets, unrefined, in the order of the search.
    pub contacts: Vec<Contact>,
    /// Whether these are all: the budget lasted.
    pub complete: bool,
}

impl Contacts {
    fn parts(&mut self) -> (&mut Vec<Contact>, &mut bool) {
        (&mut self.contacts, &mut self.complete)
    }
}

/// As [`collide_with`], but looks on after the first contact and leaves all of them in `contacts`: one for
/// each pair of leaves of which two discs cross (two points are near enough, a test point saw the crossing,
/// as `plan` means it), to first order. The answer's is the first that is certified, of the first few, or
/// else the first; [`collide_with`], which looks for any, may tell of another of them.
///
/// Costs a descent to all leaves that meet; does not allocate once `scratch` and `contacts` are warm.
pub fn collide_all(
    a: &ScanView<'_>,
    b: &ScanView<'_>,
    plan: &CollidePlan,
    budget: &Budget,
    contacts: &mut Contacts,
    scratch: &mut CollideScratch,
) -> Answer {
    contacts.contacts.clear();
    search(a, b, plan, budget, scratch, Extras { all: Some(contacts), ..Extras::default() })
}

/// What is written besides an answer.
#[derive(Default)]
struct Extras<'a> {
    hint: Option<&'a mut PairHint>,
    proof: Option<&'a mut Proof>,
    all: Option<&'a mut Contacts>,
}

fn search(
    a: &ScanView<'_>,
    b: &ScanView<'_>,
    plan: &CollidePlan,
    budget: &Budget,
    scratch: &mut CollideScratch,
    extras: Extras<'_>,
) -> Answer {
    scratch.manifold.points.clear();
    let options = plan.options();
    let meter = meter([a, b], options, budget);
    let (pose, relative) = match relative(a, b, plan) {
        Ok(motion) => motion,
        Err(early) => {
            if let Some(all) = extras.all {
                all.complete = early.is_some();
            }
            let verdict = early.map_or(Verdict::Undecided(Reason::Pose), |distance| {
                if let Some(proof) = extras.proof {
                    proof.pairs.push((NodePair::ROOTS, distance));
                }
                apart(options, distance, true)
            });
            let statistics = Statistics { node_pairs: 1, ..meter.spent };
            let band = if early.is_some() { greatest_band([a, b]) } else { f64::INFINITY };
            return Answer { verdict, band, distance_estimate: None, statistics };
        }
    };
    let by = (scratch.instructions.0, options.semantics.part());
    let slices = [a.scan().slices(), b.scan().slices()];
    let pair = Posed::new([a, b], slices.each_ref(), relative, meter, by);
    let answer = decide(pair, pose, (plan, budget), scratch, extras);
    match answer.verdict {
        Verdict::Intersecting { contact, .. } if options.detail == Detail::Manifold => {
            let mut spent = self::meter([a, b], options, budget);
            spent.spent = answer.statistics;
            let mut pair = Posed::new([a, b], slices.each_ref(), relative, spent, by);
            manifold::gather(&mut pair, options, &contact, scratch.instructions.0, &mut scratch.manifold);
            Answer { statistics: pair.meter.spent, ..answer }
        }
        _ => answer,
    }
}

/// The greatest local radius of any point of two scans, in the world.
fn greatest_band(views: [&ScanView<'_>; 2]) -> f64 {
    views
        .map(|view| f64::from(view.scan().root_box().reach) * view.placed().scale())
        .into_iter()
        .fold(0.0, f64::max)
}

/// What a query may spend.
fn meter(views: [&ScanView<'_>; 2], options: &CollideOptions, budget: &Budget) -> Meter {
    let leaves = views.map(|view| view.scan().topology().leaves() as u64);
    let points = views.map(|view| u64::from(view.scan().leaf_size()));
    let test_points = match options.method {
        Method::Traversal => 0,
        Method::Sampling(sampling) => u64::from(sampling.test_points),
        Method::Interpolation(_) => points[0],
    };
    let looked_at = match options.order {
        Some(Order::Sides | Order::SidesByGap) => views[0].scan().slices().samples(0).len() as u64,
        _ => 0,
    };
    let evaluations = 2 * test_points + NODE_PAIRS_A_LEAF_PAIR * looked_at;
    Meter::new(budget, leaves, points, evaluations)
}

/// What is known from before, and then what there is to see.
fn decide(
    pair: Posed<'_>,
    pose: Pose,
    (plan, budget): (&CollidePlan, &Budget),
    scratch: &mut CollideScratch,
    extras: Extras<'_>,
) -> Answer {
    let options = plan.options();
    // What was seen at some resolution says nothing of the rest, and which leaves are tested by points, which
    // see more than crossings, depends on the way to them.
    let is_exact = budget.resolution.is_none() && options.method == Method::Traversal;
    let hint = extras.hint.filter(|_| is_exact);
    let mut known = hint.map(|hint| hint.recall(&pair, options));
    let early = known.as_mut().and_then(|known| {
        if let Some(met) = known.met(&pair)
            && let Some((contact, evidence)) = still_meet(&pair, plan, met)
        {
            known.still_met(pose);
            return Some((Verdict::Intersecting { contact, evidence }, pair.band(met)));
        }
        known.come_to(pose, &pair);
        let distance = known.distance(&pair, plan.reach())?;
        Some((apart(options, distance, true), pair.band_of(NodePair::ROOTS)))
    });
    if let Some((verdict, band)) = early {
        return Answer { verdict, band, distance_estimate: None, statistics: pair.meter.spent };
    }
    match options.semantics {
        Semantics::Obstacle | Semantics::Surface => {
            surfaces((pair, &pose), options, budget, scratch, (known, extras.proof, extras.all))
        }
        Semantics::Thickened(_) => balls(pair, plan, scratch, known, extras.all),
    }
}

/// What is seen of a contact at the points of another.
fn still_meet(pair: &Posed<'_>, plan: &CollidePlan, [i, j]: [usize; 2]) -> Option<(Contact, Evidence)> {
    match plan.options().semantics {
        Semantics::Thickened(_) => {
            balls_meet(pair, plan.reach(), [i, j]).map(|contact| (contact, Evidence::Certified))
        }
        Semantics::Obstacle if !pair.are_sheets([i, j]) => pair.ball_contact([i, j], plan.reach()),
        // A witness takes a search of its own.
        _ if plan.options().detail == Detail::Witness => None,
        _ => pair.crosses([i, j]).then(|| (pair.shared_chord(i, j), Evidence::Estimated)),
    }
}

/// Pairs of tangent discs, then, if they are apart and a certificate is wanted, pairs of enclosures.
fn surfaces(
    (pair, pose): (Posed<'_>, &Pose),
    options: &CollideOptions,
    budget: &Budget,
    scratch: &mut CollideScratch,
    (mut known, proof, all): (Option<&mut Known>, Option<&mut Proof>, Option<&mut Contacts>),
) -> Answer {
    let CollideScratch {
        frontiers,
        instructions,
        gathers,
        excluded,
        compared,
        members,
        interpolation,
        proven,
        proof: open,
        longest_stretch,
        ..
    } = scratch;
    let reach = pair.stored(options.margin);
    let mut certifier = Certifier::new(pair, reach, proven);
    // Enclosures hold the boxes: what they part has no contact.
    if let Some(known) = &mut known
        && let Some(distance) = known.prove_again(pose, &mut certifier, (&mut *compared, &mut *open))
    {
        let (verdict, statistics) = (apart(options, distance, true), certifier.pair.meter.spent);
        *longest_stretch = certifier.pair.meter.longest_stretch;
        let band = certifier.pair.band_of(NodePair::ROOTS);
        return Answer { verdict, band, distance_estimate: None, statistics };
    }
    let Certifier { pair, proven, .. } = certifier;
    let is_slow = known.as_ref().is_some_and(|known| known.keeps_front(&pair));
    let (all, complete) = all.map(Contacts::parts).unzip();
    let instructions = *instructions;
    let workspace = Workspace { instructions, gathers, excluded, compared, members, interpolation, all };
    let mut search = Surfaces::new(pair, options, budget, is_slow, workspace);
    let ended = look(&mut search, options, known.as_deref_mut(), frontiers).is_break();
    if let Some(complete) = complete {
        *complete = !ended;
    }
    let parted = !ended && search.found.is_none();
    let Surfaces { pair, found, doubt, estimate, excluded, compared, met, .. } = search;
    let mut certifier = Certifier::new(pair, reach, proven);
    let mut band =
        met.map_or_else(|| certifier.pair.band_of(NodePair::ROOTS), |met| certifier.pair.band(met));
    let verdict = match (found, doubt) {
        (Some((contact, evidence)), _) => Verdict::Intersecting { contact, evidence },
        _ if ended => {
            let likelihood = likelihood(&certifier.pair, reach, frontiers.open());
            Verdict::Undecided(Reason::Budget { likelihood })
        }
        (None, Some(reason)) => Verdict::Undecided(reason),
        _ if !options.certifies() => apart(options, 0.0, false),
        _ if known.as_ref().is_some_and(|known| known.is_doubtful()) => apart(options, 0.0, false),
        _ => {
            let proven = certifier.prove(pose, compared, open, (proof, known.is_some()));
            if let Some((distance, near)) = proven {
                band = near;
                if let Some(known) = &mut known {
                    known.proven(distance, certifier.proven, &certifier.pair);
                }
            }
            apart(options, proven.map_or(0.0, |(distance, _)| distance), proven.is_some())
        }
    };
    if let Some(known) = known
        && !matches!(verdict, Verdict::Separated { evidence: Evidence::Certified, .. })
    {
        if parted && is_slow {
            let slack = certifier.pair.relative.slack();
            known.parted((excluded, compared), slack, options.certifies(), certifier.doubtful);
        } else {
            known.forget(met);
        }
    }
    *longest_stretch = certifier.pair.meter.longest_stretch;
    let distance_estimate = Some(estimate).filter(|distance| distance.is_finite());
    Answer { verdict, band, distance_estimate, statistics: certifier.pair.meter.spent }
}

/// Looks for a contact: where there was one, then from what kept the scans apart, or from the roots.
fn look(
    search: &mut Surfaces<'_>,
    options: &CollideOptions,
    known: Option<&mut Known>,
    frontiers: &mut Frontiers,
) -> ControlFlow<()> {
    frontiers.clear();
    if let Method::Sampling(sampling) = options.method
        && sampling.flat
    {
        return search.test_all(&sampling);
    }
    if let Method::Interpolation(interpolation) = options.method {
        search.interpolation.sides.clear();
        if interpolation.flat {
            return search.interpolate_all(&interpolation);
        }
        if search.pair.views[0].graph().is_none() {
            search.doubt = Some(Reason::NoGraph);
            return ControlFlow::Continue(());
        }
    }
    if let Some(known) = known {
        if let Some(points) = known.met(&search.pair) {
            let leaves = search.pair.numbers(search.pair.leaves_of(points));
            search.leaf_pair(leaves)?;
            search.compared.clear();
        }
        if known.has_front(&search.pair, search.reach, options.certifies()) {
            return known.look_again(search, &mut frontiers.stack);
        }
        known.forget(None);
    }
    let (relative, level) = (search.pair.relative, search.instructions.0);
    let trees = search.pair.trees(&relative, search.reach);
    let Frontiers { stack, heap } = frontiers;
    match (search.order, search.is_plain) {
        (Order::DepthFirst, true) if search.wants_any() => {
            descend(trees, level, &mut Plunging::new(stack), &mut Plain(search))
        }
        (Order::DepthFirst, true) => descend(trees, level, stack, &mut Plain(search)),
        (Order::DepthFirst, false) => descend(trees, level, stack, &mut Closer(search)),
        (_, true) => descend(trees, level, heap, &mut Plain(search)),
        (_, false) => descend(trees, level, heap, &mut Closer(search)),
    }
}

/// Pairs of points.
fn balls(
    pair: Posed<'_>,
    plan: &CollidePlan,
    scratch: &mut CollideScratch,
    mut known: Option<&mut Known>,
    all: Option<&mut Contacts>,
) -> Answer {
    let (contacts, complete) = all.map(Contacts::parts).unzip();
    let mut search = Balls::new(pair, plan.reach(), scratch.instructions, contacts);
    scratch.frontiers.clear();
    let again = known.as_ref().and_then(|known| known.met(&search.pair));
    let mut ended = again.is_some_and(|points| search.compare(search.pair.leaves_of(points)).is_break());
    if !ended {
        search.apart = f64::INFINITY;
        let relative = search.pair.relative;
        let trees = search.pair.trees(&relative, search.reach_stored);
        let (level, stack) = (scratch.instructions.0, &mut scratch.frontiers.stack);
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
            let likelihood = likelihood(&search.pair, search.reach_stored, scratch.frontiers.open());
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

/// Apart, by at least `distance` between surfaces or points if that is `proven`.
fn apart(options: &CollideOptions, distance: f64, proven: bool) -> Verdict {
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
