//! The flow of a distance query, the same for two scans and for a scan and a mesh.

use nearmiss_geometry::{PointId, Pose};
use nearmiss_surface::Metric;

use super::approach::Feet;
use super::search::{Frontier, Search};
use super::{Distance, DistancePlan};
use crate::ask::answer::{Answer, Evidence, Statistics, Verdict};
use crate::ask::budget::Budget;
use crate::ask::options::Semantics;
use crate::contact::collide::ContactScratch;
use crate::pair::pairing::Pairing;
use crate::pair::placed::ViewScratch;

/// Distance, in bands, beyond which the feet on the surfaces of obstacles are at most 1 % nearer to
/// each other than the samples. (Samples are within 0.6 bands of the surfaces.)
const FAR_FEET: f64 = 6.0;

/// The two nearest items so far, in the world.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    /// The nearest points of the items, for obstacles of the balls about them.
    pub(crate) points: [[f64; 3]; 2],
    pub(crate) sources: [PointId; 2],
    /// The greater local radius.
    pub(crate) band: f64,
    /// The sum of half the local radii, within which the surfaces are.
    pub(crate) off: f64,
}

/// The parts of a distance query that depend on what is compared.
pub(crate) trait Measured: Pairing {
    /// The number of sides that have balls about their points if points are compared.
    const THICK: f64;

    /// Describes two items.
    fn place(&self, items: [usize; 2]) -> Place;

    /// Tests for contact within `budget`, with the meaning of `plan`.
    fn touches(&self, plan: &DistancePlan, budget: &Budget, scratch: &mut ContactScratch) -> Answer;

    /// Moves points along the surfaces towards each other, starting at the nearest items. `None` if
    /// the surfaces are not found there.
    fn approach(&mut self, items: [usize; 2], gathers: &mut [ViewScratch; 2]) -> Option<Feet>;

    /// Returns `true` if both feet, which started at `items`, belong to their obstacles.
    fn are_obstacle(&self, items: [usize; 2], feet: &Feet) -> bool;
}

/// Bounds the distance of a pair, with the meaning of `plan`, within `budget`. `pose` is b's pose in
/// a's stored frame. Starts from the items `start`, and returns the nearest ones as well; those of a
/// contact are not returned.
pub(crate) fn bound<P: Measured>(
    (pair, pose): (P, &Pose),
    start: [usize; 2],
    plan: &DistancePlan,
    budget: &Budget,
    (open, contact): (&mut Frontier, &mut ContactScratch),
) -> (Distance, [usize; 2]) {
    let relative_pose = pair.relative_pose(pose);
    // Enclosures prove nothing about points alone, nor about geodesic surfaces.
    let of_points = matches!(plan.options().semantics, Semantics::Thickened(_));
    let is_bounded = !of_points && plan.options().metric != Some(Metric::Geodesic);
    let mut apart = Apart { plan, budget, search: Search::new(pair, &relative_pose, start, is_bounded) };
    let found = match plan.options().semantics {
        Semantics::Thickened(radius) => apart.balls(radius, open),
        _ => apart.surfaces(open, contact),
    };
    (found, apart.search.best.items)
}

/// The answer for an invalid pose. `points` are any of both.
pub(crate) fn unknown(points: [[f64; 3]; 2], sources: [PointId; 2]) -> Distance {
    Distance {
        lower: 0.0,
        band: f64::INFINITY,
        upper: f64::INFINITY,
        points,
        sources,
        evidence: Evidence::Estimated,
        complete: false,
        statistics: Statistics::default(),
    }
}

/// A running search for a distance.
struct Apart<'s, P> {
    plan: &'s DistancePlan,
    budget: &'s Budget,
    search: Search<'s, P>,
}

impl<P: Measured> Apart<'_, P> {
    /// The distance of balls of this radius about the points.
    fn balls(&mut self, radius: f64, open: &mut Frontier) -> Distance {
        let both = P::THICK * radius;
        self.search.near_enough = both;
        let flow = self.search.run(open);
        let beyond = |distance: f64| (distance - both).max(0.0);
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

    fn surfaces(&mut self, open: &mut Frontier, contact: &mut ContactScratch) -> Distance {
        let of_obstacles = self.of_obstacles();
        if of_obstacles {
            self.search.share = Some(1.0 - self.plan.options().relative);
        }
        // The contact test costs 1 % of the rest. Under a budget, the bounds come first.
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
        let items = self.search.best.items;
        let is_worth = !of_obstacles || self.search.best.distance <= FAR_FEET * found.band;
        let feet = if flow.is_continue() && is_worth {
            self.search.pair.approach(items, &mut contact.gathers)
        } else {
            None
        };
        let is_better = |feet: &Feet| {
            !of_obstacles || feet.distance < found.upper && self.search.pair.are_obstacle(items, feet)
        };
        let found = feet.filter(is_better).map_or(found, |feet| Distance {
            upper: feet.distance,
            points: feet.points,
            evidence: Evidence::Certified,
            ..found
        });
        let statistics = self.search.pair.meter().spent;
        Distance { lower: found.lower.min(found.upper), statistics, ..found }
    }

    fn of_obstacles(&self) -> bool {
        self.plan.options().semantics == Semantics::Obstacle
    }

    /// Tests for contact. Returns the answer if there is one.
    fn touch(&mut self, scratch: &mut ContactScratch) -> Option<Distance> {
        let spent = self.search.pair.meter().spent;
        let work = self.budget.work.map(|work| work.saturating_sub(spent.evaluations + spent.node_pairs));
        let budget = Budget { work, ..*self.budget };
        let answer = self.search.pair.touches(self.plan, &budget, scratch);
        let meter = self.search.pair.meter();
        meter.spend(&answer.statistics);
        let Verdict::Intersecting { contact, evidence } = answer.verdict else { return None };
        Some(Distance {
            lower: 0.0,
            band: answer.band,
            upper: 0.0,
            points: [contact.point; 2],
            sources: contact.sources,
            evidence,
            complete: true,
            statistics: meter.spent,
        })
    }

    /// The answer that the nearest items so far support.
    fn samples(&mut self) -> Distance {
        let best = self.search.best;
        let of_obstacles = self.of_obstacles();
        let Place { points, sources, band, off } = self.search.pair.place(best.items);
        Distance {
            lower: 0.0,
            band,
            upper: if of_obstacles { best.distance.max(0.0) } else { best.distance + off },
            points,
            sources,
            evidence: if of_obstacles { Evidence::Certified } else { Evidence::Estimated },
            complete: false,
            statistics: self.search.pair.meter().spent,
        }
    }
}
