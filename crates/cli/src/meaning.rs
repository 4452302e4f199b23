//! Options for what `collide` and `distance` compare: obstacles, surfaces, or balls about the
//! points.

use clap::Args;
use nearmiss::{Metric, Scan, Semantics};

use crate::parse::parse_radius;

/// Options for what is compared. The default is obstacles: the surface where points sample a sheet,
/// small balls about all other points, and every measured point.
#[derive(Debug, Clone, Copy, Args)]
pub struct MeaningArgs {
    /// Compare surfaces alone, and ignore points that sample no sheet
    ///
    /// By default, points that sample no sheet count as small balls with a radius of up to half the
    /// local spacing. With the geodesic kernel, surfaces alone are compared in any case. Surfaces are
    /// those of Klein & Zachmann 2004.
    #[arg(long, conflicts_with = "thickened")]
    pub surface_only: bool,
    /// Compare balls of this radius about the points instead of surfaces
    ///
    /// The answer is exact. The radius is in world units.
    #[arg(long, value_name = "RADIUS", allow_hyphen_values = true, value_parser = parse_radius)]
    pub thickened: Option<f64>,
}

impl MeaningArgs {
    /// Returns the semantics for two scans with the metric of `a`.
    pub(crate) fn semantics(self, a: &Scan) -> Semantics {
        match self.thickened {
            Some(radius) => Semantics::Thickened(radius),
            None if self.surface_only || a.metric() == Metric::Geodesic => Semantics::Surface,
            None => Semantics::Obstacle,
        }
    }
}
