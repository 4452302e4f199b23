//! `FilterError`: the reasons why a filter rejects its parameters or its result.

use thiserror::Error;

/// Least number of points in a cloud.
const LEAST_POINTS: usize = 8;

/// Error of a filter.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum FilterError {
    /// A length or factor that is zero, negative, infinite or NaN.
    #[error("expected a positive finite {what}, got {value}")]
    NotPositive {
        /// Name of the parameter.
        what: &'static str,
        /// Value of the parameter.
        value: f64,
    },
    /// A neighbour count of 0.
    #[error("expected at least 1 neighbour, got 0")]
    NoNeighbours,
    /// A neighbour count that is not below the number of points.
    #[error("expected fewer neighbours than there are points ({points}), got {neighbours}; ask for fewer")]
    TooManyNeighbours {
        /// Number of neighbours requested.
        neighbours: usize,
        /// Number of points in the cloud.
        points: usize,
    },
    /// A voxel size so small that 64 bits cannot number the cells.
    #[error(
        "expected a voxel size of at least {least:e}, got {size:e} (64 bits cannot number smaller cells at \
         these coordinates); use a larger size"
    )]
    VoxelTooSmall {
        /// The voxel size given.
        size: f64,
        /// A voxel size that is large enough.
        least: f64,
    },
    /// A box with a corner that is NaN.
    #[error("expected box corners without NaN, got NaN (axis {axis})")]
    BoxNotANumber {
        /// The first such axis, 0 to 2.
        axis: usize,
    },
    /// A box with `min` above `max`.
    #[error("expected min ≤ max on every axis of the box, got {min} to {max} (axis {axis}); swap them")]
    EmptyBox {
        /// The first such axis, 0 to 2.
        axis: usize,
        /// The lower corner there.
        min: f64,
        /// The upper corner there.
        max: f64,
    },
    /// A filter by class on points without classes.
    #[error(
        "expected points with classes, got points without; read them from LAS, LAZ or a table with a column `class`"
    )]
    NoClasses,
    /// Too few points left for a cloud.
    #[error("expected at least 8 points to remain, got {left} of {points}; {remedy}")]
    TooFewLeft {
        /// Number of points that would stay.
        left: usize,
        /// Number of points in the cloud.
        points: usize,
        /// Advice that keeps more points.
        remedy: &'static str,
    },
}

/// Returns `value` if it is positive and finite.
pub(crate) fn positive(what: &'static str, value: f64) -> Result<f64, FilterError> {
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err(FilterError::NotPositive { what, value }) }
}

/// Returns `kept` if it holds enough points for a cloud.
pub(crate) fn enough(kept: Vec<u32>, points: usize, remedy: &'static str) -> Result<Vec<u32>, FilterError> {
    let left = kept.len();
    if left < LEAST_POINTS { Err(FilterError::TooFewLeft { left, points, remedy }) } else { Ok(kept) }
}
