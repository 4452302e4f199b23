//! Poses: 4×4 matrices, rotations with `as_matrix()`, and pairs of a rotation and a translation.

use nearmiss::{Aabb, Mesh, MeshHierarchy, PointHierarchy, Pose};
use numpy::{PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::arrays::{doubles, is_slice, wrong_shape};
use crate::failure::refused;

/// A row-major 4×4 matrix.
pub(crate) type Matrix = [f64; 16];

/// The share of the sampling radius by which making a matrix a pose may move the bounds of a scan, and
/// the share of their diagonal for a mesh: those of the command line.
const OF_RADIUS: f64 = 0.1;
const OF_DIAGONAL: f64 = 1e-4;

/// A thing that poses place.
pub(crate) trait Placeable: Sync {
    /// Returns the bounds in the frame of the input.
    fn bounds(&self) -> &Aabb;

    /// Returns the length by which making a matrix a pose may move the bounds.
    fn tolerance(&self) -> f64;
}

impl Placeable for PointHierarchy {
    fn bounds(&self) -> &Aabb {
        Self::bounds(self)
    }

    fn tolerance(&self) -> f64 {
        OF_RADIUS * self.sampling_radius()
    }
}

impl Placeable for MeshHierarchy {
    fn bounds(&self) -> &Aabb {
        Self::bounds(self)
    }

    fn tolerance(&self) -> f64 {
        let sum: f64 = Placeable::bounds(self).half_extents().iter().map(|half| half * half).sum();
        2.0 * OF_DIAGONAL * sum.sqrt()
    }
}

impl Placeable for Mesh {
    fn bounds(&self) -> &Aabb {
        MeshHierarchy::bounds(self)
    }

    fn tolerance(&self) -> f64 {
        MeshHierarchy::tolerance(self)
    }
}

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
            && is_slice(&*array)
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

    /// Returns the one pose of `thing`; fails for many.
    pub(crate) fn one(&self, thing: &(impl Placeable + ?Sized)) -> PyResult<Pose> {
        match self {
            Self::One(matrix) => pose_of(matrix, thing).map_err(refused),
            Self::Many(_) => Err(refused(
                "expected one pose of shape (4, 4) here, got an array of poses; ask once for each pose",
            )),
        }
    }

    /// Returns the one pose of a shape; fails for many.
    pub(crate) fn one_of_shape(&self) -> PyResult<Pose> {
        match self {
            Self::One(matrix) => Pose::from_matrix(matrix).map_err(refused),
            Self::Many(_) => {
                Err(refused("expected one pose of shape (4, 4) of a shape, got an array of poses"))
            }
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

/// Returns the pose that a matrix is for `thing`, as the command line does: the nearest rotation with
/// uniform scale, refused if that moves the bounds by more than their tolerance.
pub(crate) fn pose_of(
    matrix: &Matrix,
    thing: &(impl Placeable + ?Sized),
) -> Result<Pose, nearmiss::PoseError> {
    // Rounding alone never moves the bounds so far, and is tested in a tenth of the time.
    Pose::from_matrix(matrix).or_else(|_| {
        let [x, y, z] = [0, 1, 2].map(|i| [matrix[4 * i], matrix[4 * i + 1], matrix[4 * i + 2]]);
        let determinant = x[0] * (y[1] * z[2] - y[2] * z[1]) - x[1] * (y[0] * z[2] - y[2] * z[0])
            + x[2] * (y[0] * z[1] - y[1] * z[0]);
        let tolerance = thing.tolerance() * determinant.abs().cbrt();
        Pose::from_row_major(matrix, thing.bounds(), tolerance)
    })
}

/// Checks every matrix, so that a batch need not: an error names the first one that is not a pose.
pub(crate) fn check_each(matrices: &[Matrix], thing: &(impl Placeable + ?Sized)) -> PyResult<()> {
    for (index, matrix) in matrices.iter().enumerate() {
        if let Err(cause) = pose_of(matrix, thing) {
            return Err(refused(format!("pose {index}: {cause}")));
        }
    }
    Ok(())
}

/// Returns the one pose of each of two things.
pub(crate) fn both(
    [a, b]: [&dyn Placeable; 2],
    [pose_a, pose_b]: [Option<&Bound<'_, PyAny>>; 2],
) -> PyResult<[Pose; 2]> {
    Ok([Poses::new(pose_a)?.one(a)?, Poses::new(pose_b)?.one(b)?])
}

/// The poses of both things of a batch; one pose serves all.
pub(crate) struct PosePairs<'a> {
    matrices: [&'a [Matrix]; 2],
    things: [&'a dyn Placeable; 2],
    /// The pose of a thing that has one for all.
    fixed: [Option<Pose>; 2],
}

impl<'a> PosePairs<'a> {
    pub(crate) fn new(poses: &'a [Poses<'_>; 2], things: [&'a dyn Placeable; 2]) -> PyResult<Self> {
        let matrices = [poses[0].matrices()?, poses[1].matrices()?];
        let [a, b] = matrices.map(<[Matrix]>::len);
        if a != b && a != 1 && b != 1 {
            return Err(refused(format!(
                "expected as many poses of both, or one pose for all, got {a} and {b}"
            )));
        }
        let fixed = [0, 1].map(|side| match matrices[side] {
            [matrix] => pose_of(matrix, things[side]).ok(),
            _ => None,
        });
        Ok(Self { matrices, things, fixed })
    }

    pub(crate) fn len(&self) -> usize {
        let [a, b] = self.matrices.map(<[Matrix]>::len);
        if a == 1 { b } else { a }
    }

    /// The `i`-th poses; `None` if a matrix is no pose.
    pub(crate) fn at(&self, i: usize) -> Option<[Pose; 2]> {
        let pose = |side: usize| match self.matrices[side] {
            [_] => self.fixed[side],
            matrices => pose_of(&matrices[i], self.things[side]).ok(),
        };
        Some([pose(0)?, pose(1)?])
    }

    /// Returns the error of the first matrix that is no pose.
    pub(crate) fn fault(&self) -> PyErr {
        let checked = (0..2).try_for_each(|side| check_each(self.matrices[side], self.things[side]));
        checked.err().unwrap_or_else(|| refused("expected poses, got other matrices"))
    }
}
