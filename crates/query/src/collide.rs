//! The query: do two scans meet?
//!
//! next node pair → boxes apart? drop → two leaves? compare their points: a crossing is a hit → otherwise the
//! children of both, or of the much larger one; the deepest overlap first.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{Frontier, GatherScratch, Relative, Stack, descend};

use crate::budget::{Budget, Meter};
use crate::crossing::Lanes;
use crate::options::{CollidePlan, Semantics};
use crate::posed::Posed;
use crate::surface::Surfaces;
use crate::thickened::Balls;
use crate::verdict::{Answer, Evidence, Reason, Verdict};
use crate::view::ScanView;

/// Reused between queries, one a thread; never influences an answer.
#[derive(Debug, Clone, Default)]
pub struct CollideScratch {
    stack: Stack,
    lanes: Lanes,
    gathers: [GatherScratch; 2],
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
    let mut meter = Meter::new(budget);
    let reach = match plan.options().semantics {
        Semantics::Thickened(radius) => 2.0 * radius,
        Semantics::Surface => 0.0,
    };
    let relative = match relative(a, b, reach) {
        Ok(relative) => relative,
        Err(early) => {
            meter.spent.node_pairs = 1;
            let verdict = early.map_or(Verdict::Undecided(Reason::Pose), |gap| separated(plan, gap - reach));
            return Answer { verdict, statistics: meter.spent };
        }
    };
    let nodes = (a.slices().nodes, b.slices().nodes);
    let CollideScratch { stack, lanes, gathers } = scratch;
    let pair = Posed::new([a, b], relative, meter);
    let (found, ended, doubt, apart, statistics) = match plan.options().semantics {
        Semantics::Surface => {
            let mut search = Surfaces::new(pair, plan.options().detail, lanes, gathers);
            let ended = descend(nodes.0, nodes.1, &mut search, stack).is_break();
            (search.found, ended, search.doubt, 0.0, search.pair.meter.spent)
        }
        Semantics::Thickened(radius) => {
            let mut search = Balls::new(pair, radius);
            let ended = descend(nodes.0, nodes.1, &mut search, stack).is_break();
            let found = search.found.map(|contact| (contact, Evidence::Certified));
            (found, ended, None, search.apart - reach, search.pair.meter.spent)
        }
    };
    let verdict = match (found, doubt) {
        (Some((contact, evidence)), _) => Verdict::Intersecting { contact, evidence },
        _ if ended => Verdict::Undecided(Reason::Budget { likelihood: likelihood(a, b, &relative, stack) }),
        (None, Some(reason)) => Verdict::Undecided(reason),
        (None, None) => separated(plan, apart),
    };
    Answer { verdict, statistics }
}

/// Apart, by a `gap` that is proven only where points are compared.
fn separated(plan: &CollidePlan, gap: f64) -> Verdict {
    match plan.options().semantics {
        Semantics::Surface => Verdict::Separated { gap: 0.0, evidence: Evidence::Estimated },
        Semantics::Thickened(_) => Verdict::Separated { gap: gap.max(0.0), evidence: Evidence::Certified },
    }
}

/// Scans whose sizes differ by more than this are not compared in single precision.
const GREATEST_RATIO: f64 = (1_u64 << 60) as f64;

/// The motion of b's stored frame into a's. An error is the distance of balls about the two scans if that is more
/// than any contact reaches, or `None` for poses that are none.
fn relative(a: &ScanView<'_>, b: &ScanView<'_>, reach: f64) -> Result<Relative, Option<f64>> {
    let ratio = b.placed().scale() / a.placed().scale();
    let finite = |m: [f64; 16]| m.iter().all(|x| x.is_finite());
    let proper = finite(a.placed().to_row_major()) && finite(b.placed().to_row_major());
    let positive = a.placed().scale() > 0.0 && b.placed().scale() > 0.0;
    if !(proper && positive && (1.0 / GREATEST_RATIO..=GREATEST_RATIO).contains(&ratio)) {
        return Err(None);
    }
    let [(ca, ra), (cb, rb)] = [a, b].map(|view| {
        let root = &view.scan().boxes()[0];
        let centre = view.placed().apply(root.centre.map(f64::from));
        (Vector3::from(centre), f64::from(root.radius()) * view.placed().scale())
    });
    let gap = (ca - cb).norm() * (1.0 - 1e-6) - (ra + rb) * (1.0 + 1e-6);
    if gap > reach {
        return Err(Some(gap));
    }
    let pose = a.placed().inverse().after(b.placed());
    // Coordinates in a's stored frame: of its own points, and of b's.
    let own = a.scan().boxes()[0].centre.map(f64::from);
    let extent = Vector3::from(own).norm() + ((ca - cb).norm() + ra + 2.0 * rb) / a.placed().scale();
    let shift = Vector3::from(pose.translation()).norm();
    Ok(Relative::new(&pose, extent + shift))
}

/// An uncalibrated estimate of the chance that the pairs still open hide a contact: each counts by how deeply
/// its boxes overlap against their size, the sixteen most urgent ones as if independent.
fn likelihood(a: &ScanView<'_>, b: &ScanView<'_>, relative: &Relative, stack: &Stack) -> f64 {
    let miss = |(depth, pair): (f32, nearmiss_hierarchy::NodePair)| {
        let size_a = a.scan().boxes()[pair.a.index()].radius();
        let size_b = b.scan().boxes()[pair.b.index()].radius() * relative.scale();
        let size = size_a.min(size_b);
        if size > 0.0 { 1.0 - f64::from((depth / size).clamp(0.0, 1.0)) } else { 1.0 }
    };
    1.0 - stack.open().take(16).map(miss).product::<f64>()
}
