//! The query: do two scans meet?
//!
//! next node pair → boxes apart? drop → two leaves? compare their points: a crossing is a hit → otherwise the
//! children of both, or of the much larger one; the deepest overlap first.

use nearmiss_geometry::nalgebra::{Matrix3, Vector3};
use nearmiss_geometry::{NodeId, Pose};
use nearmiss_hierarchy::{Frontier, GatherScratch, NodePair, Relative, SLACK, Stack, descend};

use crate::budget::{Budget, Meter};
use crate::certify::{Bound, Certifier, Excluded, Proof};
use crate::crossing::Lanes;
use crate::options::{CollideOptions, CollidePlan, Semantics};
use crate::posed::Posed;
use crate::surface::Surfaces;
use crate::thickened::Balls;
use crate::verdict::{Answer, Evidence, Reason, Statistics, Verdict};
use crate::view::ScanView;

/// Reused between queries, one a thread; never influences an answer.
#[derive(Debug, Clone, Default)]
pub struct CollideScratch {
    stack: Stack,
    lanes: Lanes,
    gathers: [GatherScratch; 2],
    excluded: Vec<Excluded>,
    proven: Vec<Bound>,
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
    search(a, b, plan, budget, scratch, None)
}

/// As [`collide_with`], and leaves in `proof` what a certified separation of surfaces rests on; nothing after any
/// other answer.
pub fn collide_proving(
    a: &ScanView<'_>,
    b: &ScanView<'_>,
    plan: &CollidePlan,
    budget: &Budget,
    scratch: &mut CollideScratch,
    proof: &mut Proof,
) -> Answer {
    proof.pairs.clear();
    let answer = search(a, b, plan, budget, scratch, Some(proof));
    if !matches!(answer.verdict, Verdict::Separated { evidence: Evidence::Certified, .. }) {
        proof.pairs.clear();
    }
    answer
}

fn search(
    a: &ScanView<'_>,
    b: &ScanView<'_>,
    plan: &CollidePlan,
    budget: &Budget,
    scratch: &mut CollideScratch,
    proof: Option<&mut Proof>,
) -> Answer {
    let [leaves, points] = [
        [a, b].map(|view| view.slices().nodes.len().div_ceil(2) as u64),
        [a, b].map(|view| u64::from(view.scan().leaf_size())),
    ];
    let meter = Meter::new(budget, leaves, points);
    let options = plan.options();
    let relative = match relative(a, b, plan) {
        Ok(relative) => relative,
        Err(early) => {
            let verdict = early.map_or(Verdict::Undecided(Reason::Pose), |distance| {
                if let Some(proof) = proof {
                    let roots = NodePair { a: NodeId::ROOT, b: NodeId::ROOT };
                    proof.pairs.push((roots, distance));
                }
                apart(options, distance, true)
            });
            let statistics = Statistics { node_pairs: 1, ..meter.spent };
            return Answer { verdict, statistics };
        }
    };
    let pair = Posed::new([a, b], relative, meter);
    match options.semantics {
        Semantics::Surface => surfaces(pair, options, scratch, proof),
        Semantics::Thickened(_) => balls(pair, plan, scratch),
    }
}

/// Pairs of tangent discs, then, if they are apart and a certificate is wanted, pairs of enclosures.
fn surfaces(
    pair: Posed<'_>,
    options: &CollideOptions,
    scratch: &mut CollideScratch,
    proof: Option<&mut Proof>,
) -> Answer {
    let CollideScratch { stack, lanes, gathers, excluded, proven } = scratch;
    let (nodes_a, nodes_b) = (pair.a.nodes, pair.b.nodes);
    let mut search = Surfaces::new(pair, options, lanes, gathers, excluded);
    let ended = descend(nodes_a, nodes_b, &mut search, stack).is_break();
    let Surfaces { pair, found, doubt, reach, excluded, .. } = search;
    let mut statistics = pair.meter.spent;
    let verdict = match (found, doubt) {
        (Some((contact, evidence)), _) => Verdict::Intersecting { contact, evidence },
        _ if ended => Verdict::Undecided(Reason::Budget { likelihood: likelihood(&pair, stack) }),
        (None, Some(reason)) => Verdict::Undecided(reason),
        // Leaves whose boxes overlap have enclosures that overlap.
        (None, None) if !options.certifies() || statistics.leaf_pairs > 0 => apart(options, 0.0, false),
        (None, None) => {
            let mut certifier = Certifier::new(pair, reach, proven);
            let whole = certifier.prove(excluded, stack).is_continue();
            let distance = if whole { certifier.tighten() } else { 0.0 };
            if let Some(proof) = proof.filter(|_| whole) {
                certifier.hand_out(proof);
            }
            statistics = certifier.pair.meter.spent;
            apart(options, distance, whole)
        }
    };
    Answer { verdict, statistics }
}

/// Pairs of points.
fn balls(pair: Posed<'_>, plan: &CollidePlan, scratch: &mut CollideScratch) -> Answer {
    let (nodes_a, nodes_b) = (pair.a.nodes, pair.b.nodes);
    let mut search = Balls::new(pair, plan.reach());
    let ended = descend(nodes_a, nodes_b, &mut search, &mut scratch.stack).is_break();
    let verdict = match search.found {
        Some(contact) => Verdict::Intersecting { contact, evidence: Evidence::Certified },
        None if ended => {
            Verdict::Undecided(Reason::Budget { likelihood: likelihood(&search.pair, &scratch.stack) })
        }
        None => apart(plan.options(), search.apart, true),
    };
    Answer { verdict, statistics: search.pair.meter.spent }
}

/// Apart, by at least `distance` between surfaces or points if that is `proven`.
fn apart(options: &CollideOptions, distance: f64, proven: bool) -> Verdict {
    match options.semantics {
        Semantics::Thickened(radius) => {
            Verdict::Separated { gap: (distance - 2.0 * radius).max(0.0), evidence: Evidence::Certified }
        }
        Semantics::Surface if proven && options.certifies() => {
            Verdict::Separated { gap: distance.max(0.0), evidence: Evidence::Certified }
        }
        Semantics::Surface => Verdict::Separated { gap: 0.0, evidence: Evidence::Estimated },
    }
}

/// From so many radii on the distance of balls is a good bound, and single precision less and less use.
const FAR_APART: f64 = 100.0;

/// Scans whose stored frames differ in scale by more than this are not compared in single precision.
const GREATEST_RATIO: f64 = (1_u64 << 60) as f64;

/// The motion of b's stored frame into a's. An error is the distance of balls about the two scans if that is more
/// than any contact reaches, or `None` for poses that are none.
fn relative(a: &ScanView<'_>, b: &ScanView<'_>, plan: &CollidePlan) -> Result<Relative, Option<f64>> {
    let ratio = b.placed().scale() / a.placed().scale();
    let finite = |m: [f64; 16]| m.iter().all(|x| x.is_finite());
    let proper = [a, b].iter().all(|view| finite(view.placed().to_row_major()) && is_rotation(view.placed()));
    let positive = a.placed().scale() > 0.0 && b.placed().scale() > 0.0;
    if !(proper && positive && (1.0 / GREATEST_RATIO..=GREATEST_RATIO).contains(&ratio)) {
        return Err(None);
    }
    let [(ca, ra, own), (cb, rb, _)] = [a, b].map(|view| {
        // The enclosure contains the box.
        let root = match plan.options().semantics {
            Semantics::Surface => view.slices().enclosure(0),
            Semantics::Thickened(_) => view.slices().boxes[0],
        };
        let centre = view.placed().apply(root.centre.map(f64::from));
        (Vector3::from(centre), f64::from(root.radius()) * view.placed().scale(), root.centre)
    });
    // What double precision loses of places far from the origin of the world.
    let far = [a, b].map(|view| Vector3::from(view.placed().translation()).norm());
    let lost = DOUBLE_ROUNDING * (far[0] + far[1] + ca.norm() + cb.norm());
    let gap = (ca - cb).norm() * (1.0 - 1e-6) - (ra + rb) * (1.0 + 1e-6) - lost;
    if gap.is_nan() || gap == f64::INFINITY {
        return Err(None);
    }
    // A certificate has more to say, unless they are so far apart that balls say nearly all.
    if gap > plan.reach() && (!plan.options().certifies() || gap > FAR_APART * (ra + rb)) {
        return Err(Some(gap));
    }
    let pose = a.placed().inverse().after(b.placed());
    // Coordinates in a's stored frame: of its own points, and of b's.
    let own = Vector3::from(own.map(f64::from)).norm();
    let extent = own + ((ca - cb).norm() + ra + 2.0 * rb) / a.placed().scale();
    let shift = Vector3::from(pose.translation()).norm();
    // The slack of the motion is a share of its reach.
    let lost = lost / a.placed().scale() / f64::from(SLACK);
    Ok(Relative::new(&pose, extent + shift + lost))
}

/// Of 2⁻⁵³ each: some ten roundings where poses are composed and applied.
const DOUBLE_ROUNDING: f64 = 2e-15;

/// Whether the rotation is one, to more than rounding: products of many poses may not be.
fn is_rotation(pose: &Pose) -> bool {
    let rotation = pose.rotation();
    let error = rotation.transpose() * rotation - Matrix3::identity();
    error.iter().all(|x| x.abs() <= 1e-9)
}

/// An uncalibrated estimate of the chance that the pairs still open hide a contact: each counts by how deeply
/// its boxes overlap against their size, the sixteen most urgent ones as if independent.
fn likelihood(pair: &Posed<'_>, stack: &Stack) -> f64 {
    let miss = |(depth, nodes): (f32, NodePair)| {
        let size_a = pair.a.boxes[nodes.a.index()].radius();
        let size_b = pair.b.boxes[nodes.b.index()].radius() * pair.relative.scale();
        let size = size_a.min(size_b);
        // What is no number, as of boxes that overflow, says nothing.
        if size > 0.0 && depth > 0.0 { 1.0 - f64::from((depth / size).min(1.0)) } else { 1.0 }
    };
    1.0 - stack.open().take(16).map(miss).product::<f64>()
}
