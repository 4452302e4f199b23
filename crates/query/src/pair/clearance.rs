//! A separation that is remembered: it holds until b has moved as far as it was wide.

use nearmiss_geometry::Pose;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::Ball;

/// An upper bound on how far the motion between two poses moves any point of a ball.
pub(crate) fn motion(Ball { centre, radius }: &Ball, from: &Pose, to: &Pose) -> f64 {
    let shift = (Vector3::from(to.apply(*centre)) - Vector3::from(from.apply(*centre))).norm();
    let turn = (to.rotation() * to.scale() - from.rotation() * from.scale()).norm();
    (shift + turn * radius) * (1.0 + 1e-9)
}

/// A lower bound of the distance of two things at a relative pose, in a's stored frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Clearance {
    /// The identities of both.
    things: [u64; 2],
    /// The pose of b's stored frame in a's.
    pose: Pose,
    distance: f64,
}

impl Clearance {
    /// Returns `None` unless `distance` is positive.
    pub(crate) fn new(things: [u64; 2], pose: &Pose, distance: f64) -> Option<Self> {
        (distance > 0.0).then_some(Self { things, pose: *pose, distance })
    }

    /// A lower bound of the distance at another pose, in a's stored frame; `None` for other things.
    /// `ball` contains b. The pose has a rounding error of `slack`.
    pub(crate) fn at(&self, things: [u64; 2], pose: &Pose, ball: &Ball, slack: f32) -> Option<f64> {
        let left = self.distance - motion(ball, &self.pose, pose) - f64::from(slack);
        (self.things == things).then_some(left)
    }
}
