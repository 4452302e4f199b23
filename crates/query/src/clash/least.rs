//! Bounds of the distance of two leaves.

use nearmiss_hierarchy::NodePair;
use nearmiss_surface::Metric;

use crate::ask::options::{CollidePlan, Semantics};
use crate::leaf::nearest_points::nearest;
use crate::pair::pairing::ItemPair;
use crate::pair::scan_pair::ScanPair;

/// Bounds of the distance of two leaves, in world units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Least {
    /// Proven lower bound, at least zero.
    pub(crate) lower: f64,
    /// Distance of the two nearest points, less the radii of their balls. Negative if the balls
    /// overlap.
    pub(crate) upper: f64,
}

impl Least {
    pub(crate) fn of(pair: &ScanPair<'_>, plan: &CollidePlan, leaves: NodePair) -> Self {
        let none = ItemPair { distance: f64::INFINITY, items: [0; 2] };
        let points = nearest(pair.level, pair, leaves, none).distance;
        if let Semantics::Thickened(radius) = plan.options().semantics {
            let beyond = points - 2.0 * radius;
            return Self { lower: beyond.max(0.0), upper: beyond };
        }
        if plan.options().metric == Some(Metric::Geodesic) {
            return Self { lower: 0.0, upper: points };
        }
        let gap = f64::from(pair.gap_of_parts(leaves) - pair.relative.slack());
        Self { lower: (gap * pair.views[0].stored_to_world().scale()).max(0.0), upper: points }
    }
}
