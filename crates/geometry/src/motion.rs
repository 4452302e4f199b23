//! Rigid motions: poses as functions of time.

use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::Pose;

/// Error of making a [`Motion`] or a [`Screw`].
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum MotionError {
    /// There is no pose.
    #[error("expected at least one pose of a path, got none")]
    Empty,
    /// A number of a pose is NaN or infinite.
    #[error("expected finite numbers, got NaN or infinity (pose {index} of the path, counted from 0)")]
    NotFinite {
        /// Index of the pose in the path.
        index: usize,
    },
    /// The scale changes along the path.
    #[error(
        "expected one scale along a path, got {from} and then {to} (pose {index}, counted from 0); rigid motions \
         keep the size of an object"
    )]
    Scale {
        /// Index of the pose with another scale than the first.
        index: usize,
        /// The scale of the first pose.
        from: f64,
        /// The scale of this pose.
        to: f64,
    },
}

/// Greatest relative difference of the scales of two poses that counts as rounding.
const SAME_SCALE: f64 = 1e-6;

/// Rotation angles below this, in radians, are treated by power series.
const SMALL: f64 = 0.03;

/// A screw motion: a steady rotation about an axis and a steady shift along it (Chasles' theorem).
/// Translations and rotations about a fixed axis are special cases.
///
/// In the world, the velocity of a body point depends only on the place where it is
/// ([`Self::velocity`]). So each body point moves at constant speed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Screw {
    start: Pose,
    turn: Vector3<f64>,
    shift: Vector3<f64>,
}

impl Screw {
    /// Creates the motion from the pose `start`. `turn` is the axis of rotation times the angle in
    /// radians per unit of time; any angle is allowed. `shift` is the initial velocity of the
    /// object's origin, in world units per unit of time. It turns with the object.
    ///
    /// A `turn` of zero gives a translation along a straight line.
    #[must_use]
    pub fn new(start: Pose, turn: [f64; 3], shift: [f64; 3]) -> Self {
        Self { start, turn: turn.into(), shift: shift.into() }
    }

    /// Creates the motion that stays at `pose`.
    #[must_use]
    pub fn still(pose: Pose) -> Self {
        Self::new(pose, [0.0; 3], [0.0; 3])
    }

    /// Creates the screw motion that takes one unit of time from `start` to `end`. It turns the
    /// shorter way, by at most half a turn. For exactly half a turn, one of the two ways is taken,
    /// always the same.
    ///
    /// The scale is that of `start`. A relative change of up to 1e-6 counts as rounding and is
    /// ignored.
    ///
    /// # Errors
    /// Fails with [`MotionError::NotFinite`] for numbers that are not finite, and with
    /// [`MotionError::Scale`] if the scales differ.
    pub fn between(start: &Pose, end: &Pose) -> Result<Self, MotionError> {
        Motion::through(&[*start, *end]).map(|motion| motion.screw(0))
    }

    /// The screw between two poses that were checked.
    fn from_to(start: &Pose, end: &Pose) -> Self {
        let turned = Rotation3::from_matrix_unchecked(end.rotation() * start.rotation().transpose());
        let turn = UnitQuaternion::from_rotation_matrix(&turned).scaled_axis();
        let way = Vector3::from(end.translation()) - Vector3::from(start.translation());
        Self { start: *start, turn, shift: shift_for(&turn, way) }
    }

    /// Returns the pose at time 0.
    #[must_use]
    pub fn start(&self) -> &Pose {
        &self.start
    }

    /// Returns the axis of rotation times the angle per unit of time, in radians.
    #[must_use]
    pub fn turn(&self) -> [f64; 3] {
        self.turn.into()
    }

    /// Returns the velocity, in the world, of the body point that is at the world place `x`, in
    /// world units per unit of time. It is the same at all times.
    #[must_use]
    pub fn velocity(&self, x: [f64; 3]) -> [f64; 3] {
        let arm = Vector3::from(x) - Vector3::from(self.start.translation());
        (self.shift + self.turn.cross(&arm)).into()
    }

    /// Returns the pose at `time`: the exponential of the twist, applied to the start (Murray, Li &
    /// Sastry 1994, eq. 2.36). At time 0 it is exactly the start.
    #[must_use]
    pub fn at(&self, time: f64) -> Pose {
        let turn = self.turn * time;
        let turned = Rotation3::new(turn).into_inner();
        let way = Vector3::from(self.start.translation()) + way_of(&turn, self.shift * time);
        self.start.with_rotation(turned * self.start.rotation()).with_translation(way.into())
    }
}

/// A motion through poses, from each to the next in one unit of time by a [`Screw`].
///
/// ```
/// use nearmiss_geometry::{Motion, Pose};
///
/// // A quarter turn about the axis x = 1, parallel to z.
/// let quarter = Pose::from_axis_angle([0.0, 0.0, 1.0], std::f64::consts::FRAC_PI_2);
/// let end = quarter.with_translation([1.0, -1.0, 0.0]);
/// let motion = Motion::through(&[Pose::IDENTITY, end])?;
/// assert_eq!(motion.duration(), 1.0);
/// let halfway = motion.at(0.5).apply([0.0; 3]);
/// let expected = [1.0 - 0.5_f64.sqrt(), -(0.5_f64.sqrt()), 0.0];
/// assert!((0..3).all(|k| (halfway[k] - expected[k]).abs() < 1e-12), "on a circle about (1, 0, 0)");
/// # Ok::<(), nearmiss_geometry::MotionError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    screws: Vec<Screw>,
    end: Pose,
}

impl Motion {
    /// Creates the motion that stays at `pose`, with duration 0.
    #[must_use]
    pub fn still(pose: Pose) -> Self {
        Self { screws: Vec::new(), end: pose }
    }

    /// Creates the motion of one unit of time by `screw`.
    #[must_use]
    pub fn of_screw(screw: Screw) -> Self {
        Self { screws: vec![screw], end: screw.at(1.0) }
    }

    /// Creates the motion through `poses`; pose k is reached at time k. Between two poses the
    /// object turns the shorter way, by at most half a turn; give more poses for more. One pose
    /// gives a motion that stays there.
    ///
    /// The scale of all poses is that of the first. A relative difference of up to 1e-6 counts as
    /// rounding and is ignored.
    ///
    /// # Errors
    /// Fails without poses, for numbers that are not finite, and if the scale changes by more than
    /// rounding.
    pub fn through(poses: &[Pose]) -> Result<Self, MotionError> {
        let end = *poses.last().ok_or(MotionError::Empty)?;
        let is_finite = |pose: &Pose| pose.to_row_major().iter().all(|x| x.is_finite());
        if let Some(index) = poses.iter().position(|pose| !is_finite(pose)) {
            return Err(MotionError::NotFinite { index });
        }
        let from = poses.first().map_or(1.0, Pose::scale);
        for (index, pose) in poses.iter().enumerate() {
            let to = pose.scale();
            if (to - from).abs() > SAME_SCALE * from.abs() {
                return Err(MotionError::Scale { index, from, to });
            }
        }
        let between = |pair: &[Pose]| Screw::from_to(&pair[0].with_scale(from), &pair[1]);
        let screws = poses.windows(2).map(between).collect();
        Ok(Self { screws, end: end.with_scale(from) })
    }

    /// Returns the duration: the number of screws.
    #[must_use]
    pub fn duration(&self) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "fewer than 2⁵³ poses fit into memory")]
        let duration = self.screws.len() as f64;
        duration
    }

    /// Returns the motion from time `k` to `k` + 1. Past the end, the object stays.
    #[must_use]
    pub fn screw(&self, k: usize) -> Screw {
        self.screws.get(k).copied().unwrap_or_else(|| Screw::still(self.end))
    }

    /// Returns the pose at `time`. Before time 0 (and for NaN) it is that of time 0, and after the
    /// end that of the end.
    #[must_use]
    pub fn at(&self, time: f64) -> Pose {
        let time = time.max(0.0);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
        let k = time as usize;
        #[expect(clippy::cast_precision_loss, reason = "fewer than 2⁵³ poses fit into memory")]
        let within = if k < self.screws.len() { time - k as f64 } else { 0.0 };
        self.screw(k).at(within)
    }
}

/// Returns the way of the origin while it turns by `turn` with the initial shift `shift`: the left
/// Jacobian of the rotation, times `shift`.
fn way_of(turn: &Vector3<f64>, shift: Vector3<f64>) -> Vector3<f64> {
    let sq = turn.norm_squared();
    let angle = sq.sqrt();
    let (first, second) = if angle < SMALL {
        (0.5 - sq / 24.0 * (1.0 - sq / 30.0), 1.0 / 6.0 - sq / 120.0 * (1.0 - sq / 42.0))
    } else {
        let half = (0.5 * angle).sin();
        (2.0 * half * half / sq, (angle - angle.sin()) / (sq * angle))
    };
    let across = turn.cross(&shift);
    shift + first * across + second * turn.cross(&across)
}

/// Returns the initial shift for which the origin's way is `way`; the inverse of [`way_of`] for
/// angles up to π.
fn shift_for(turn: &Vector3<f64>, way: Vector3<f64>) -> Vector3<f64> {
    let sq = turn.norm_squared();
    let half = 0.5 * sq.sqrt();
    let second = if half < 0.5 * SMALL {
        1.0 / 12.0 + sq / 720.0 * (1.0 + sq / 42.0)
    } else {
        (1.0 - half * half.cos() / half.sin()) / sq
    };
    let across = turn.cross(&way);
    way - 0.5 * across + second * turn.cross(&across)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use super::*;

    fn off(a: &Pose, b: &Pose) -> f64 {
        let (a, b) = (a.to_row_major(), b.to_row_major());
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    /// Poses that are far from each other, near each other, and half a turn apart.
    fn pairs() -> Vec<[Pose; 2]> {
        let mut pairs = Vec::new();
        for k in 0..200_u32 {
            let s = f64::from(k);
            let axis = [(1.3 * s).sin(), (2.1 * s).cos(), (0.7 * s).sin() + 0.1];
            let from = Pose::from_axis_angle(axis, 3.0 * s.sin())
                .with_translation([s, -s, 0.5 * s])
                .with_scale(1.0 + 0.1 * s);
            let angle = [PI, 1e-9, 0.0299, 0.0301, 2.0, 0.0, PI - 1e-7][k as usize % 7];
            let turn = Pose::from_axis_angle([axis[2], axis[0], axis[1]], angle);
            let to = turn.after(&from.with_translation([0.0; 3])).with_translation([s.cos(), 3.0, s.sin()]);
            pairs.push([from, to]);
        }
        pairs
    }

    #[test]
    fn a_screw_takes_each_pose_to_the_next() {
        for [from, to] in pairs() {
            let screw = Screw::between(&from, &to).unwrap();
            assert_eq!(screw.at(0.0), from, "the start is exact");
            let scale = 200.0 * from.scale();
            assert!(off(&screw.at(1.0), &to) < 1e-12 * scale, "{from:?} to {to:?}: {:?}", screw.at(1.0));
            let turn = Vector3::from(screw.turn()).norm();
            assert!(turn <= PI + 1e-12, "the shorter way: {turn}");
        }
    }

    #[test]
    fn body_points_move_with_the_velocity_of_their_place_and_at_constant_speed() {
        for [from, to] in pairs() {
            let screw = Screw::between(&from, &to).unwrap();
            let point = [0.3, -2.0, 1.0];
            let place = |time: f64| Vector3::from(screw.at(time).apply(point));
            let mut speeds = Vec::new();
            for time in [0.0, 0.2, 0.5, 0.9] {
                let velocity = Vector3::from(screw.velocity(place(time).into()));
                let seen = (place(time + 1e-5) - place(time - 1e-5)) / 2e-5;
                let size = 1.0 + velocity.norm() + from.scale();
                assert!((velocity - seen).norm() < 1e-5 * size, "{velocity:?}, seen {seen:?} at {time}");
                speeds.push(velocity.norm());
            }
            assert!(speeds.iter().all(|s| (s - speeds[0]).abs() < 1e-9 * (1.0 + speeds[0])), "{speeds:?}");
        }
    }

    #[test]
    fn a_screw_of_several_turns_comes_round() {
        let start = Pose::from_translation([1.0, 2.0, 3.0]);
        // About the z axis through the origin: the origin of the object goes round on a circle.
        let about_z = [-2.0, 1.0, 0.0].map(|x| 5.0 * TAU * x);
        let screw = Screw::new(start, [0.0, 0.0, 5.0 * TAU], about_z);
        for turns in 0..=5 {
            let pose = screw.at(f64::from(turns) / 5.0);
            assert!(off(&pose, &start) < 1e-12, "after {turns} turns: {pose:?}");
        }
        let half = screw.at(0.1).translation();
        assert!(
            (half[0] + 1.0).abs() < 1e-12 && (half[1] + 2.0).abs() < 1e-12,
            "after half a turn: {half:?}"
        );
    }

    #[test]
    fn times_outside_the_motion_are_its_ends() {
        let poses = [0.0, 1.0, 4.0].map(|x| Pose::from_translation([x, 0.0, 0.0]));
        let motion = Motion::through(&poses).unwrap();
        let x = |time: f64| motion.at(time).translation()[0];
        assert_eq!([-1.0, 0.0, 0.5, 1.0, 1.5, 2.0, 9.0].map(x), [0.0, 0.0, 0.5, 1.0, 2.5, 4.0, 4.0]);
        assert_eq!([x(f64::NAN), x(f64::INFINITY)], [0.0, 4.0]);
        assert_eq!(Motion::through(&poses[..1]), Ok(Motion::still(poses[0])), "one pose");
    }

    #[test]
    fn paths_that_are_no_rigid_motion_are_refused() {
        assert_eq!(Motion::through(&[]), Err(MotionError::Empty));
        let bad = Pose::from_translation([f64::NAN, 0.0, 0.0]);
        assert_eq!(Motion::through(&[Pose::IDENTITY, bad]), Err(MotionError::NotFinite { index: 1 }));
        let grown = Pose::IDENTITY.with_scale(2.0);
        let refused = Motion::through(&[Pose::IDENTITY, Pose::IDENTITY, grown]);
        assert_eq!(refused, Err(MotionError::Scale { index: 2, from: 1.0, to: 2.0 }));
        // Rounding of the scale does not accumulate along a motion.
        let nearly = Motion::through(&[Pose::IDENTITY, Pose::IDENTITY.with_scale(1.0 + 1e-7)]).unwrap();
        assert_eq!([0.0, 0.5, 1.0].map(|time| nearly.at(time).scale()), [1.0; 3]);
        let drifts: Vec<Pose> =
            (0..20).map(|k| Pose::IDENTITY.with_scale(1.0 + 1e-7 * f64::from(k))).collect();
        let refused = MotionError::Scale { index: 11, from: 1.0, to: drifts[11].scale() };
        assert_eq!(Motion::through(&drifts), Err(refused));
    }
}
