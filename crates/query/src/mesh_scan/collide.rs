//! The collision query of a mesh and a scan, and all contacts.

use nearmiss_hierarchy::{NodePair, Plunging, descend};

use crate::ask::answer::{Answer, Contacts, Evidence, Reason, Statistics, Verdict};
use crate::ask::budget::Budget;
use crate::ask::options::{CollideOptions, Order, Semantics};
use crate::contact::certificate::Certifier;
use crate::contact::collide::{ContactScratch, Frontiers, apart};
use crate::mesh::placed::PlacedMesh;
use crate::mesh_scan::hint::MeshScanHint;
use crate::mesh_scan::mesh_scan_pair::MeshScanPairing;
use crate::mesh_scan::plan::MeshScanPlan;
use crate::mesh_scan::search::Search;
use crate::mesh_scan::thickened::Thickened;
use crate::pair::likelihood::likelihood_of_mesh;
use crate::pair::placed::Placed;

/// A collision question about a scan and a mesh.
#[derive(Clone, Copy)]
pub(crate) struct AskedOfMesh<'q> {
    pub(crate) scan: &'q Placed<'q>,
    pub(crate) mesh: &'q PlacedMesh<'q>,
    pub(crate) plan: &'q MeshScanPlan,
    pub(crate) budget: &'q Budget,
}

/// Answers a question, and writes all contacts if they are requested.
pub(crate) fn collide(
    asked: AskedOfMesh<'_>,
    scratch: &mut ContactScratch,
    (hint, mut contacts): (Option<&mut MeshScanHint>, Option<&mut Contacts>),
) -> Answer {
    let AskedOfMesh { scan, mesh, plan, budget } = asked;
    let options = plan.options();
    if let Some(contacts) = &mut contacts {
        contacts.contacts.clear();
        contacts.complete = false;
    }
    let (a, b) = (scan.scan().arrays(), mesh.mesh().arrays());
    let pair = MeshScanPairing::new((scan, &a), (mesh, &b), options.semantics, budget, scratch.level);
    let Some(pair) = pair else {
        let (verdict, statistics) = (Verdict::Undecided(Reason::Pose), Statistics::default());
        return Answer { verdict, band: f64::INFINITY, distance_estimate: None, statistics };
    };
    // A certificate proves more than the balls, unless they are far apart.
    if pair.gap > plan.reach() && (!options.certifies() || pair.is_far) {
        if let Some(contacts) = contacts {
            contacts.complete = true;
        }
        let (verdict, band) = (apart_by(options, pair.gap), pair.band_of_node(NodePair::ROOTS));
        let statistics = Statistics { node_pairs: 1, ..Statistics::default() };
        return Answer { verdict, band, distance_estimate: None, statistics };
    }
    if let Some(distance) = hint.as_ref().and_then(|hint| hint.distance(&pair, options, plan.reach())) {
        if let Some(contacts) = contacts {
            contacts.complete = true;
        }
        let (verdict, band) = (apart_by(options, distance), pair.band_of_node(NodePair::ROOTS));
        return Answer { verdict, band, distance_estimate: None, statistics: pair.meter.spent };
    }
    match options.semantics {
        Semantics::Obstacle | Semantics::Surface => surfaces(pair, asked, scratch, (hint, contacts)),
        Semantics::Thickened(_) => thickened(pair, plan, scratch, (hint, contacts)),
    }
}

/// The verdict for a proven separation by `distance`.
fn apart_by(options: &CollideOptions, distance: f64) -> Verdict {
    match options.semantics {
        Semantics::Thickened(radius) => {
            Verdict::Separated { gap: (distance - radius).max(0.0), evidence: Evidence::Certified }
        }
        _ => apart(options, distance, true),
    }
}

/// Compares discs and balls with triangles, and then enclosures if nothing meets and a certificate
/// is requested.
fn surfaces(
    pair: MeshScanPairing<'_>,
    AskedOfMesh { plan, budget, .. }: AskedOfMesh<'_>,
    scratch: &mut ContactScratch,
    (hint, contacts): (Option<&mut MeshScanHint>, Option<&mut Contacts>),
) -> Answer {
    let options = plan.options();
    let ContactScratch { frontiers, gathers: [gather, _], compared, proven, proof, .. } = scratch;
    let (all, complete) = contacts.map(Contacts::parts).unzip();
    let (stored, relative, level) = (pair.stored, pair.relative, pair.level);
    let mut search = Search::new(pair, options, (gather, compared), all);
    frontiers.clear();
    let Frontiers { stack, heap } = frontiers;
    let trees = search.pair.trees(&relative, search.reach);
    let by_overlap = options.order.map_or(budget.may_end(), |by| by != Order::DepthFirst);
    let before = search.compare_first(hint.as_ref().and_then(|hint| hint.met));
    let flow = if before.is_break() {
        before
    } else if by_overlap {
        descend(trees, level, heap, &mut search)
    } else if search.wants_any() {
        descend(trees, level, &mut Plunging::new(stack), &mut search)
    } else {
        descend(trees, level, stack, &mut search)
    };
    let ended = flow.is_break();
    if let Some(complete) = complete {
        *complete = !ended;
    }
    let Search { mut pair, found, met, doubt, reach, .. } = search;
    let mut band = met.map_or_else(|| pair.band_of_node(NodePair::ROOTS), |[i, _]| pair.band(i));
    let mut clear = None;
    let verdict = match (found, doubt) {
        (Some((contact, evidence)), _) => Verdict::Intersecting { contact, evidence },
        _ if ended => {
            let likelihood = likelihood_of_mesh((pair.a, pair.b), &pair.relative, reach, frontiers.open());
            Verdict::Undecided(Reason::Budget { likelihood })
        }
        (None, Some(reason)) => Verdict::Undecided(reason),
        _ if !options.certifies() => apart(options, 0.0, false),
        _ => {
            let mut certifier = Certifier::new(&mut pair, reach, proven);
            let proven = certifier.prove(&stored, compared, proof, (None, false));
            if let Some((distance, near)) = proven {
                (band, clear) = (near, Some(distance));
            }
            apart(options, proven.map_or(0.0, |(distance, _)| distance), proven.is_some())
        }
    };
    if let Some(hint) = hint {
        hint.keep(&pair, options, clear, met.map(|met| pair.leaves_of(met)));
    }
    scratch.longest_stretch = pair.meter.longest_stretch;
    Answer { verdict, band, distance_estimate: None, statistics: pair.meter.spent }
}

/// Compares balls of one radius about the points with triangles.
fn thickened(
    pair: MeshScanPairing<'_>,
    plan: &MeshScanPlan,
    scratch: &mut ContactScratch,
    (hint, contacts): (Option<&mut MeshScanHint>, Option<&mut Contacts>),
) -> Answer {
    let (all, complete) = contacts.map(Contacts::parts).unzip();
    let (relative, level) = (pair.relative, pair.level);
    let mut search = Thickened::new(pair, plan.reach(), all);
    scratch.frontiers.clear();
    let Frontiers { stack, .. } = &mut scratch.frontiers;
    let trees = search.pair.trees(&relative, search.reach_stored);
    let before = search.compare_first(hint.as_ref().and_then(|hint| hint.met));
    let flow = if before.is_break() {
        before
    } else if search.all.is_none() {
        descend(trees, level, &mut Plunging::new(stack), &mut search)
    } else {
        descend(trees, level, stack, &mut search)
    };
    let ended = flow.is_break();
    if let Some(complete) = complete {
        *complete = !ended;
    }
    let Thickened { pair, found, apart, reach_stored, .. } = search;
    let verdict = match found {
        Some((contact, _)) => Verdict::Intersecting { contact, evidence: Evidence::Certified },
        None if ended => {
            let open = scratch.frontiers.open();
            let likelihood = likelihood_of_mesh((pair.a, pair.b), &pair.relative, reach_stored, open);
            Verdict::Undecided(Reason::Budget { likelihood })
        }
        None => apart_by(plan.options(), apart),
    };
    let band = found.map_or_else(|| pair.band_of_node(NodePair::ROOTS), |(_, [i, _])| pair.band(i));
    if let Some(hint) = hint {
        let clear = verdict.is_separated().then_some(apart);
        hint.keep(&pair, plan.options(), clear, found.map(|(_, met)| pair.leaves_of(met)));
    }
    scratch.longest_stretch = pair.meter.longest_stretch;
    Answer { verdict, band, distance_estimate: None, statistics: pair.meter.spent }
}
