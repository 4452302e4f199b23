//! `CloudError`: the reasons why points are rejected as a cloud.

use thiserror::Error;

/// Error of building or changing a [`PointCloud`](crate::PointCloud).
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum CloudError {
    /// A coordinate is NaN or infinite.
    #[error(
        "expected finite coordinates, got NaN or infinity (point {index}); drop such points with `PointCloud::cleaned`"
    )]
    NotFinite {
        /// Index of the first such point.
        index: usize,
    },
    /// A coordinate is so large that squared distances overflow.
    #[error("expected coordinates within ±1e150, got a larger one (point {index}); scale the input down")]
    TooLarge {
        /// Index of the first such point.
        index: usize,
    },
    /// Too few distinct finite points.
    #[error(
        "expected at least 8 distinct finite points, got {distinct} (of {given} given); give more points, or sample the \
         surface of a mesh"
    )]
    TooFew {
        /// Number of distinct finite points.
        distinct: usize,
        /// Number of points given.
        given: usize,
    },
    /// More points than a 32-bit id can number.
    #[error("expected at most 4294967295 points, got {given}; split the input or thin it out")]
    TooMany {
        /// Number of points given.
        given: usize,
    },
    /// Attributes, such as normals, whose number differs from the number of points given.
    #[error(
        "expected an attribute for each of {points} points, got {given}; give one for each point of the input"
    )]
    AttributeCount {
        /// Number of attributes given.
        given: usize,
        /// Number of points in the cloud's input.
        points: usize,
    },
    /// An index out of range.
    #[error("expected indices below {points}, got {index}; use indices of the cloud, not of its input")]
    NoSuchPoint {
        /// The first index out of range.
        index: u32,
        /// Number of points in the cloud.
        points: usize,
    },
    /// Indices that are out of order or repeated.
    #[error("expected ascending indices, got {index} after {before}; sort them and remove duplicates")]
    NotAscending {
        /// The first index that is out of order.
        index: u32,
        /// The index before it.
        before: u32,
    },
}
