//! Validated options for a mesh and a scan.

use nearmiss_hierarchy::PointHierarchy;

use crate::ask::options::{CollideOptions, CollidePlan, Method, Order, PlanError};
use crate::distance::DistancePlan;
use crate::motion::plan::SweepPlan;

/// A validated question about a mesh and a scan. It serves every mesh, and every scan of the same
/// [metric](PointHierarchy::metric), in any poses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshScanPlan {
    options: CollideOptions,
}

impl MeshScanPlan {
    /// Validates `options`.
    ///
    /// The options have the meaning that they have for two scans ([`CollideOptions`]), with one
    /// difference: with [`Semantics::Thickened`](crate::Semantics::Thickened) only the points of the
    /// scan have balls, as the mesh is exact.
    ///
    /// # Errors
    /// Names the option that is out of range, or the metric that does not match. The methods and
    /// orders of the papers, and sphere coverings, are for two scans: any of them is
    /// [`PlanError::NotForMeshes`].
    pub fn new(options: &CollideOptions, scan: &PointHierarchy) -> Result<Self, PlanError> {
        let refused = match (options.method, options.order) {
            (Method::Sampling(_), _) => Some("the method `sampling`"),
            (Method::Interpolation(_), _) => Some("the method `interpolation`"),
            (Method::Traversal, Some(Order::Sides)) => Some("the order `sides`"),
            (Method::Traversal, Some(Order::SidesByGap)) => Some("the order `sides-by-gap`"),
            (Method::Traversal, Some(Order::Cells)) => Some("the order `cells`"),
            _ => options.coverings.then_some("sphere coverings"),
        };
        if let Some(what) = refused {
            return Err(PlanError::NotForMeshes(what));
        }
        Ok(Self { options: *CollidePlan::new(options, scan, scan)?.options() })
    }

    /// The plan for pairs of a world, with the options of one for two scans.
    pub(crate) fn of_pair(plan: &CollidePlan) -> Self {
        Self { options: plan.options().by_descent() }
    }

    /// The contact test of a distance query.
    pub(crate) fn touching(plan: &DistancePlan) -> Self {
        Self { options: *plan.touching().options() }
    }

    /// The contact test of a sweep.
    pub(crate) fn sweeping(plan: &SweepPlan) -> Self {
        Self { options: *plan.touching().options() }
    }

    /// The plan of a search that only asks whether the mesh and the scan meet.
    pub(crate) fn of_verdicts(&self) -> Self {
        Self { options: self.options.of_verdicts() }
    }

    /// Returns the distance, in world units, up to which a triangle and a point or a surface count
    /// as meeting.
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
