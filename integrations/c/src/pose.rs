//! Poses and placed scans.

use std::mem::MaybeUninit;

use crate::handle::get;
use crate::pointer::{required, write};
use crate::scan::Scan;
use crate::status::{Failure, Status, guard};

/// A pose: world = scale · rotation · object + translation.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Pose {
    /// The position of the object's origin in the world.
    pub translation: [f64; 3],
    /// The rotation as a quaternion x, y, z, w of any length but 0.
    pub rotation: [f64; 4],
    /// The uniform scale, above 0.
    pub scale: f64,
}

/// A scan at a pose in the world.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Placed<'a> {
    /// The scan.
    pub scan: Option<&'a Scan>,
    /// Maps the frame of the scan's input to the world.
    pub pose: Pose,
}

impl Pose {
    /// Checks the numbers and returns the pose.
    #[inline(always)]
    pub(crate) fn checked(&self) -> Result<nearmiss::Pose, Failure> {
        let Self { translation: [x, y, z], rotation: [i, j, k, w], scale } = *self;
        // A sum is NaN or infinite if one of the numbers is.
        let is_finite = (x + y + z).is_finite();
        let length_sq = i * i + j * j + k * k + w * w;
        if is_finite && length_sq > 1e-200 && length_sq < 1e200 && scale > 0.0 && scale < 1e100 {
            Ok(nearmiss::Pose::new(self.translation, self.rotation).with_scale(scale))
        } else {
            Err(self.refused())
        }
    }

    #[cold]
    fn refused(&self) -> Failure {
        let Self { translation, rotation, scale } = self;
        Failure::argument(format_args!(
            "expected a finite translation, a quaternion other than 0 and a scale above 0, got {translation:?}, \
             {rotation:?} and {scale}"
        ))
    }
}

impl<'a> Placed<'a> {
    /// Returns the placed scan.
    #[inline(always)]
    pub(crate) fn at(&self) -> Result<nearmiss::Placed<'a>, Failure> {
        Ok(get(self.scan, "scan")?.at(&self.pose.checked()?))
    }
}

/// Returns the identity. Thread safety: any thread.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_pose_identity() -> Pose {
    Pose { translation: [0.0; 3], rotation: [0.0, 0.0, 0.0, 1.0], scale: 1.0 }
}

/// Makes the pose of a row-major 4×4 matrix, whose linear part is a rotation with uniform scale up to
/// the rounding of single precision. Thread safety: any thread.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_pose_from_matrix(
    matrix: Option<&[f64; 16]>,
    out: Option<&mut MaybeUninit<Pose>>,
) -> Status {
    guard(|| {
        let pose = nearmiss::Pose::from_matrix(required(matrix, "matrix")?).map_err(Failure::argument)?;
        let rotation = nearmiss::geometry::nalgebra::Rotation3::from_matrix_unchecked(*pose.rotation());
        let turn = nearmiss::geometry::nalgebra::UnitQuaternion::from_rotation_matrix(&rotation);
        let rotation = turn.coords.into();
        write(out, Pose { translation: pose.translation(), rotation, scale: pose.scale() })
    })
}
