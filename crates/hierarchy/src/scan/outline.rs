//! What a query asks of a whole scan before it looks at any node.

use serde::{Deserialize, Serialize};

use crate::bounds::boxes::OrientedBox;

/// A ball in the stored frame.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Ball {
    /// The middle.
    pub centre: [f64; 3],
    /// Radius.
    pub radius: f64,
}

impl Ball {
    pub(crate) fn about(bounds: &OrientedBox) -> Self {
        Self { centre: bounds.centre.map(f64::from), radius: f64::from(bounds.radius()) }
    }
}

/// The hash that identifies a scan, and its bounding balls.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Outline {
    /// A hash of all points, their frame and their discs, and of what the tree is made by.
    pub identity: u64,
    /// About the surface.
    pub surface: Ball,
    /// About the obstacle.
    pub obstacle: Ball,
    /// About the points with their discs.
    pub discs: Ball,
}
