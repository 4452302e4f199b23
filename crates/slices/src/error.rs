//! Why no map is made.

use nearmiss_geometry::Aabb;
use nearmiss_store::WorkError;
use thiserror::Error;

use crate::Up;

/// Why no map is made of these points with these options.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SliceError {
    /// Bounds of no points, with coordinates that are not finite, or so far apart that their distance is not.
    #[error(
        "the bounds, {}, have no finite extent; give at least two points, all finite, and none too far away",
        corners(bounds)
    )]
    Bounds {
        /// As given.
        bounds: Aabb,
    },
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
    /// A side that is none, or whose height of a slice by default, three times as much, is none.
    #[error("a pixel of side {side:?} is none; give a length above 0, and not near the greatest number")]
    Pixel {
        /// As given.
        side: f64,
    },
    /// No pixels at all.
    #[error("0 pixels along the longer side are none; give at least 1")]
    NoPixels,
    /// A height that is none.
    #[error("a slice of height {height:?} is none; give a length above 0")]
    SliceHeight {
        /// As given.
        height: f64,
    },
    /// More pixels in a slice than can be told apart.
    #[error(
        "a slice would have {pixels:.1e} pixels of side {side:?}, more than 2^31; the points reach {}: give larger pixels, or \
         leave out points that lie far off",
        corners(bounds)
    )]
    TooManyPixels {
        /// How many.
        pixels: f64,
        /// Their side.
        side: f64,
        /// Of the points.
        bounds: Aabb,
    },
    /// More memory than allowed.
    #[error(
        "{} slices of {} × {} pixels would take {} MiB while they are built, {} are allowed; the points reach {}: give larger \
         pixels, higher slices, leave out points that lie far off, or allow more memory",
        whole(*slices), pixels[0], pixels[1], whole((bytes / 1_048_576.0).ceil()), allowed >> 20, corners(bounds)
    )]
    Memory {
        /// How many slices were asked for.
        slices: f64,
        /// Of each, its columns and rows.
        pixels: [u32; 2],
        /// How much.
        bytes: f64,
        /// The option.
        allowed: u64,
        /// Of the points.
        bounds: Aabb,
    },
    /// Memory that the system does not give, or a folder that fails.
    #[error(transparent)]
    Work(#[from] WorkError),
    /// No share of a slice's height.
    #[error("an obstacle share of {share:?} is none; give a number above 0")]
    Share {
        /// As given.
        share: f64,
    },
    /// No slope.
    #[error("a slope of {degrees:?} degrees divides nothing; give one above 0 and below 90")]
    Slope {
        /// As given.
        degrees: f64,
    },
    /// No noise.
    #[error("noise of {noise:?} is none; give a length of at least 0")]
    Noise {
        /// As given.
        noise: f64,
    },
    /// A rule by which even walls are floors.
    #[error(
        "points would have to span {} of a slice's height to be an obstacle, which no wall does; give higher \
         slices, a lesser slope or less noise", short(*share)
    )]
    NoObstacles {
        /// ε.
        share: f64,
    },
}

/// So that a point far off is seen.
fn corners(Aabb { min, max }: &Aabb) -> String {
    format!("from {min:?} to {max:?}")
}

/// A whole number, by its power of ten where nobody would count digits.
fn whole(x: f64) -> String {
    if x.abs() < 1e15 { format!("{x:.0}") } else { format!("{x:.1e}") }
}

/// A number with two decimals, as [`whole`].
fn short(x: f64) -> String {
    if x.abs() < 1e15 { format!("{x:.2}") } else { format!("{x:.1e}") }
}
