//! Options of a sweep, and their validation.

use nearmiss_hierarchy::{Ball, Outline, PointHierarchy};
use nearmiss_surface::Metric;

use crate::ask::options::{CollideOptions, CollidePlan, PlanError, Semantics};
use crate::distance::{DistanceOptions, DistancePlan};

/// Options of a sweep. Plain values; [`SweepPlan::new`] validates them.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct SweepOptions {
    /// The meaning of the scans. Default: obstacles.
    pub semantics: Semantics,
    /// The distance that both must keep, in world units; zero or more, default 0. Free means that
    /// they stay further apart than this.
    pub clearance: f64,
    /// The metric that defines the surfaces. Default: `None`, that of the scans.
    pub metric: Option<Metric>,
}

impl Default for SweepOptions {
    fn default() -> Self {
        Self { semantics: Semantics::default(), clearance: 0.0, metric: None }
    }
}

impl SweepOptions {
    /// The same options with these semantics.
    #[must_use]
    pub const fn with_semantics(self, semantics: Semantics) -> Self {
        Self { semantics, ..self }
    }

    /// The same options with this clearance.
    #[must_use]
    pub const fn with_clearance(self, clearance: f64) -> Self {
        Self { clearance, ..self }
    }

    /// The same options with this metric.
    #[must_use]
    pub const fn with_metric(self, metric: Metric) -> Self {
        Self { metric: Some(metric), ..self }
    }
}

/// Validated options of a sweep. Serves every pair of scans of the same metric, along any motions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SweepPlan {
    options: SweepOptions,
    distance: DistancePlan,
    touching: CollidePlan,
}

impl SweepPlan {
    /// Validates `options` for two scans.
    ///
    /// # Errors
    /// Returns [`PlanError::Margin`] for a negative or non-finite clearance, and the errors of
    /// [`DistancePlan::new`].
    pub fn new(options: &SweepOptions, a: &PointHierarchy, b: &PointHierarchy) -> Result<Self, PlanError> {
        Self::of_metrics(options, [a.metric(), b.metric()])
    }

    /// Validates `options` for any scans of a metric, such as those that a [world](crate::World) will have.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn of_metric(options: &SweepOptions, metric: Metric) -> Result<Self, PlanError> {
        Self::of_metrics(options, [metric; 2])
    }

    fn of_metrics(options: &SweepOptions, metrics: [Metric; 2]) -> Result<Self, PlanError> {
        let distance = DistanceOptions { metric: options.metric, ..DistanceOptions::default() }
            .with_semantics(options.semantics);
        let distance = DistancePlan::of_metrics(&distance, metrics)?;
        let touching = CollideOptions { metric: options.metric, ..CollideOptions::default() }
            .with_semantics(options.semantics)
            .with_margin(options.clearance);
        let touching = CollidePlan::of_metrics(&touching, metrics)?;
        let options = SweepOptions { metric: distance.options().metric, ..*options };
        Ok(Self { options, distance, touching })
    }

    /// Validates `options` for a scan and a mesh. Serves two scans as well.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn against_mesh(options: &SweepOptions, scan: &PointHierarchy) -> Result<Self, PlanError> {
        Self::new(options, scan, scan)
    }

    /// Validates `options` for two meshes, of which only the clearance counts: triangles have one meaning.
    ///
    /// # Errors
    /// Returns [`PlanError::Margin`] for a negative or non-finite clearance.
    pub fn of_meshes(options: &SweepOptions) -> Result<Self, PlanError> {
        let options = SweepOptions::default().with_clearance(options.clearance);
        Self::of_metric(&options, Metric::Euclidean)
    }

    /// The plan with the meaning of meshes, with which everything can be proven.
    pub(crate) fn between_meshes(&self) -> Self {
        let options =
            SweepOptions { semantics: Semantics::Surface, metric: Some(Metric::Euclidean), ..self.options };
        Self { options, ..*self }
    }

    /// The options that were validated, with the metric of the scans.
    #[must_use]
    pub fn options(&self) -> &SweepOptions {
        &self.options
    }

    /// The distance query.
    pub(crate) fn distance(&self) -> &DistancePlan {
        &self.distance
    }

    /// The contact test, with the clearance as its margin.
    pub(crate) fn touching(&self) -> &CollidePlan {
        &self.touching
    }

    /// The ball that contains a scan with this outline.
    pub(crate) fn ball(&self, outline: &Outline) -> Ball {
        match self.options.semantics {
            Semantics::Obstacle => outline.obstacle,
            Semantics::Surface => outline.surface,
            Semantics::Thickened(_) => outline.discs,
        }
    }

    /// Returns the radius of the balls if points are compared.
    pub(crate) fn thickness(&self) -> Option<f64> {
        match self.options.semantics {
            Semantics::Thickened(radius) => Some(radius),
            Semantics::Obstacle | Semantics::Surface => None,
        }
    }

    /// Returns `true` if separations can be proven.
    pub(crate) fn proves(&self) -> bool {
        self.thickness().is_some() || self.options.metric != Some(Metric::Geodesic)
    }
}
