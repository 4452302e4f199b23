//! How a map is made: what is asked, checked against the bounds of the points.

use nearmiss_geometry::Aabb;
use serde::{Deserialize, Serialize};

use crate::error::SliceError;
use crate::{Grid, Up};

/// Pixels of a slice that can be told apart.
const MOST_PIXELS: f64 = 2_147_483_648.0;

/// Bytes a voxel takes while a map is built, lowest and highest level (2), and when it is done, the same in fewer steps and two
/// flags (1¾).
const BYTES: f64 = 3.75;

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
    /// ε itself. The paper has 0.07, which with σ = 3 t calls everything an obstacle that is steeper than 11.9°.
    Share(f64),
    /// ε = (t·tan θ + noise)/σ, so that what climbs along an axis at θ is still floor.
    Slope {
        /// θ, above 0 and below 90 degrees.
        degrees: f64,
        /// How far points of a level floor spread upwards within a pixel, in the units of the points; estimated from the
        /// points if not given.
        noise: Option<f64>,
    },
}

/// How a map is made. Plain numbers, checked by [`SlicePlan::new`].
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
}

/// Options that make sense, and the lattice that they make over given bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlicePlan {
    grid: Grid,
    obstacle: Obstacle,
}

impl SlicePlan {
    /// Checks the options against the bounds of the points, in the caller's coordinates. Nothing is allocated.
    ///
    /// # Errors
    /// Names the option that makes no sense, or what of the bounds does not serve; says how many bytes are needed where more
    /// are than allowed.
    pub fn new(options: &SliceOptions, bounds: &Aabb) -> Result<Self, SliceError> {
        let up = options.up;
        let turned = [bounds.min, bounds.max].map(|corner| up.to_map(corner));
        let Aabb { min, max } = Aabb::of(turned);
        let extent = [0, 1, 2].map(|k| max[k] - min[k]);
        if !extent.iter().all(|e| e.is_finite()) {
            return Err(SliceError::Bounds);
        }
        if extent[2] <= 0.0 {
            return Err(SliceError::Flat { up });
        }
        let pixel = match options.pixel {
            Pixel::Side(t) if t > 0.0 && t.is_finite() => t,
            Pixel::Side(t) => return Err(SliceError::Pixel { side: t }),
            Pixel::Count(0) => return Err(SliceError::NoPixels),
            // So much longer that the farthest point still lies in the last pixel.
            Pixel::Count(n) => extent[0].max(extent[1]) / f64::from(n) * (1.0 + 1e-9),
        };
        if pixel <= 0.0 {
            return Err(SliceError::NoWidth { up });
        }
        let slice_height = options.slice_height.unwrap_or(3.0 * pixel);
        if !(slice_height > 0.0 && slice_height.is_finite()) {
            return Err(SliceError::SliceHeight { height: slice_height });
        }
        let sizes = [pixel, pixel, slice_height];
        let counts = [0, 1, 2].map(|k| (extent[k] / sizes[k]).floor() + 1.0);
        let pixels = counts[0] * counts[1];
        if pixels > MOST_PIXELS {
            return Err(SliceError::TooManyPixels { pixels, side: pixel });
        }
        let bytes = pixels * counts[2] * BYTES;
        #[expect(clippy::cast_precision_loss, reason = "a limit of memory needs no more digits")]
        let allowed = options.memory as f64;
        // The second holds by itself unless pixels are far larger than the building.
        if bytes > allowed || counts[2] > MOST_PIXELS {
            return Err(SliceError::Memory { bytes, allowed: options.memory });
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "whole and at most 2^31")]
        let counts = counts.map(|n| n as u32);
        let plan =
            Self { grid: Grid { up, origin: min, pixel, slice_height, counts }, obstacle: options.obstacle };
        plan.check_rule()?;
        Ok(plan)
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

    fn check_rule(&self) -> Result<(), SliceError> {
        match self.obstacle {
            Obstacle::Share(share) if share.is_nan() || share <= 0.0 => {
                return Err(SliceError::Share { share });
            }
            Obstacle::Slope { degrees, .. } if !(degrees > 0.0 && degrees < 90.0) => {
                return Err(SliceError::Slope { degrees });
            }
            Obstacle::Slope { noise: Some(noise), .. } if noise.is_nan() || noise < 0.0 => {
                return Err(SliceError::Noise { noise });
            }
            _ => {}
        }
        let share = self.share(0.0);
        // The points of a voxel span less than σ.
        if share < 1.0 { Ok(()) } else { Err(SliceError::NoObstacles { share }) }
    }

    /// ε, where noise that was not given is this.
    pub(crate) fn share(&self, estimated: f64) -> f64 {
        match self.obstacle {
            Obstacle::Share(share) => share,
            Obstacle::Slope { degrees, noise } => {
                let rise = self.grid.pixel * degrees.to_radians().tan();
                (rise + noise.unwrap_or(estimated)) / self.grid.slice_height
            }
        }
    }
}
