//! Poses of objects: rotation, translation and uniform scale, object → world.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::Aabb;

/// Error of making a [`Pose`] from a 4×4 matrix.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum PoseError {
    /// An entry is NaN or infinite.
    #[error("expected a finite number, got NaN or infinity (entry {index} of the pose, row-major)")]
    NotFinite {
        /// Index of the entry, 0 to 15.
        index: usize,
    },
    /// An entry is so large that squared distances overflow.
    #[error("expected a number within ±1e100, got a larger one (entry {index} of the pose, row-major)")]
    TooLarge {
        /// Index of the entry, 0 to 15.
        index: usize,
    },
    /// The last row is not 0 0 0 1.
    #[error(
        "expected a last row of 0 0 0 1, got another one; give the pose row-major, with the translation in the \
         last column"
    )]
    NotAffine,
    /// A linear part that mirrors or flattens space.
    #[error(
        "expected a positive determinant, got {determinant}; give a rotation with uniform scale, without reflection"
    )]
    NotProper {
        /// Determinant of the linear part.
        determinant: f64,
    },
    /// A linear part that shears or scales unevenly, where the size of the object is unknown.
    #[error(
        "expected a rotation with uniform scale, got a pose with an entry that is {off} of the scale away from \
         the nearest one; give its translation and a quaternion instead"
    )]
    Skewed {
        /// Greatest difference of an entry of the linear part, as a share of the scale.
        off: f64,
    },
    /// A linear part that shears or scales unevenly.
    #[error(
        "expected a rotation with uniform scale, got a pose whose nearest rotation moves the object's bounds by {moved}, \
         more than {tolerance} (a tenth of the sampling radius); give its translation and a quaternion instead"
    )]
    NotRigid {
        /// Greatest move of a corner of the object's bounds, in world units.
        moved: f64,
        /// Greatest move allowed, in world units.
        tolerance: f64,
    },
}

/// Beyond this, squares and cubes leave the range of double precision.
const FARTHEST: f64 = 1e100;

/// A pose: world = scale · rotation · object + translation, in double precision.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    rotation: Matrix3<f64>,
    translation: Vector3<f64>,
    scale: f64,
}

impl Default for Pose {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl Pose {
    /// The identity.
    pub const IDENTITY: Self = Self {
        rotation: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        translation: Vector3::new(0.0, 0.0, 0.0),
        scale: 1.0,
    };

    /// Creates a translation by `t`.
    #[inline]
    #[must_use]
    pub fn from_translation(t: [f64; 3]) -> Self {
        Self { translation: t.into(), ..Self::IDENTITY }
    }

    /// Creates a rotation by `angle` radians about `axis`, which need not be a unit vector. Returns
    /// the identity for a zero axis.
    #[must_use]
    pub fn from_axis_angle(axis: [f64; 3], angle: f64) -> Self {
        let axis = nalgebra::Unit::try_new(Vector3::from(axis), 0.0);
        let rotation = axis.map_or_else(nalgebra::Rotation3::identity, |axis| {
            nalgebra::Rotation3::from_axis_angle(&axis, angle)
        });
        Self { rotation: rotation.into_inner(), ..Self::IDENTITY }
    }

    /// Creates the rotation of a quaternion (x, y, z, w) of any length. Returns the identity for
    /// length zero. A component that is not finite gives a rotation of NaN, which every query refuses.
    ///
    /// ```
    /// use nearmiss_geometry::Pose;
    ///
    /// assert!(Pose::from_quaternion([0.0, f64::NAN, 0.0, 1.0]).apply([1.0, 0.0, 0.0])[0].is_nan());
    /// ```
    #[inline]
    #[must_use]
    pub fn from_quaternion(q: [f64; 4]) -> Self {
        let is_finite = q.iter().all(|x| x.is_finite());
        let q = nalgebra::Quaternion::from(q);
        let unit = nalgebra::Unit::try_new(q, 0.0).unwrap_or_default();
        let rotation = unit.to_rotation_matrix().into_inner();
        let rotation = if is_finite { rotation } else { Matrix3::repeat(f64::NAN) };
        Self { rotation, ..Self::IDENTITY }
    }

    /// Creates the rotation of a quaternion (x, y, z, w), as [`Self::from_quaternion`] does,
    /// followed by `translation`. Physics engines call this an isometry.
    ///
    /// ```
    /// use nearmiss_geometry::Pose;
    ///
    /// // A quarter turn about z.
    /// let half = 0.5_f64.sqrt();
    /// let pose = Pose::new([1.0, 2.0, 3.0], [0.0, 0.0, half, half]);
    /// let moved = pose.apply([1.0, 0.0, 0.0]);
    /// assert!((0..3).all(|k| (moved[k] - [1.0, 3.0, 3.0][k]).abs() < 1e-12));
    /// ```
    #[inline]
    #[must_use]
    pub fn new(translation: [f64; 3], quaternion: [f64; 4]) -> Self {
        Self::from_quaternion(quaternion).with_translation(translation)
    }

    /// Creates a pose from a row-major 4×4 matrix whose linear part is a rotation with uniform
    /// scale.
    ///
    /// Rounding to single precision is tolerated: entries may be off by 1e-5 of the scale. The
    /// result is the nearest pose, in the sense of the polar decomposition.
    ///
    /// [`Self::from_row_major`] accepts greater errors if they move an object little.
    ///
    /// ```
    /// use nearmiss_geometry::{Pose, PoseError};
    ///
    /// let pose = Pose::from_matrix(&[
    ///     0.0, -2.0, 0.0, 5.0, //
    ///     2.0, 0.0, 0.0, 6.0, //
    ///     0.0, 0.0, 2.0, 7.0, //
    ///     0.0, 0.0, 0.0, 1.0,
    /// ])?;
    /// assert_eq!((pose.scale(), pose.translation()), (2.0, [5.0, 6.0, 7.0]));
    ///
    /// let mut sheared = Pose::IDENTITY.to_row_major();
    /// sheared[1] = 0.1;
    /// assert!(matches!(Pose::from_matrix(&sheared), Err(PoseError::Skewed { .. })));
    /// # Ok::<(), PoseError>(())
    /// ```
    ///
    /// # Errors
    /// Fails if the matrix is not finite, has an entry beyond ±1e100, is not affine, mirrors,
    /// shears or scales unevenly.
    pub fn from_matrix(m: &[f64; 16]) -> Result<Self, PoseError> {
        /// About eighty roundings of single precision.
        const MOST_OFF: f64 = 1e-5;
        let (pose, linear) = decomposed(m)?;
        let off = (linear / pose.scale - pose.rotation).amax();
        // Written so that NaN is rejected.
        if off <= MOST_OFF { Ok(pose) } else { Err(PoseError::Skewed { off }) }
    }

    /// Creates a pose from a row-major 4×4 matrix: the nearest rotation and uniform scale, in the
    /// sense of the polar decomposition.
    ///
    /// That pose may move each corner of `bounds` by at most `tolerance` world units from where the
    /// matrix moves it.
    ///
    /// # Errors
    /// Fails if the matrix is not finite, has an entry beyond ±1e100, is not affine, mirrors, or is
    /// further than `tolerance` from a pose.
    pub fn from_row_major(m: &[f64; 16], bounds: &Aabb, tolerance: f64) -> Result<Self, PoseError> {
        let (pose, linear) = decomposed(m)?;
        let Self { rotation, scale, .. } = pose;
        let moved = bounds
            .corners()
            .map(|c| {
                let c = Vector3::from(c);
                (linear * c - scale * rotation * c).norm()
            })
            .into_iter()
            .fold(0.0, f64::max);
        // Written so that NaN is rejected.
        if moved <= tolerance { Ok(pose) } else { Err(PoseError::NotRigid { moved, tolerance }) }
    }

    /// Returns the pose as a row-major 4×4 matrix.
    #[must_use]
    pub fn to_row_major(&self) -> [f64; 16] {
        let mut m = [0.0; 16];
        m[15] = 1.0;
        for i in 0..3 {
            for j in 0..3 {
                m[4 * i + j] = self.scale * self.rotation[(i, j)];
            }
            m[4 * i + 3] = self.translation[i];
        }
        m
    }

    /// Replaces the scale.
    #[inline]
    #[must_use]
    pub fn with_scale(self, scale: f64) -> Self {
        Self { scale, ..self }
    }

    /// Replaces the translation.
    #[inline]
    #[must_use]
    pub fn with_translation(self, t: [f64; 3]) -> Self {
        Self { translation: t.into(), ..self }
    }

    /// Replaces the rotation, which must be orthogonal.
    #[inline]
    pub(crate) fn with_rotation(self, rotation: Matrix3<f64>) -> Self {
        Self { rotation, ..self }
    }

    /// Returns the rotation.
    #[inline]
    #[must_use]
    pub fn rotation(&self) -> &Matrix3<f64> {
        &self.rotation
    }

    /// Returns the translation: the position of the object's origin in the world.
    #[inline]
    #[must_use]
    pub fn translation(&self) -> [f64; 3] {
        self.translation.into()
    }

    /// Returns the uniform scale, which is positive.
    #[inline]
    #[must_use]
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Maps a point from the object to the world.
    #[inline]
    #[must_use]
    pub fn apply(&self, p: [f64; 3]) -> [f64; 3] {
        (self.scale * (self.rotation * Vector3::from(p)) + self.translation).into()
    }

    /// Maps a point from the world to the object.
    #[inline]
    #[must_use]
    pub fn apply_inverse(&self, p: [f64; 3]) -> [f64; 3] {
        (self.rotation.tr_mul(&(Vector3::from(p) - self.translation)) / self.scale).into()
    }

    /// Maps a direction from the object to the world; its length stays the same.
    #[inline]
    #[must_use]
    pub fn rotate(&self, v: [f64; 3]) -> [f64; 3] {
        (self.rotation * Vector3::from(v)).into()
    }

    /// Maps a direction from the world to the object; its length stays the same.
    #[inline]
    #[must_use]
    pub fn rotate_inverse(&self, v: [f64; 3]) -> [f64; 3] {
        self.rotation.tr_mul(&Vector3::from(v)).into()
    }

    /// Composes two poses: `inner` first, then `self`.
    #[inline]
    #[must_use]
    pub fn after(&self, inner: &Self) -> Self {
        Self {
            rotation: self.rotation * inner.rotation,
            translation: self.scale * (self.rotation * inner.translation) + self.translation,
            scale: self.scale * inner.scale,
        }
    }

    /// Returns this pose in the frame of another. Equals `frame.inverse().after(self)`, in less
    /// time.
    #[inline]
    #[must_use]
    pub fn relative_to(&self, frame: &Self) -> Self {
        let scale = 1.0 / frame.scale;
        let origin = -frame.rotation.tr_mul(&frame.translation) / frame.scale;
        Self {
            rotation: frame.rotation.tr_mul(&self.rotation),
            translation: scale * frame.rotation.tr_mul(&self.translation) + origin,
            scale: scale * self.scale,
        }
    }

    /// Returns the inverse pose.
    #[inline]
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.transpose();
        let translation = -(rotation * self.translation) / self.scale;
        Self { rotation, translation, scale: 1.0 / self.scale }
    }
}

/// Returns the pose nearest to a row-major 4×4 matrix, and the linear part of the matrix.
fn decomposed(m: &[f64; 16]) -> Result<(Pose, Matrix3<f64>), PoseError> {
    if let Some(index) = m.iter().position(|x| !x.is_finite()) {
        return Err(PoseError::NotFinite { index });
    }
    if let Some(index) = m.iter().position(|x| x.abs() > FARTHEST) {
        return Err(PoseError::TooLarge { index });
    }
    if m[12..] != [0.0, 0.0, 0.0, 1.0] {
        return Err(PoseError::NotAffine);
    }
    let linear = Matrix3::from_fn(|i, j| m[4 * i + j]);
    let translation = Vector3::new(m[3], m[7], m[11]);
    let determinant = linear.determinant();
    let scale = determinant.cbrt();
    let rotation = if scale.is_normal() && scale > 0.0 { nearest_rotation(linear / scale) } else { None };
    let rotation = rotation.ok_or(PoseError::NotProper { determinant })?;
    Ok((Pose { rotation, translation, scale }, linear))
}

/// Returns the orthogonal factor of the polar decomposition, by Newton's iteration R ← (R + R⁻ᵀ)/2,
/// which converges quadratically for any regular matrix. `None` if an iterate cannot be inverted.
fn nearest_rotation(m: Matrix3<f64>) -> Option<Matrix3<f64>> {
    /// From a condition number of 1e6, the iteration halves the distance to 1 about twenty times
    /// before quadratic convergence sets in.
    const STEPS: usize = 40;
    let mut r = m;
    for _ in 0..STEPS {
        let next = 0.5 * (r + r.try_inverse()?.transpose());
        let change = (next - r).amax();
        r = next;
        if change <= 1e-15 {
            break;
        }
    }
    r.iter().all(|x| x.is_finite()).then_some(r)
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: Aabb = Aabb { min: [-1.0; 3], max: [1.0, 2.0, 3.0] };

    #[test]
    fn matrices_round_trip() {
        let pose =
            Pose::from_axis_angle([1.0, -2.0, 0.5], 0.7).with_scale(2.5).with_translation([3.0, 4.0, 5.0]);
        let back = Pose::from_row_major(&pose.to_row_major(), &BOX, 1e-12).unwrap();
        for c in BOX.corners() {
            for k in 0..3 {
                assert!((pose.apply(c)[k] - back.apply(c)[k]).abs() < 1e-14, "corner {c:?}");
                assert!((pose.apply_inverse(pose.apply(c))[k] - c[k]).abs() < 1e-14, "inverse of {c:?}");
                assert!(
                    (pose.inverse().apply(c)[k] - pose.apply_inverse(c)[k]).abs() < 1e-14,
                    "inverse pose"
                );
            }
        }
    }

    #[test]
    fn what_is_no_pose_is_refused() {
        let identity = Pose::IDENTITY.to_row_major();
        let with = |i: usize, x: f64| {
            let mut m = identity;
            m[i] = x;
            Pose::from_row_major(&m, &BOX, 1e-3)
        };
        assert_eq!(with(5, f64::NAN), Err(PoseError::NotFinite { index: 5 }));
        assert_eq!(with(3, 1e200), Err(PoseError::TooLarge { index: 3 }));
        assert_eq!(with(12, 0.5), Err(PoseError::NotAffine));
        assert!(matches!(with(0, -1.0), Err(PoseError::NotProper { determinant: -1.0 })), "a mirror");
        assert!(matches!(with(0, 0.0), Err(PoseError::NotProper { .. })), "a flattening");
        assert!(matches!(with(1, 0.1), Err(PoseError::NotRigid { .. })), "a shear");
        assert!(with(1, 1e-4).is_ok(), "a shear within the tolerance is mended");
    }

    #[test]
    fn relative_poses_are_those_after_the_inverse() {
        for i in 0..200_u8 {
            let x = f64::from(i);
            let pose = |x: f64| {
                Pose::from_axis_angle([x.sin(), x.cos(), 0.3], 0.1 * x)
                    .with_scale(0.5 + (0.7 * x).sin().abs())
                    .with_translation([x.cos(), 100.0 * x, -1e-3 * x])
            };
            let (frame, of) = (pose(x), pose(3.0 * x + 1.0));
            assert_eq!(of.relative_to(&frame), frame.inverse().after(&of), "{i}");
        }
        assert_eq!(Pose::IDENTITY.relative_to(&Pose::IDENTITY), Pose::IDENTITY, "identity");
    }

    #[test]
    fn composition_applies_the_inner_pose_first() {
        let turn = Pose::from_quaternion([0.0, 0.0, 1.0, 1.0]);
        let shift = Pose::from_translation([1.0, 0.0, 0.0]);
        let p = turn.after(&shift).apply([0.0; 3]);
        assert!((p[0]).abs() < 1e-15 && (p[1] - 1.0).abs() < 1e-15, "{p:?}");
    }
}
