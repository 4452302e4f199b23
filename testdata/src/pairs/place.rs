//! Where B is to go, and where it went.

use nearmiss_geometry::Pose;
use rand_xoshiro::Xoshiro256PlusPlus;

pub(super) type Stream = Xoshiro256PlusPlus;

/// The gap to aim at, and the radius it is judged by.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wanted {
    pub(super) gap: f64,
    pub(super) r: f64,
}

/// Where B went in A's frame, and the gap there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Placed {
    pub(super) pose_b: Pose,
    pub(super) gap: f64,
}
