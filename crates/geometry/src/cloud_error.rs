//! Why points do not make a cloud.

use thiserror::Error;

/// Why points do not make a cloud.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum CloudError {
    /// A coordinate is NaN or infinite.
    #[error(
        "point {index} has a coordinate that is not finite; use `PointCloud::cleaned` to drop such points"
    )]
    NotFinite {
        /// Index of the first such point.
        index: usize,
    },
    /// A coordinate is so large that squared distances overflow.
    #[error("point {index} has a coordinate beyond ±1e150; scale the input down")]
    TooLarge {
        /// Index of the first such point.
        index: usize,
    },
    /// Too few distinct finite points.
    #[error("{distinct} distinct finite points of {given} given; at least 8 are needed")]
    TooFew {
        /// How many distinct finite points there are.
        distinct: usize,
        /// How many were given.
        given: usize,
    },
    /// More points than a 32-bit id can name.
    #[error("{given} points; at most 4294967295 can be told apart by a 32-bit id")]
    TooMany {
        /// How many were given.
        given: usize,
    },
    /// Attributes, as normals, that do not belong to the points given.
    #[error(
        "expected an attribute for each of {points} points, got {given}; give one for each point of the input"
    )]
    AttributeCount {
        /// How many attributes were given.
        given: usize,
        /// How many points the cloud was made from.
        points: usize,
    },
    /// An index that no point of the cloud has.
    #[error("expected indices below {points}, got {index}; use indices of the cloud, not of its input")]
    NoSuchPoint {
        /// The first such index.
        index: u32,
        /// How many points the cloud has.
        points: usize,
    },
    /// Indices out of order or repeated.
    #[error("expected ascending indices, got {index} after {before}; sort them and remove duplicates")]
    NotAscending {
        /// The first index that is out of order.
        index: u32,
        /// The index before it.
        before: u32,
    },
}
