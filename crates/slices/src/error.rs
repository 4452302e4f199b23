//! Errors of building a map.

use nearmiss_geometry::Aabb;
use nearmiss_store::WorkError;
use thiserror::Error;

use crate::Up;

/// The reason why no map can be made of these points with these options.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SliceError {
    /// The bounds are empty, not finite, or their extent is not finite.
    #[error(
        "expected at least two finite points at a finite distance, got bounds {}; remove points that are not finite \
         or far off",
        corners(bounds)
    )]
    Bounds {
        /// The given value.
        bounds: Aabb,
    },
    /// All points have the same height.
    #[error("expected points at different heights, got no extent along {up}; name the axis that points up")]
    Flat {
        /// The axis that points up.
        up: Up,
    },
    /// All points are on one vertical line.
    #[error(
        "expected points with an extent across {up}, got a single vertical line; give the side of a pixel instead of \
         a number of pixels"
    )]
    NoWidth {
        /// The axis that points up.
        up: Up,
    },
    /// The side of a pixel is not positive, or makes the height of a slice infinite.
    #[error("expected a pixel side above 0 that leaves the height of a slice finite, got {side:?}")]
    Pixel {
        /// The given value.
        side: f64,
    },
    /// The number of pixels along the longer side is 0.
    #[error("expected at least 1 pixel along the longer side, got 0")]
    NoPixels,
    /// The height of a slice is not positive and finite.
    #[error("expected a finite slice height above 0, got {height:?}")]
    SliceHeight {
        /// The given value.
        height: f64,
    },
    /// A slice would have too many pixels.
    #[error(
        "expected at most 2^31 pixels in a slice, got {pixels:.1e} of side {side:?} (points {}); give larger pixels, or \
         remove points that are far off",
        corners(bounds)
    )]
    TooManyPixels {
        /// The number of pixels.
        pixels: f64,
        /// The side of a pixel.
        side: f64,
        /// The bounds of the points.
        bounds: Aabb,
    },
    /// The map needs more memory than allowed, or more slices than supported.
    #[error(
        "expected to build the map in at most {} MiB, got {} slices of {} × {} pixels that take {} MiB (points {}); give larger \
         pixels or higher slices, remove points that are far off, or allow more memory",
        allowed >> 20, whole(*slices), pixels[0], pixels[1], whole((bytes / 1_048_576.0).ceil()), corners(bounds)
    )]
    Memory {
        /// The number of slices.
        slices: f64,
        /// Columns and rows of a slice.
        pixels: [u32; 2],
        /// The bytes needed.
        bytes: f64,
        /// The bytes allowed.
        allowed: u64,
        /// The bounds of the points.
        bounds: Aabb,
    },
    /// Memory cannot be allocated, or the work folder fails.
    #[error(transparent)]
    Work(#[from] WorkError),
    /// The obstacle share is not positive.
    #[error("expected an obstacle share above 0, got {share:?}")]
    Share {
        /// The given value.
        share: f64,
    },
    /// The slope is not between 0 and 90 degrees.
    #[error("expected a slope above 0 and below 90 degrees, got {degrees:?}")]
    Slope {
        /// The given value.
        degrees: f64,
    },
    /// The noise is negative or not finite.
    #[error("expected a finite noise of at least 0, got {noise:?}")]
    Noise {
        /// The given value.
        noise: f64,
    },
    /// The rule would make even walls floor.
    #[error(
        "expected an obstacle share below 1, got {} (no wall spans that much of a slice); give higher slices, a \
         lesser slope or less noise", short(*share)
    )]
    NoObstacles {
        /// ε.
        share: f64,
    },
}

/// The corners of the bounds, which reveal a point far off.
fn corners(Aabb { min, max }: &Aabb) -> String {
    format!("from {min:?} to {max:?}")
}

/// Formats a whole number, in scientific notation from 1e15.
fn whole(x: f64) -> String {
    if x.abs() < 1e15 { format!("{x:.0}") } else { format!("{x:.1e}") }
}

/// Formats a number with two decimals, in scientific notation from 1e15.
fn short(x: f64) -> String {
    if x.abs() < 1e15 { format!("{x:.2}") } else { format!("{x:.1e}") }
}
