//! The data of a whole scan that a query reads before it visits any node.

use serde::{Deserialize, Serialize};

use crate::bounds::boxes::OrientedBox;

/// A ball in the stored frame.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Ball {
    /// The centre.
    pub centre: [f64; 3],
    /// The radius.
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
    /// A hash of all points, their frame, their discs and the parameters of the tree.
    pub identity: u64,
    /// Bounding ball of the surface.
    pub surface: Ball,
    /// Bounding ball of the obstacle.
    pub obstacle: Ball,
    /// Bounding ball of the points with their discs.
    pub discs: Ball,
}
