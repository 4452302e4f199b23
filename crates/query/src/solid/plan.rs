//! Validated options for a scan and convex shapes.

use nearmiss_hierarchy::PointHierarchy;
use nearmiss_surface::Metric;

use crate::ask::answer::Evidence;
use crate::ask::options::{CollideOptions, CollidePlan, Detail, Method, PlanError};
use crate::distance::DistancePlan;

/// A validated question about a scan and [shapes](crate::Shape) or [rays](crate::Ray). It serves
/// every scan of the same [metric](PointHierarchy::metric), in any pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapePlan {
    options: CollideOptions,
}

impl ShapePlan {
    /// Validates `options`.
    ///
    /// The options have the meaning that they have for two scans ([`CollideOptions`]), with these
    /// differences. A shape is exact, so with [`Semantics::Thickened`](crate::Semantics) only the
    /// points of the scan have balls. With [`Detail::Verdict`](crate::Detail) nothing evaluates the
    /// implicit function; with [`Detail::Witness`](crate::Detail) contacts, manifold points and hits
    /// of rays are moved onto the surface, with a few evaluations each. The order is ignored.
    ///
    /// # Errors
    /// Names the option that is out of range, or the metric that does not match. The methods of the
    /// papers, and sphere coverings, are for two scans: either is [`PlanError::NotForShapes`].
    pub fn new(options: &CollideOptions, scan: &PointHierarchy) -> Result<Self, PlanError> {
        Self::of_metric(options, scan.metric())
    }

    /// Validates `options` for any scans of a metric, such as those that a [world](crate::World) will have.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn of_metric(options: &CollideOptions, metric: Metric) -> Result<Self, PlanError> {
        let refused = match options.method {
            Method::Sampling(_) => Some("the method `sampling`"),
            Method::Interpolation(_) => Some("the method `interpolation`"),
            Method::Traversal => options.coverings.then_some("sphere coverings"),
        };
        if let Some(what) = refused {
            return Err(PlanError::NotForShapes(what));
        }
        Ok(Self { options: *CollidePlan::of_metric(options, metric)?.options() })
    }

    /// The plan for one scan of a pair, with the options of the pair. Nothing evaluates the implicit
    /// function.
    pub(crate) fn of_pair(options: &CollideOptions) -> Self {
        Self::proving(options.with_detail(Detail::Verdict))
    }

    /// The plan for pairs of a world, with the options of one for two scans.
    pub(crate) fn of_plan(plan: &CollidePlan) -> Self {
        Self { options: plan.options().by_descent() }
    }

    /// The plan for the distance of a scan and a shape, with the meaning of one for two scans.
    pub(crate) fn of_distance(plan: &DistancePlan) -> Self {
        Self::proving(*plan.touching().options())
    }

    /// The plan with these options, with which distances are proven if the metric allows it.
    fn proving(options: CollideOptions) -> Self {
        let proves = options.metric != Some(Metric::Geodesic);
        let evidence = if proves { Evidence::Certified } else { Evidence::Estimated };
        Self { options: options.with_evidence(evidence) }
    }

    /// Returns the distance from the [box](crate::Placed::bounds) of a scan, in world units, up to which
    /// a shape may touch the scan. This is the reach of
    /// [`World::near_shape`](crate::World::near_shape) for this question.
    #[must_use]
    pub fn reach(&self) -> f64 {
        self.options.semantics.growth() + self.options.margin
    }

    /// The options that were validated, with the metric of the scan.
    #[must_use]
    pub fn options(&self) -> &CollideOptions {
        &self.options
    }
}
