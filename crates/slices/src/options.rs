//! Options of a map, checked against the bounds of the points.

use nearmiss_geometry::Aabb;
use serde::{Deserialize, Serialize};

use crate::error::SliceError;
use crate::layer::{BLOCKS, Layer, PART};
use crate::slice::Slice;
use crate::{Grid, Up};

/// Greatest number of pixels of a slice, and of slices.
const MOST: f64 = 2_147_483_648.0;

/// Limit of ε with estimated noise; the slope alone may exceed it.
pub(crate) const MOST_SHARE: f64 = 0.9;

/// Overhead of the allocator for the eight allocations of a slice: sixteen bytes each, and as much
/// lost to rounding.
const ALLOCATIONS: usize = 8 * 32;

/// Returns the greatest number of bytes that a slice of this size needs while a map is built: its
/// voxels, its image, its places in lists of slices, the start of each block of points in each of
/// its parts, and the overhead of the allocator.
fn bytes([width, height]: [u32; 2]) -> usize {
    let area = width as usize * height as usize;
    let lists = 2 * size_of::<Slice>() + 4 * size_of::<usize>();
    let blocks = 2 * BLOCKS * area.div_ceil(PART) * size_of::<u32>();
    Layer::bytes_of(area) + Slice::bytes_of(width, height) + lists + blocks + ALLOCATIONS
}

/// Returns the bytes that are needed to make and write a slice whose voxels are on disk: the image
/// and its encoding.
fn bytes_on_disk([width, height]: [u32; 2]) -> usize {
    2 * Slice::bytes_of(width, height)
}

/// Greatest number of slices on disk; each takes two files.
const MOST_ON_DISK: f64 = 10_000.0;

/// The size of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Pixel {
    /// t, in the units of the points.
    Side(f64),
    /// Number of pixels along the longer side of the bounds.
    Count(u32),
}

/// The rule for obstacles: a voxel is one if its points span more than ε σ upwards.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Obstacle {
    /// ε itself. The value of Anjos et al. 2012 is 0.07, which with σ = 3 t makes everything
    /// steeper than 11.9° an obstacle.
    Share(f64),
    /// ε = (t·tan θ + noise)/σ, so that a surface with slope θ along an axis is still floor.
    Slope {
        /// θ, above 0 and below 90 degrees.
        degrees: f64,
        /// Height that the points of a level floor span within a pixel, in the units of the points;
        /// estimated from the points if `None`. Estimated noise never makes ε more than 0.9, since
        /// otherwise walls would become floors
        /// ([`About::is_noise_capped`](crate::About::is_noise_capped)).
        noise: Option<f64>,
    },
}

/// Options of a map. Plain numbers, checked by [`SlicePlan::new`], or without points by
/// [`SliceOptions::check`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct SliceOptions {
    /// Size of a pixel. Default: 700 along the longer side, as in Anjos et al. 2012.
    pub pixel: Pixel,
    /// σ, the height of a slice; `None` for three times t, as in Anjos et al. 2012.
    pub slice_height: Option<f64>,
    /// The rule for obstacles. Default: steeper than 45°, noise estimated.
    pub obstacle: Obstacle,
    /// The axis that points up. Default: z.
    pub up: Up,
    /// Greatest number of bytes for building; options that need more are rejected beforehand.
    /// Default: 4 GiB.
    pub memory: u64,
}

impl Default for SliceOptions {
    fn default() -> Self {
        Self {
            pixel: Pixel::Count(700),
            slice_height: None,
            obstacle: Obstacle::Slope { degrees: 45.0, noise: None },
            up: Up::Z,
            memory: 4 << 30,
        }
    }
}

impl SliceOptions {
    /// Sets the size of a pixel.
    #[must_use]
    pub const fn with_pixel(self, pixel: Pixel) -> Self {
        Self { pixel, ..self }
    }

    /// Sets the height of a slice.
    #[must_use]
    pub const fn with_slice_height(self, slice_height: Option<f64>) -> Self {
        Self { slice_height, ..self }
    }

    /// Sets the rule for obstacles.
    #[must_use]
    pub const fn with_obstacle(self, obstacle: Obstacle) -> Self {
        Self { obstacle, ..self }
    }

    /// Sets the axis that points up.
    #[must_use]
    pub const fn with_up(self, up: Up) -> Self {
        Self { up, ..self }
    }

    /// Sets the number of allowed bytes.
    #[must_use]
    pub const fn with_memory(self, memory: u64) -> Self {
        Self { memory, ..self }
    }

    /// Checks everything that does not depend on the points, so that errors show before the points
    /// are read.
    ///
    /// # Errors
    /// If an option is invalid; the error names it.
    pub fn check(&self) -> Result<(), SliceError> {
        match self.pixel {
            Pixel::Side(t) if !(t > 0.0 && self.height(t).is_finite()) => {
                return Err(SliceError::Pixel { side: t });
            }
            Pixel::Count(0) => return Err(SliceError::NoPixels),
            _ => {}
        }
        match self.slice_height {
            Some(height) if !(height > 0.0 && height.is_finite()) => {
                return Err(SliceError::SliceHeight { height });
            }
            _ => {}
        }
        match self.obstacle {
            Obstacle::Share(share) if share.is_nan() || share <= 0.0 => Err(SliceError::Share { share }),
            Obstacle::Slope { degrees, .. } if !(degrees > 0.0 && degrees < 90.0) => {
                Err(SliceError::Slope { degrees })
            }
            Obstacle::Slope { noise: Some(noise), .. } if !(noise >= 0.0 && noise.is_finite()) => {
                Err(SliceError::Noise { noise })
            }
            rule => match (self.pixel, self.slice_height) {
                (Pixel::Side(t), _) => rule.check(t, self.height(t)),
                // t is not known yet: it is a third of σ, or just positive.
                (Pixel::Count(_), None) => rule.without_noise().check(1.0, self.height(1.0)),
                (Pixel::Count(_), Some(height)) => rule.check(0.0, height),
            },
        }
    }

    /// Returns σ for this t.
    fn height(&self, pixel: f64) -> f64 {
        self.slice_height.unwrap_or(3.0 * pixel)
    }
}

impl Obstacle {
    fn without_noise(self) -> Self {
        match self {
            Self::Slope { degrees, .. } => Self::Slope { degrees, noise: None },
            Self::Share(_) => self,
        }
    }

    /// Returns ε, with `estimated` for noise that was not given. Estimated noise alone never makes
    /// ε more than [`MOST_SHARE`].
    fn share(self, pixel: f64, slice_height: f64, estimated: f64) -> f64 {
        match self {
            Self::Share(share) => share,
            Self::Slope { degrees, noise } => {
                let rise = pixel * degrees.to_radians().tan();
                let share = |noise: f64| (rise + noise) / slice_height;
                noise.map_or_else(|| share(estimated).min(MOST_SHARE.max(share(0.0))), share)
            }
        }
    }

    /// Checks that ε is below 1: the points of a voxel span less than σ.
    fn check(self, pixel: f64, slice_height: f64) -> Result<(), SliceError> {
        let share = self.share(pixel, slice_height, 0.0);
        if share < 1.0 { Ok(()) } else { Err(SliceError::NoObstacles { share }) }
    }
}

/// Validated options, and the lattice that they give for the bounds of the points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlicePlan {
    grid: Grid,
    obstacle: Obstacle,
    /// Number of slices that may be made at a time.
    together: usize,
}

impl SlicePlan {
    /// Checks the options against the bounds of the points, in the caller's coordinates, without
    /// allocating.
    ///
    /// # Errors
    /// If an option is invalid, the bounds are invalid, or more bytes are needed than allowed; the
    /// error names the option or the bounds, and the bytes.
    pub fn new(options: &SliceOptions, bounds: &Aabb) -> Result<Self, SliceError> {
        Self::of(options, bounds, false)
    }

    /// Checks like [`Self::new`], for a builder whose voxels are on disk ([`SliceBuilder::new_in`])
    /// and whose slices are [written](crate::SliceTarget::build) as they are made. Only a few of
    /// the slices must fit into the allowed bytes.
    ///
    /// # Errors
    /// As for [`Self::new`].
    ///
    /// [`SliceBuilder::new_in`]: crate::SliceBuilder::new_in
    pub fn on_disk(options: &SliceOptions, bounds: &Aabb) -> Result<Self, SliceError> {
        Self::of(options, bounds, true)
    }

    fn of(options: &SliceOptions, bounds: &Aabb, on_disk: bool) -> Result<Self, SliceError> {
        options.check()?;
        let up = options.up;
        let turned = [bounds.min, bounds.max].map(|corner| up.to_map(corner));
        let Aabb { min, max } = Aabb::of(turned);
        let extent = [0, 1, 2].map(|k| max[k] - min[k]);
        if !extent.iter().all(|e| e.is_finite()) {
            return Err(SliceError::Bounds { bounds: *bounds });
        }
        if extent[2] <= 0.0 {
            return Err(SliceError::Flat { up });
        }
        let pixel = match options.pixel {
            Pixel::Side(t) => t,
            // Slightly longer, so that the farthest point is within the last pixel.
            Pixel::Count(n) => extent[0].max(extent[1]) / f64::from(n) * (1.0 + 1e-9),
        };
        if pixel <= 0.0 {
            return Err(SliceError::NoWidth { up });
        }
        let slice_height = options.height(pixel);
        if !slice_height.is_finite() {
            return Err(SliceError::Bounds { bounds: *bounds });
        }
        let sizes = [pixel, pixel, slice_height];
        let counts = [0, 1, 2].map(|k| (extent[k] / sizes[k]).floor() + 1.0);
        let pixels = counts[0] * counts[1];
        if pixels > MOST {
            return Err(SliceError::TooManyPixels { pixels, side: pixel, bounds: *bounds });
        }
        let slices = counts[2];
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "whole and at most 2^31; slices saturate, and are then too many"
        )]
        let counts = counts.map(|n| n as u32);
        let [width, height, _] = counts;
        #[expect(clippy::cast_precision_loss, reason = "a limit of memory needs no more digits")]
        let (bytes, allowed, most) = if on_disk {
            // Two slices, so that two cores are busy; the rest is for the pages of the voxels.
            (4.0 * bytes_on_disk([width, height]) as f64, options.memory as f64, MOST_ON_DISK)
        } else {
            (slices * bytes([width, height]) as f64, options.memory as f64, MOST)
        };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the cast saturates")]
        let together = if on_disk { (2.0 * allowed / bytes) as usize } else { usize::MAX };
        if bytes > allowed || slices > most {
            return Err(SliceError::Memory {
                slices,
                pixels: [width, height],
                bytes,
                allowed: options.memory,
                bounds: *bounds,
            });
        }
        options.obstacle.check(pixel, slice_height)?;
        let grid = Grid { up, origin: min, pixel, slice_height, counts };
        Ok(Self { grid, obstacle: options.obstacle, together })
    }

    /// Returns the lattice.
    #[must_use]
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Returns the rule as given.
    #[must_use]
    pub fn obstacle(&self) -> Obstacle {
        self.obstacle
    }

    /// Number of slices that may be made at a time.
    pub(crate) fn together(&self) -> usize {
        self.together
    }

    /// Returns ε, with `estimated` for noise that was not given.
    pub(crate) fn share(&self, estimated: f64) -> f64 {
        self.obstacle.share(self.grid.pixel, self.grid.slice_height, estimated)
    }
}
