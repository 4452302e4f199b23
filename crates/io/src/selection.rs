//! `Selection`: a region and a level of detail.

use nearmiss_geometry::Aabb;

/// A selection of the nodes of a COPC file, by region and level of detail.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Selection {
    /// Bounds outside of which nodes are skipped.
    pub(crate) bounds: Option<Aabb>,
    /// Distance between points at the finest level. Finer levels are skipped.
    pub(crate) spacing: Option<f64>,
}
