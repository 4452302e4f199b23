//! How a map is made: what is asked, checked against the bounds of the points.

use nearmiss_geometry::Aabb;
use serde::{Deserialize, Serialize};

use crate::error::SliceError;
use crate::layer::{BLOCKS, Layer, PART};
use crate::slice::Slice;
use crate::{Grid, Up};

/// Pixels of a slice, and slices, that can be told apart.
const MOST: f64 = 2_147_483_648.0;

/// However noisy points are, what spans more than this share of a slice is an obstacle.
pub(crate) const MOST_SHARE: f64 = 0.9;

/// Bytes that allocators take beside what a slice is given, in eight pieces: sixteen each, and as much lost
/// to rounding.
const ALLOCATIONS: usize = 8 * 32;

/// Most bytes that a slice of so many pixels takes while a map is built: what its voxels have seen, the image
/// made of that, its places in lists of slices, where each block of points begins in each of its parts, and
/// what the system adds.
fn bytes([width, height]: [u32; 2]) -> usize {
    let area = width as usize * height as usize;
    let lists = 2 * size_of::<Slice>() + 4 * size_of::<usize>();
    let blocks = 2 * BLOCKS * area.div_ceil(PART) * size_of::<u32>();
    Layer::bytes_of(area) + Slice::bytes_of(width, height) + lists + blocks + ALLOCATIONS
}

/// Bytes that it takes to make a slice of voxels on disk and to write it: the image, and what it is encoded
/// to.
fn bytes_on_disk([width, height]: [u32; 2]) -> usize {
    2 * Slice::bytes_of(width, height)
}

/// More slices than this are not made on disk: each takes two files.
const MOST_ON_DISK: f64 = 10_000.0;

/// How large a pixel is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Pixel {
    /// t, in the units of the points.
    Side(f64),
    /// So many pixels along the longer side of the bounds.
    Count(u32),
}

/// When a voxel is an obstacle: if the points in it span more than ε σ upwards.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Obstacle {
    /// ε itself. The paper has 0.07, which with σ = 3 t calls everything an obstacle that is steeper than
    /// 11.9°.
    Share(f64),
    /// ε = (t·tan θ + noise)/σ, so that what climbs along an axis at θ is still floor.
    Slope {
        /// θ, above 0 and below 90 degrees.
        degrees: f64,
        /// How far points of a level floor spread upwards within a pixel, in the units of the points;
        /// estimated from the points if not given. What is estimated makes ε no more than 0.9, however noisy
        /// the points: else walls would become floors
        /// ([`About::is_noise_capped`](crate::About::is_noise_capped) tells).
        noise: Option<f64>,
    },
}

/// How a map is made. Plain numbers, checked by [`SlicePlan::new`], and without points by
/// [`SliceOptions::check`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct SliceOptions {
    /// Size of a pixel. Default: 700 along the longer side, as in the paper.
    pub pixel: Pixel,
    /// σ; three times t if not given, as in the paper.
    pub slice_height: Option<f64>,
    /// What is an obstacle. Default: steeper than 45°, noise estimated.
    pub obstacle: Obstacle,
    /// Which way is up. Default: z.
    pub up: Up,
    /// The most bytes that building may take, refused beforehand if more are needed. Default: 4 GiB.
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
    /// The same options with this size of a pixel.
    #[must_use]
    pub const fn with_pixel(self, pixel: Pixel) -> Self {
        Self { pixel, ..self }
    }

    /// The same options with this height of a slice.
    #[must_use]
    pub const fn with_slice_height(self, slice_height: Option<f64>) -> Self {
        Self { slice_height, ..self }
    }

    /// The same options with this rule.
    #[must_use]
    pub const fn with_obstacle(self, obstacle: Obstacle) -> Self {
        Self { obstacle, ..self }
    }

    /// The same options with this direction upwards.
    #[must_use]
    pub const fn with_up(self, up: Up) -> Self {
        Self { up, ..self }
    }

    /// The same options with this many bytes allowed.
    #[must_use]
    pub const fn with_memory(self, memory: u64) -> Self {
        Self { memory, ..self }
    }

    /// Checks what makes no sense whatever the points: before they are read.
    ///
    /// # Errors
    /// Names the option.
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
                // t is not known yet, but that it is a third of σ, or more than nothing.
                (Pixel::Count(_), None) => rule.without_noise().check(1.0, self.height(1.0)),
                (Pixel::Count(_), Some(height)) => rule.check(0.0, height),
            },
        }
    }

    /// σ for this t.
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

    /// ε, where noise that was not given is this; it alone never makes ε more than [`MOST_SHARE`].
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

    /// The points of a voxel span less than σ.
    fn check(self, pixel: f64, slice_height: f64) -> Result<(), SliceError> {
        let share = self.share(pixel, slice_height, 0.0);
        if share < 1.0 { Ok(()) } else { Err(SliceError::NoObstacles { share }) }
    }
}

/// Options that make sense, and the lattice that they make over given bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlicePlan {
    grid: Grid,
    obstacle: Obstacle,
    /// How many slices may be made at a time.
    together: usize,
}

impl SlicePlan {
    /// Checks the options against the bounds of the points, in the caller's coordinates. Nothing is
    /// allocated.
    ///
    /// # Errors
    /// Names the option that makes no sense, or what of the bounds does not serve; says how many bytes are
    /// needed where more are than allowed.
    pub fn new(options: &SliceOptions, bounds: &Aabb) -> Result<Self, SliceError> {
        Self::of(options, bounds, false)
    }

    /// As [`Self::new`], for a builder whose voxels lie on disk ([`SliceBuilder::new_in`]), and whose slices
    /// are [written](crate::SliceTarget::build) as they are made: only a few of them have to fit into the
    /// bytes that are allowed.
    ///
    /// # Errors
    /// As [`Self::new`].
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
            // So much longer that the farthest point still lies in the last pixel.
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
            // Two of them, so that two cores are busy; the rest is for the pages of the voxels.
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

    /// The lattice.
    #[must_use]
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// The rule as it was asked for.
    #[must_use]
    pub fn obstacle(&self) -> Obstacle {
        self.obstacle
    }

    /// How many slices may be made at a time.
    pub(crate) fn together(&self) -> usize {
        self.together
    }

    /// ε, where noise that was not given is this.
    pub(crate) fn share(&self, estimated: f64) -> f64 {
        self.obstacle.share(self.grid.pixel, self.grid.slice_height, estimated)
    }
}
