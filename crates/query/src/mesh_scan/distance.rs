//! Bounds on the distance of a mesh and a scan, by the search that serves two scans: branch and
//! bound, the nearest pair of nodes first.

use nearmiss_geometry::PointId;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_mesh::{Corners, nearest_on_triangle};
use nearmiss_surface::{Metric, Projection, Status, project};

use crate::ask::answer::{Evidence, Statistics, Verdict};
use crate::ask::budget::Budget;
use crate::ask::options::Semantics;
use crate::contact::collide::ContactScratch;
use crate::distance::{Distance, DistancePlan, Frontier, Search};
use crate::mesh::placed::PlacedMesh;
use crate::mesh_scan::collide::{AskedOfMesh, collide};
use crate::mesh_scan::mesh_scan_pair::MeshScanPairing;
use crate::mesh_scan::plan::MeshScanPlan;
use crate::pair::pairing::{ItemPair, Pairing};
use crate::pair::placed::{Placed, ViewScratch};

/// Distance, in bands, beyond which the foot on the surface of an obstacle is at most 1 % nearer to
/// the mesh than the sample.
const FAR_FEET: f64 = 6.0;

/// Steps along the surface; each costs up to twelve evaluations.
const ROUNDS: u32 = 8;

/// A step is skipped if it would gain less than this share of the local radius.
const ENOUGH: f64 = 1e-3;

/// The surface is left if steps would have to be shorter than this share.
const SHORTEST: f64 = 1.0 / 16.0;

/// Bounds the distance of a scan and a mesh, with the meaning of `plan`, within `budget`. See
/// [`MeshScanPair::distance`](crate::MeshScanPair::distance).
pub(crate) fn distance(
    (scan, mesh): (&Placed<'_>, &PlacedMesh<'_>),
    plan: &DistancePlan,
    budget: &Budget,
    open: &mut Frontier,
    contact: &mut ContactScratch,
) -> Distance {
    let (a, b) = (scan.scan().arrays(), mesh.mesh().arrays());
    let semantics = plan.options().semantics;
    let pair = MeshScanPairing::new((scan, &a), (mesh, &b), semantics, budget, contact.level);
    let Some(pair) = pair else {
        return Distance {
            lower: 0.0,
            band: f64::INFINITY,
            upper: f64::INFINITY,
            points: [scan.point(0), mesh.pose().apply(b.corners(0)[0])],
            sources: [scan.scan().id(0), PointId(b.source[0])],
            evidence: Evidence::Estimated,
            complete: false,
            statistics: Statistics::default(),
        };
    };
    let relative_pose = pair.relative_pose(&pair.stored);
    if let Semantics::Thickened(radius) = semantics {
        return Apart { plan, budget, search: Search::new(pair, &relative_pose, false) }.balls(radius, open);
    }
    // Enclosures prove nothing about geodesic surfaces.
    let is_bounded = plan.options().metric != Some(Metric::Geodesic);
    Apart { plan, budget, search: Search::new(pair, &relative_pose, is_bounded) }.surfaces(open, contact)
}

/// A running search for a distance.
struct Apart<'s, 'a> {
    plan: &'s DistancePlan,
    budget: &'s Budget,
    search: Search<'s, MeshScanPairing<'a>>,
}

impl Apart<'_, '_> {
    /// The distance of balls of this radius about the points.
    fn balls(mut self, radius: f64, open: &mut Frontier) -> Distance {
        self.search.near_enough = radius;
        let flow = self.search.run(open);
        let beyond = |distance: f64| (distance - radius).max(0.0);
        let nearest = self.search.best.distance;
        let complete = flow.is_continue() || beyond(nearest) == 0.0;
        let lower = if complete { nearest } else { self.search.lower(open).min(nearest) };
        Distance {
            lower: beyond(lower),
            upper: beyond(nearest),
            evidence: Evidence::Certified,
            complete,
            ..self.samples()
        }
    }

    fn surfaces(mut self, open: &mut Frontier, contact: &mut ContactScratch) -> Distance {
        let of_obstacles = self.of_obstacles();
        if of_obstacles {
            self.search.share = Some(1.0 - self.plan.options().relative);
        }
        // Under a budget, the bounds come first.
        let is_asked = !self.budget.may_end();
        if (is_asked || self.search.may_touch())
            && let Some(touching) = self.touch(contact)
        {
            return touching;
        }
        self.search.stops_at_zero = !is_asked && !self.search.may_touch();
        let mut flow = self.search.run(open);
        if self.search.stops_at_zero && self.search.may_touch() {
            if let Some(touching) = self.touch(contact) {
                return touching;
            }
            self.search.stops_at_zero = false;
            flow = self.search.go_on(open);
        }
        let lower = if self.search.of_enclosures { self.search.lower(open) } else { 0.0 };
        let found = Distance { lower, complete: flow.is_continue(), ..self.samples() };
        let is_worth = !of_obstacles || self.search.best.distance <= FAR_FEET * found.band;
        let feet = if flow.is_continue() && is_worth { self.approach(&mut contact.gathers[0]) } else { None };
        let found = match feet {
            Some((points, upper)) if !of_obstacles || upper < found.upper => {
                Distance { upper, points, evidence: Evidence::Certified, ..found }
            }
            _ => found,
        };
        let statistics = self.search.pair.meter.spent;
        Distance { lower: found.lower.min(found.upper), statistics, ..found }
    }

    fn of_obstacles(&self) -> bool {
        self.plan.options().semantics == Semantics::Obstacle
    }

    /// Tests for contact. Returns the answer if the mesh meets the scan.
    fn touch(&mut self, scratch: &mut ContactScratch) -> Option<Distance> {
        let pair = &mut self.search.pair;
        let spent = pair.meter.spent;
        let work = self.budget.work.map(|work| work.saturating_sub(spent.evaluations + spent.node_pairs));
        let budget = Budget { work, ..*self.budget };
        let plan = MeshScanPlan::touching(self.plan);
        let asked = AskedOfMesh { scan: pair.scan, mesh: pair.mesh, plan: &plan, budget: &budget };
        let answer = collide(asked, scratch, None);
        pair.meter.spend(&answer.statistics);
        let Verdict::Intersecting { contact, evidence } = answer.verdict else { return None };
        Some(Distance {
            lower: 0.0,
            band: answer.band,
            upper: 0.0,
            points: [contact.point; 2],
            sources: contact.sources,
            evidence,
            complete: true,
            statistics: pair.meter.spent,
        })
    }

    /// Moves a point along the surface, from the nearest sample on, towards the triangle nearest to
    /// that. Returns the point and the nearest point of the triangle, and their distance. `None` if
    /// the surface is not found or does not belong to the obstacle there.
    fn approach(&mut self, gather: &mut ViewScratch) -> Option<([[f64; 3]; 2], f64)> {
        let [i, j] = self.search.best.items;
        let of_obstacles = self.of_obstacles();
        let pair = &mut self.search.pair;
        if !pair.scan.verifies() {
            return None;
        }
        let (radius, triangle) = (pair.band(i), pair.world_corners(j));
        let mut foot = land(pair, i, pair.scan.point(i), gather)?;
        let mut to = towards(&foot, &triangle);
        let mut share = 1.0;
        for _ in 0..ROUNDS {
            let (distance, normal) = (to.norm(), Vector3::from(foot.at.normal));
            let along = to - normal * normal.dot(&to);
            let length = along.norm();
            if share < SHORTEST || length * length.min(radius) <= ENOUGH * radius * distance {
                break;
            }
            let place = Vector3::from(foot.point) + along * (share * (radius / length).min(1.0));
            let next = land(pair, i, place.into(), gather).map(|next| (next, towards(&next, &triangle)));
            match next {
                Some((next, on)) if on.norm() < distance => (foot, to) = (next, on),
                _ => share *= 0.5,
            }
        }
        let on_triangle = (Vector3::from(foot.point) + to).into();
        let is_part = !of_obstacles || pair.scan.is_obstacle(i, foot.point);
        is_part.then(|| ([foot.point, on_triangle], to.norm()))
    }

    /// The answer that the nearest point and triangle so far support.
    fn samples(&self) -> Distance {
        let ItemPair { distance, items: [i, j] } = self.search.best;
        let pair = &self.search.pair;
        let (p, foot) = (pair.scan.point(i), pair.apart(i, &pair.corners(j)).1);
        let (p, foot) = (Vector3::from(p), Vector3::from(pair.scan.stored_to_world().apply(foot)));
        let (way, ball) = (foot - p, pair.ball(i));
        let length = way.norm();
        let place = if length > 0.0 { p + way * (ball / length).min(1.0) } else { p };
        let of_surfaces = self.plan.options().semantics == Semantics::Surface;
        Distance {
            lower: 0.0,
            band: pair.band(i),
            upper: if of_surfaces { distance + 0.5 * pair.band(i) } else { distance.max(0.0) },
            points: [place.into(), foot.into()],
            sources: pair.sources([i, j]),
            evidence: if of_surfaces { Evidence::Estimated } else { Evidence::Certified },
            complete: false,
            statistics: pair.meter.spent,
        }
    }
}

/// The way from a point of the surface to the nearest point of a triangle.
fn towards(foot: &Projection, triangle: &Corners) -> Vector3<f64> {
    Vector3::from(nearest_on_triangle(triangle, foot.point)) - Vector3::from(foot.point)
}

/// Returns the verified surface point below `x`, near stored point `i`. If `x` is beyond a border of
/// the surface, projects the centroid of the last evaluation instead. `None` once the budget is
/// spent.
fn land(
    pair: &mut MeshScanPairing<'_>,
    i: usize,
    x: [f64; 3],
    gather: &mut ViewScratch,
) -> Option<Projection> {
    let mut place = x;
    for _ in 0..2 {
        if pair.meter.go_on().is_break() {
            return None;
        }
        let foot = project(place, |y| pair.scan.evaluate_near(i, y, gather));
        pair.meter.evaluated(u64::from(foot.evaluations));
        if foot.converged {
            return Some(foot);
        }
        if foot.at.status != Status::Border {
            return None;
        }
        place = foot.at.centroid;
    }
    None
}
