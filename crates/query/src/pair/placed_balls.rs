//! The bounding balls of two things in the world, and the relative pose of their stored frames.

use nearmiss_geometry::Pose;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{Ball, Relative, SLACK};

/// Things whose stored frames differ in scale by more than this are not compared in single
/// precision.
const GREATEST_RATIO: f64 = (1_u64 << 60) as f64;

/// About ten roundings of 2⁻⁵³ each, from composing and applying poses.
const DOUBLE_ROUNDING: f64 = 2e-15;

/// Tolerance of [`is_proper`]: the summed errors of the lengths, the angle and the cross product of
/// the rotation's columns.
const MOST_OFF: f64 = 6e-9;

/// Returns `true` if the pose is finite and its linear part is a rotation with a positive scale.
/// Products of many poses may drift away from that.
pub(crate) fn is_proper(pose: &Pose) -> bool {
    let rotation = pose.rotation();
    let [u, v, w] = [rotation.column(0), rotation.column(1), rotation.column(2)];
    // Two unit vectors at right angles, and their cross product.
    let (third, across) = (u.cross(&v) - w, u.dot(&v));
    let off = (u.norm_squared() - 1.0).abs() + (v.norm_squared() - 1.0).abs() + across.abs();
    // Sum up without branches; a sum with NaN is NaN and fails the comparison.
    let off = off + third.x.abs() + third.y.abs() + third.z.abs();
    let far: f64 = pose.translation().iter().map(|x| x.abs()).sum();
    off <= MOST_OFF && far < f64::INFINITY && pose.scale() > 0.0
}

/// Returns `true` if both poses are proper and of similar scale.
fn are_comparable([a, b]: [&Pose; 2]) -> bool {
    let ratio = b.scale() / a.scale();
    is_proper(a) && is_proper(b) && (1.0 / GREATEST_RATIO..=GREATEST_RATIO).contains(&ratio)
}

/// Returns b's pose in a's stored frame; `None` if a pose is invalid or out of range.
pub(crate) fn relative_pose(placed: [&Pose; 2]) -> Option<Pose> {
    are_comparable(placed).then(|| placed[1].relative_to(placed[0]))
}

/// Two bounding balls in the world.
pub(crate) struct PlacedBalls<'a> {
    /// The poses of the stored frames.
    placed: [&'a Pose; 2],
    /// The centre of a's ball in its stored frame.
    centre: [f64; 3],
    /// The distance of the centres.
    distance: f64,
    /// The radii.
    pub(crate) radii: [f64; 2],
    /// A lower bound of the distance of the balls.
    pub(crate) gap: f64,
    /// The rounding error in double precision, which grows with the distance from the world's
    /// origin.
    lost: f64,
}

impl<'a> PlacedBalls<'a> {
    /// Places the `stored` balls, given in stored frames, at the poses of these frames. `None` if a
    /// pose is invalid or out of range.
    pub(crate) fn of(placed: [&'a Pose; 2], stored: [Ball; 2]) -> Option<Self> {
        if are_comparable(placed) { Self::of_comparable(placed, stored) } else { None }
    }

    /// The same for poses that are known to be valid and in range.
    pub(crate) fn of_comparable(placed: [&'a Pose; 2], stored: [Ball; 2]) -> Option<Self> {
        let [a, b] = placed;
        let place =
            |pose: &Pose, ball: &Ball| (Vector3::from(pose.apply(ball.centre)), ball.radius * pose.scale());
        let ((ca, ra), (cb, rb)) = (place(a, &stored[0]), place(b, &stored[1]));
        let far = |pose: &Pose| size(pose.translation().into());
        let lost = DOUBLE_ROUNDING * (far(a) + far(b) + size(ca) + size(cb));
        let distance = (ca - cb).norm();
        let gap = distance * (1.0 - 1e-6) - (ra + rb) * (1.0 + 1e-6) - lost;
        let valid = !gap.is_nan() && gap != f64::INFINITY;
        valid.then(|| Self { placed, centre: stored[0].centre, distance, radii: [ra, rb], gap, lost })
    }

    /// Returns b's pose in a's stored frame, in double and in single precision.
    pub(crate) fn relative(&self) -> (Pose, Relative) {
        let [a, b] = self.placed;
        let pose = b.relative_to(a);
        let [ra, rb] = self.radii;
        // Coordinates in a's stored frame, of a's own points and of b's.
        let extent = size(self.centre.into()) + (self.distance + ra + 2.0 * rb) / a.scale();
        let shift = size(pose.translation().into());
        // The slack of `Relative` is proportional to the extent passed to it.
        let lost = self.lost / a.scale() / f64::from(SLACK);
        let relative = Relative::new(&pose, extent + shift + lost);
        (pose, relative)
    }
}

/// An upper bound of the norm of `v` that takes no square root.
fn size(v: Vector3<f64>) -> f64 {
    v.x.abs() + v.y.abs() + v.z.abs()
}
