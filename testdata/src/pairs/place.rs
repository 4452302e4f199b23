//! Placements of B: wanted and actual.

use nearmiss_geometry::Pose;
use rand_xoshiro::Xoshiro256PlusPlus;

pub(super) type Stream = Xoshiro256PlusPlus;

/// The wanted gap, and the radius by which it is judged.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wanted {
    pub(super) gap: f64,
    pub(super) r: f64,
}

/// The pose of B in A's frame, and the gap there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Placed {
    pub(super) pose_b: Pose,
    pub(super) gap: f64,
}
