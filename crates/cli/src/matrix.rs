//! Matrices as given by the user, and the reasons why one is not a pose.

use std::fmt;

use nearmiss::PoseError;

use crate::digits::short;

/// A 4×4 matrix, row-major.
pub(crate) type Matrix = [f64; 16];

/// The reason why a matrix is not a pose, displayed with a remedy and with few digits.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseRefused {
    /// The reason.
    pub cause: PoseError,
    /// `true` if the transpose has the form of a pose.
    pub is_transposed: bool,
    /// The length by which making a matrix a pose may move the object's bounds, in words.
    pub allowed: &'static str,
}

impl fmt::Display for PoseRefused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.cause {
            PoseError::NotAffine if self.is_transposed => f.write_str(
                "expected a last row of 0 0 0 1, got a last column of 0 0 0 1; transpose the matrix, which looks column-\
                 major",
            ),
            PoseError::NotAffine => f.write_str(
                "expected a last row of 0 0 0 1, got another one; give the matrix row-major, with the translation in \
                 the last column",
            ),
            PoseError::NotProper { determinant } => write!(
                f,
                "expected a positive determinant, got {}; give a rotation with uniform scale, without reflection",
                short(*determinant)
            ),
            PoseError::NotRigid { moved, tolerance } => write!(
                f,
                "expected a rotation with uniform scale, got a matrix whose nearest rotation moves the object's bounds \
                 by {}, more than {} ({}); give it with more digits, or as a quaternion",
                short(*moved),
                short(*tolerance),
                self.allowed
            ),
            cause => write!(f, "{cause}"),
        }
    }
}
