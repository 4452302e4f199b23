//! `FilterError`: the reasons why a filter refuses its parameters or its result.

use thiserror::Error;

/// A cloud needs at least as many points.
const LEAST_POINTS: usize = 8;

/// Why a cloud cannot be filtered.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum FilterError {
    /// A length or factor that is zero, negative, infinite or NaN.
    #[error("expected a positive finite {what}, got {value}")]
    NotPositive {
        /// The parameter.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// No neighbours asked for.
    #[error("expected at least 1 neighbour, got 0")]
    NoNeighbours,
    /// As many neighbours as points, or more.
    #[error("expected fewer neighbours than there are points ({points}), got {neighbours}; ask for fewer")]
    TooManyNeighbours {
        /// How many neighbours were asked for.
        neighbours: usize,
        /// How many points the cloud has.
        points: usize,
    },
    /// Voxels so small that 64 bits cannot number them.
    #[error(
        "expected a voxel size of at least {least:e}, got {size:e}; smaller cells at these coordinates \
         cannot be numbered with 64 bits"
    )]
    VoxelTooSmall {
        /// The size.
        size: f64,
        /// A size that is large enough.
        least: f64,
    },
    /// A box with a corner that is NaN.
    #[error("expected numbers as corners of the box, got NaN on axis {axis}")]
    BoxNotANumber {
        /// The first such axis, 0 to 2.
        axis: usize,
    },
    /// A box whose upper corner is below its lower one.
    #[error("expected min ≤ max on every axis of the box, got {min} to {max} on axis {axis}; swap them")]
    EmptyBox {
        /// The first such axis, 0 to 2.
        axis: usize,
        /// The lower corner there.
        min: f64,
        /// The upper corner there.
        max: f64,
    },
    /// Classes asked of points that have none.
    #[error("the points have no classes; only LAS, LAZ and tables with a column `class` have them")]
    NoClasses,
    /// So few points left that they make no cloud.
    #[error("expected at least 8 points to stay, got {left} of {points}; {remedy}")]
    TooFewLeft {
        /// How many points would stay.
        left: usize,
        /// How many points the cloud has.
        points: usize,
        /// What keeps more of them.
        remedy: &'static str,
    },
}

/// Returns `value` if it is positive and finite.
pub(crate) fn positive(what: &'static str, value: f64) -> Result<f64, FilterError> {
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err(FilterError::NotPositive { what, value }) }
}

/// Returns `kept` if it is enough for a cloud.
pub(crate) fn enough(kept: Vec<u32>, points: usize, remedy: &'static str) -> Result<Vec<u32>, FilterError> {
    let left = kept.len();
    if left < LEAST_POINTS { Err(FilterError::TooFewLeft { left, points, remedy }) } else { Ok(kept) }
}
