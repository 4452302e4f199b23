//! Which points of a file are wanted.

use nearmiss_geometry::Aabb;

/// Points of a part of space, and no more of them than a distance asks for.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Selection {
    /// Nodes that lie outside are left out.
    pub(crate) bounds: Option<Aabb>,
    /// Levels of the tree are left out whose points are nearer to each other than this.
    pub(crate) spacing: Option<f64>,
}
