//! Poses: 4×4 matrices, rotations with `as_matrix()`, and pairs of a rotation and a translation.

use nearmiss::{Pose, Scan};
use numpy::{PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::arrays::{doubles, wrong_shape};
use crate::failure::refused;

/// A row-major 4×4 matrix.
pub(crate) type Matrix = [f64; 16];

/// The share of the sampling radius by which making a matrix a pose may move the bounds of a scan.
const TOLERANCE: f64 = 0.1;

/// One pose or many.
pub(crate) enum Poses<'py> {
    One(Matrix),
    Many(PyReadonlyArrayDyn<'py, f64>),
}

/// The forms of poses, in errors.
const EXPECTED: &str = "a pose of shape (4, 4), poses of shape (N, 4, 4), a rotation with as_matrix(), or a pair (rotation, translation)";

const IDENTITY: Matrix = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];

impl<'py> Poses<'py> {
    /// Reads one pose or many; the identity for `None`.
    pub(crate) fn new(given: Option<&Bound<'py, PyAny>>) -> PyResult<Self> {
        let Some(given) = given else { return Ok(Self::One(IDENTITY)) };
        if let Ok(array) = given.extract::<PyReadonlyArrayDyn<'py, f64>>()
            && array.is_c_contiguous()
            && array.shape().ends_with(&[4, 4])
        {
            return Self::of(array, given);
        }
        // Rotations and pairs are put together in Python.
        let py = given.py();
        let made = py.import("nearmiss._poses")?.call_method1("matrices", (given,))?;
        Self::of(doubles(&made, EXPECTED)?, given)
    }

    fn of(array: PyReadonlyArrayDyn<'py, f64>, given: &Bound<'py, PyAny>) -> PyResult<Self> {
        match array.shape() {
            [4, 4] => {
                let numbers = array.as_slice().map_err(refused)?;
                Ok(Self::One(<Matrix>::try_from(numbers).map_err(refused)?))
            }
            [_, 4, 4] => Ok(Self::Many(array)),
            _ => Err(wrong_shape(EXPECTED, given)),
        }
    }

    /// Returns the one pose of `scan`; fails for many.
    pub(crate) fn one(&self, scan: &Scan) -> PyResult<Pose> {
        match self {
            Self::One(matrix) => pose_of(matrix, scan).map_err(refused),
            Self::Many(_) => Err(refused(
                "expected one pose of shape (4, 4) here, got an array of poses; ask once for each pose",
            )),
        }
    }

    /// Returns all matrices; those of many poses are not copied.
    pub(crate) fn matrices(&self) -> PyResult<&[Matrix]> {
        match self {
            Self::One(matrix) => Ok(std::slice::from_ref(matrix)),
            Self::Many(array) => Ok(array.as_slice().map_err(refused)?.as_chunks::<16>().0),
        }
    }
}

/// Returns the pose that a matrix is for `scan`, as the command line does: the nearest rotation with
/// uniform scale, refused if that moves the bounds of the scan by more than a tenth of its sampling
/// radius.
pub(crate) fn pose_of(matrix: &Matrix, scan: &Scan) -> Result<Pose, nearmiss::PoseError> {
    // Rounding alone never moves the bounds so far, and is tested in a tenth of the time.
    Pose::from_matrix(matrix).or_else(|_| {
        let [x, y, z] = [0, 1, 2].map(|i| [matrix[4 * i], matrix[4 * i + 1], matrix[4 * i + 2]]);
        let determinant = x[0] * (y[1] * z[2] - y[2] * z[1]) - x[1] * (y[0] * z[2] - y[2] * z[0])
            + x[2] * (y[0] * z[1] - y[1] * z[0]);
        let tolerance = TOLERANCE * scan.sampling_radius() * determinant.abs().cbrt();
        Pose::from_row_major(matrix, scan.bounds(), tolerance)
    })
}

/// Checks every matrix, so that a batch need not: an error names the first one that is not a pose.
pub(crate) fn check_each(matrices: &[Matrix], scan: &Scan) -> PyResult<()> {
    for (index, matrix) in matrices.iter().enumerate() {
        if let Err(cause) = pose_of(matrix, scan) {
            return Err(refused(format!("pose {index}: {cause}")));
        }
    }
    Ok(())
}
