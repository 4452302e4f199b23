//! Bounds on the distance of two scans.
//!
//! Branch and bound over both trees, the nearest pair of nodes first. The boxes about the points
//! give the two nearest points; the enclosures, which provably contain the surfaces, give a lower
//! bound. This is an anytime algorithm: both bounds are valid whenever a budget stops it. Starting
//! from the nearest points, points on the surfaces themselves then approach each other.

mod apart;
mod approach;
mod scans;
mod search;

use nearmiss_geometry::PointId;
use nearmiss_hierarchy::PointHierarchy;
use nearmiss_surface::Metric;

use crate::ask::answer::{Evidence, Statistics};
use crate::ask::budget::Budget;
use crate::ask::options::{CollideOptions, CollidePlan, Detail, PlanError, Semantics};
use crate::contact::collide::ContactScratch;
use crate::pair::meter::Meter;
use crate::pair::placed::Placed;
use crate::pair::scan_pair::{ScanPair, relative};
pub(crate) use apart::{Measured, Place, bound, unknown};
pub(crate) use approach::{Feet, ROUNDS, land, step};
pub(crate) use search::{Frontier, Nearness};

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
        Self::of_metrics(options, [a.metric(), b.metric()])
    }

    /// Validates `options` for any scans of a metric, such as those that a [world](crate::World) will have.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn of_metric(options: &DistanceOptions, metric: Metric) -> Result<Self, PlanError> {
        Self::of_metrics(options, [metric; 2])
    }

    pub(crate) fn of_metrics(options: &DistanceOptions, metrics: [Metric; 2]) -> Result<Self, PlanError> {
        if !(0.0..1.0).contains(&options.relative) {
            return Err(PlanError::Relative(options.relative));
        }
        let asked = CollideOptions { metric: options.metric, ..CollideOptions::estimated() }
            .with_semantics(options.semantics)
            .with_detail(Detail::Witness);
        let touching = CollidePlan::of_metrics(&asked, metrics)?;
        let points = asked.with_semantics(Semantics::Thickened(0.0)).with_margin(f64::MAX);
        let boundless = CollidePlan::of_metrics(&points, metrics)?;
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

    /// The options with an unlimited reach.
    pub(crate) fn boundless(&self) -> &CollidePlan {
        &self.boundless
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
/// [`Pair::distance`](crate::Pair::distance). Starts from the points `start`, and returns the nearest
/// ones as well; those of a contact are not returned.
pub(crate) fn distance(
    views: [&Placed<'_>; 2],
    start: [usize; 2],
    plan: &DistancePlan,
    budget: &Budget,
    (open, contact): (&mut Frontier, &mut ContactScratch),
) -> (Distance, [usize; 2]) {
    let [a, b] = views;
    let Ok((pose, relative)) = relative(a, b, &plan.boundless) else {
        return (unknown(views.map(|view| view.point(0)), views.map(|view| view.scan().id(0))), start);
    };
    let (level, meter) = (contact.level, Meter::new(budget, views, 0));
    let arrays = views.map(|view| view.scan().arrays());
    let part = plan.options.semantics.part();
    let pair = ScanPair::new(views, arrays.each_ref(), relative, meter, (level, part));
    bound((pair, &pose), start, plan, budget, (open, contact))
}
