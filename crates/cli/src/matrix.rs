//! Matrices as given, and why they are no poses.

use std::fmt;

use nearmiss::PoseError;

use crate::digits::short;

/// A matrix as given, row-major.
pub(crate) type Matrix = [f64; 16];

/// Why a matrix is no pose; displayed with few digits.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseRefused {
    /// Why not.
    pub cause: PoseError,
    /// Whether its transpose has the form of a pose.
    pub is_transposed: bool,
}

impl fmt::Display for PoseRefused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.cause {
            PoseError::NotAffine if self.is_transposed => {
                f.write_str("the last row of the pose is not 0 0 0 1; it looks column-major; transpose it")
            }
            PoseError::NotProper { determinant } => write!(
                f,
                "the pose has determinant {}; a rotation with uniform scale has a positive one",
                short(*determinant)
            ),
            PoseError::NotRigid { moved, tolerance } => write!(
                f,
                "the pose is not a rotation with uniform scale: the nearest one moves the object's bounds by {}, \
                 more than {} (a tenth of the sampling radius)",
                short(*moved),
                short(*tolerance)
            ),
            cause => write!(f, "{cause}"),
        }
    }
}
