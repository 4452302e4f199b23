//! Why no map is made.

use thiserror::Error;

use crate::Up;

/// Why no map is made of these points with these options.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SliceError {
    /// Bounds of no points, or with coordinates that are not finite.
    #[error("the bounds are not finite; give at least two points, all finite")]
    Bounds,
    /// All points at one height.
    #[error("the points have no extent along {up}; name the axis that points up")]
    Flat {
        /// The direction upwards.
        up: Up,
    },
    /// All points on one upright line.
    #[error(
        "the points have no extent across {up}, so a number of pixels gives no size; give a pixel's side"
    )]
    NoWidth {
        /// The direction upwards.
        up: Up,
    },
    /// A side that is none.
    #[error("a pixel of side {side} is none; give a length above 0")]
    Pixel {
        /// As given.
        side: f64,
    },
    /// No pixels at all.
    #[error("0 pixels along the longer side are none; give at least 1")]
    NoPixels,
    /// A height that is none.
    #[error("a slice of height {height} is none; give a length above 0")]
    SliceHeight {
        /// As given.
        height: f64,
    },
    /// More pixels in a slice than can be told apart.
    #[error("a slice would have {pixels:e} pixels of side {side}, more than 2^31; give larger pixels")]
    TooManyPixels {
        /// How many.
        pixels: f64,
        /// Their side.
        side: f64,
    },
    /// More memory than allowed.
    #[error(
        "the map would take {:.0} MiB while it is built, {} are allowed; give larger pixels or allow more",
        bytes / 1_048_576.0, allowed >> 20
    )]
    Memory {
        /// How much.
        bytes: f64,
        /// The option.
        allowed: u64,
    },
    /// Memory that the system does not give.
    #[error("the system gives no {bytes} bytes for a slice; give larger pixels")]
    OutOfMemory {
        /// How many were asked for.
        bytes: usize,
    },
    /// No share of a slice's height.
    #[error("an obstacle share of {share} is none; give a number above 0")]
    Share {
        /// As given.
        share: f64,
    },
    /// No slope.
    #[error("a slope of {degrees} degrees divides nothing; give one above 0 and below 90")]
    Slope {
        /// As given.
        degrees: f64,
    },
    /// No noise.
    #[error("noise of {noise} is none; give a length of at least 0")]
    Noise {
        /// As given.
        noise: f64,
    },
    /// A rule by which even walls are floors.
    #[error(
        "points would have to span {share:.2} of a slice's height to be an obstacle, which no wall does; give higher \
         slices, a lesser slope or less noise"
    )]
    NoObstacles {
        /// ε.
        share: f64,
    },
}
