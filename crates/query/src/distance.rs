//! Bounds on the distance of two scans.
//!
//! Branch and bound over both trees, the nearest pair of nodes first. The boxes about the points
//! give the two nearest points; the enclosures, which provably contain the surfaces, give a lower
//! bound. This is an anytime algorithm: both bounds are valid whenever a budget stops it. Starting
//! from the nearest points, points on the surfaces themselves then approach each other.

mod approach;
mod search;

use nearmiss_geometry::PointId;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::PointHierarchy;
use nearmiss_surface::Metric;

use crate::ask::answer::{Evidence, Statistics, Verdict};
use crate::ask::budget::Budget;
use crate::ask::options::{CollideOptions, CollidePlan, Detail, PlanError, Semantics};
use crate::contact::collide::{Asked, ContactScratch, Outputs, collide};
use crate::pair::meter::Meter;
use crate::pair::pairing::ItemPair;
use crate::pair::placed::{Placed, ViewScratch};
use crate::pair::scan_pair::{ScanPair, relative, relative_pose_of};
use approach::{Approach, Feet};
pub(crate) use search::{Frontier, Nearness, Search};

/// Options of a distance query. Plain values; [`DistancePlan::new`] validates them.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct DistanceOptions {
    /// The geometry whose distance is measured. Default: obstacles.
    pub semantics: Semantics,
    /// Relative precision of the lower bound between obstacles, 0 to less than 1, default 0.1. The
    /// lower bound may stay below the upper one by this share of the upper one.
    pub relative: f64,
    /// The metric that defines the surfaces. Default: `None`, the metric that both scans were
    /// prepared for.
    pub metric: Option<Metric>,
}

impl Default for DistanceOptions {
    fn default() -> Self {
        Self { semantics: Semantics::default(), relative: 0.1, metric: None }
    }
}

impl DistanceOptions {
    /// The same options with this relative precision of the lower bound.
    #[must_use]
    pub const fn with_relative(self, relative: f64) -> Self {
        Self { relative, ..self }
    }

    /// The same options with these semantics.
    #[must_use]
    pub const fn with_semantics(self, semantics: Semantics) -> Self {
        Self { semantics, ..self }
    }

    /// The same options with this metric.
    #[must_use]
    pub const fn with_metric(self, metric: Metric) -> Self {
        Self { metric: Some(metric), ..self }
    }
}

/// Validated options for two scans. Serves every pair of scans of the same metric, as a
/// [`CollidePlan`] does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DistancePlan {
    options: DistanceOptions,
    /// The contact test.
    touching: CollidePlan,
    /// The options with an unlimited reach, so that no pair is too far away to be searched.
    boundless: CollidePlan,
}

impl DistancePlan {
    /// Validates `options` for two scans in any poses.
    ///
    /// # Errors
    /// Returns:
    /// - [`PlanError::Radius`] for a negative or non-finite radius,
    /// - [`PlanError::Relative`] for a relative precision out of range,
    /// - [`PlanError::Metric`] if a scan was prepared for another metric than the options ask for,
    /// - [`PlanError::Metrics`] if the metrics of the scans differ.
    pub fn new(options: &DistanceOptions, a: &PointHierarchy, b: &PointHierarchy) -> Result<Self, PlanError> {
        if !(0.0..1.0).contains(&options.relative) {
            return Err(PlanError::Relative(options.relative));
        }
        let asked = CollideOptions { metric: options.metric, ..CollideOptions::estimated() }
            .with_semantics(options.semantics)
            .with_detail(Detail::Witness);
        let touching = CollidePlan::new(&asked, a, b)?;
        let points = asked.with_semantics(Semantics::Thickened(0.0)).with_margin(f64::MAX);
        let boundless = CollidePlan::new(&points, a, b)?;
        let options = DistanceOptions { metric: touching.options().metric, ..*options };
        Ok(Self { options, touching, boundless })
    }

    /// Validates `options` for a mesh and a scan in any poses. Serves two scans as well.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn against_mesh(options: &DistanceOptions, scan: &PointHierarchy) -> Result<Self, PlanError> {
        Self::new(options, scan, scan)
    }

    /// The contact test.
    pub(crate) fn touching(&self) -> &CollidePlan {
        &self.touching
    }

    /// The options that were validated, with the metric of the scans.
    #[must_use]
    pub fn options(&self) -> &DistanceOptions {
        &self.options
    }
}

/// Bounds on the distance of two scans, in world units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance {
    /// A proven lower bound of the distance.
    pub lower: f64,
    /// The band at the nearest points: the greater local radius of the two samples there, at most
    /// the greater reach, in world units. Nothing is claimed about where the scanned things
    /// themselves are within it.
    pub band: f64,
    /// An upper bound of the distance; see [`Self::evidence`]. Infinite if a pose is invalid.
    pub upper: f64,
    /// A point of each scan at distance [`Self::upper`]: points on the surfaces, or samples if
    /// points are compared.
    pub points: [[f64; 3]; 2],
    /// A sample of each scan near these points.
    pub sources: [PointId; 2],
    /// The evidence for [`Self::upper`]. Certified: the points were verified to lie on the
    /// surfaces; at distance zero they coincide. Estimated: the surfaces cross to first order, or
    /// no surface point was found or searched for near the samples, and half a local radius of each
    /// sample was added to their distance. Always certified if points are compared.
    pub evidence: Evidence,
    /// `true` if the search ended before the budget did. Between points, both bounds then equal the
    /// distance; between surfaces, further work would not improve them.
    pub complete: bool,
    /// The cost of the query.
    pub statistics: Statistics,
}

/// Bounds the distance of two scans, with the meaning of `plan`, within `budget`. See
/// [`Pair::distance`](crate::Pair::distance).
pub(crate) fn distance(
    views: [&Placed<'_>; 2],
    plan: &DistancePlan,
    budget: &Budget,
    open: &mut Frontier,
    contact: &mut ContactScratch,
) -> Distance {
    let [a, b] = views;
    let Ok((pose, relative)) = relative(a, b, &plan.boundless) else {
        return Distance {
            lower: 0.0,
            band: f64::INFINITY,
            upper: f64::INFINITY,
            points: views.map(|view| view.point(0)),
            sources: views.map(|view| view.scan().id(0)),
            evidence: Evidence::Estimated,
            complete: false,
            statistics: Statistics::default(),
        };
    };
    let (level, meter) = (contact.level, Meter::new(budget, views, 0));
    let relative_pose = relative_pose_of(views, &pose);
    let arrays = views.map(|view| view.scan().arrays());
    let semantics = plan.options.semantics;
    let pair = ScanPair::new(views, arrays.each_ref(), relative, meter, (level, semantics.part()));
    if let Semantics::Thickened(radius) = semantics {
        return Apart { plan, budget, search: Search::new(pair, &relative_pose, false) }.balls(radius, open);
    }
    // Enclosures prove nothing about geodesic surfaces.
    let is_bounded = plan.options.metric != Some(Metric::Geodesic);
    Apart { plan, budget, search: Search::new(pair, &relative_pose, is_bounded) }.surfaces(open, contact)
}

/// Distance, in bands, beyond which the feet on the surfaces of obstacles are at most 1 % nearer to
/// each other than the samples. (Samples are within 0.6 bands of the surfaces.)
const FAR_FEET: f64 = 6.0;

/// A running search for a distance.
struct Apart<'a> {
    plan: &'a DistancePlan,
    budget: &'a Budget,
    search: Search<'a, ScanPair<'a>>,
}

impl Apart<'_> {
    /// The distance of balls of this radius about the points.
    fn balls(mut self, radius: f64, open: &mut Frontier) -> Distance {
        self.search.near_enough = 2.0 * radius;
        let flow = self.search.run(open);
        let beyond = |distance: f64| (distance - 2.0 * radius).max(0.0);
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
        if self.of_obstacles() {
            self.search.share = Some(1.0 - self.plan.options.relative);
        }
        // The contact test costs 1 % of the rest. Under a budget, the bounds come first.
        let is_asked = self.budget.work.is_none() && self.budget.deadline.is_none();
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
        let is_worth = !self.of_obstacles() || self.search.best.distance <= FAR_FEET * self.band();
        let feet = if flow.is_continue() && is_worth { self.approach(&mut contact.gathers) } else { None };
        let found = Distance { lower, complete: flow.is_continue(), ..self.samples() };
        let of_points = self.of_obstacles();
        let feet = feet.filter(|feet| !of_points || feet.distance < found.upper && self.are_obstacle(feet));
        let found = feet.map_or(found, |feet| Distance {
            upper: feet.distance,
            points: feet.points,
            evidence: Evidence::Certified,
            ..found
        });
        Distance { lower: found.lower.min(found.upper), ..found }
    }

    fn of_obstacles(&self) -> bool {
        self.plan.options.semantics == Semantics::Obstacle
    }

    /// The greater local radius of the two nearest points, in the world.
    fn band(&self) -> f64 {
        self.search.pair.band(self.search.best.items)
    }

    /// The nearest points of the balls about the two nearest samples, whose centres are `centres`.
    fn places_of_balls(&self, centres: [[f64; 3]; 2]) -> [[f64; 3]; 2] {
        let [p, q] = centres.map(Vector3::from);
        let balls = self.search.pair.balls(self.search.best.items);
        let (way, both) = (q - p, balls[0] + balls[1]);
        let length = way.norm();
        if both == 0.0 || length == 0.0 {
            return centres;
        }
        // Overlapping balls share a point.
        let shares =
            if both < length { balls.map(|ball| ball / length) } else { [balls[0] / both, balls[1] / both] };
        [(p + way * shares[0]).into(), (q - way * shares[1]).into()]
    }

    /// Returns `true` if both feet belong to their obstacles.
    fn are_obstacle(&self, feet: &Feet) -> bool {
        let views = self.search.pair.views;
        (0..2).all(|k| views[k].is_obstacle(self.search.best.items[k], feet.points[k]))
    }

    /// Tests for contact. Returns the answer if the surfaces meet.
    fn touch(&mut self, scratch: &mut ContactScratch) -> Option<Distance> {
        let meter = &mut self.search.pair.meter;
        let spent = meter.spent;
        let work = self.budget.work.map(|work| work.saturating_sub(spent.evaluations + spent.node_pairs));
        let budget = Budget { work, ..*self.budget };
        let asked = Asked { scans: self.search.pair.views, plan: &self.plan.touching, budget: &budget };
        let answer = collide(asked, scratch, Outputs::default());
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

    /// Moves points along the surfaces towards each other, starting at the nearest samples.
    fn approach(&mut self, gathers: &mut [ViewScratch; 2]) -> Option<Feet> {
        let [a, b] = self.search.pair.views;
        if !(a.verifies() && b.verifies()) {
            return None;
        }
        let meter = &mut self.search.pair.meter;
        Approach { views: [a, b], samples: self.search.best.items, gathers, meter }.run()
    }

    /// The answer that the nearest samples so far support.
    fn samples(&self) -> Distance {
        let ItemPair { distance, items: points } = self.search.best;
        let views = self.search.pair.views;
        let half = |k: usize| {
            0.5 * f64::from(views[k].scan().radii()[points[k]]) * views[k].stored_to_world().scale()
        };
        let of_obstacles = self.of_obstacles();
        let places = [0, 1].map(|k| views[k].point(points[k]));
        Distance {
            lower: 0.0,
            band: self.band(),
            upper: if of_obstacles { distance.max(0.0) } else { distance + half(0) + half(1) },
            points: if of_obstacles { self.places_of_balls(places) } else { places },
            sources: [0, 1].map(|k| views[k].scan().id(points[k])),
            evidence: if of_obstacles { Evidence::Certified } else { Evidence::Estimated },
            complete: false,
            statistics: self.search.pair.meter.spent,
        }
    }
}
