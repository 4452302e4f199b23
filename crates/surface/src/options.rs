//! What defines the surface: options as plain numbers, and the plan that they validate to.

use nearmiss_index::PointBlock;
use std::fmt;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::Kernel;

/// How far a point is from where f is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Metric {
    /// In a straight line: Klein & Zachmann 2004, eq. 1.
    #[default]
    Euclidean,
    /// Along a proximity graph, which does not lead across to a sheet that is near: Klein & Zachmann 2005,
    /// eq. 5.
    Geodesic,
}

impl Metric {
    /// The word for it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Euclidean => "euclidean",
            Self::Geodesic => "geodesic",
        }
    }
}

impl fmt::Display for Metric {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Whether the kernel's width follows the local spacing.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Bandwidth {
    /// Every point weighs with a bandwidth of its own: m · r_i / √(−ln θ_ε).
    #[default]
    Local,
    /// One bandwidth from the scan's sampling radius: Klein & Zachmann 2004, eq. 9.
    Global,
    /// One bandwidth of this length, in the units of the scan.
    Fixed(f64),
}

/// What defines the surface. Plain numbers; [`SurfacePlan::new`] validates them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct SurfaceOptions {
    /// Weight by distance. Default: Gaussian.
    pub kernel: Kernel,
    /// Width of the kernel. Default: local.
    pub bandwidth: Bandwidth,
    /// m, the horizon in sampling radii (S0 eq. 9): 1 to 16, default 3. Larger smooths noise away, rounds
    /// edges, merges sheets that are close, and costs with its square.
    pub horizon: f64,
    /// θ_ε, the weight at the horizon, 1e-12 to 0.5, default 1e-4. Smaller narrows the kernel in the same
    /// horizon. The Gaussian's alone.
    pub threshold: f64,
    /// Least number of points in whose horizon a surface point must lie, at least 3, default 6.
    pub support_min: u32,
}

impl Default for SurfaceOptions {
    fn default() -> Self {
        Self {
            kernel: Kernel::Gaussian,
            bandwidth: Bandwidth::Local,
            horizon: 3.0,
            threshold: 1e-4,
            support_min: 6,
        }
    }
}

impl SurfaceOptions {
    /// The same options with this kernel.
    #[must_use]
    pub const fn with_kernel(self, kernel: Kernel) -> Self {
        Self { kernel, ..self }
    }

    /// The same options with this bandwidth.
    #[must_use]
    pub const fn with_bandwidth(self, bandwidth: Bandwidth) -> Self {
        Self { bandwidth, ..self }
    }

    /// The same options with this horizon, in sampling radii.
    #[must_use]
    pub const fn with_horizon(self, horizon: f64) -> Self {
        Self { horizon, ..self }
    }

    /// The same options with this weight at the horizon.
    #[must_use]
    pub const fn with_threshold(self, threshold: f64) -> Self {
        Self { threshold, ..self }
    }

    /// The same options with this least support.
    #[must_use]
    pub const fn with_support_min(self, support_min: u32) -> Self {
        Self { support_min, ..self }
    }
}

/// Bandwidths, in stored units, whose squares single precision holds.
const REPRESENTABLE: std::ops::RangeInclusive<f64> = 1e-18..=1e18;

/// Which option is out of range.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SurfaceError {
    /// The horizon is not between 1 and 16 sampling radii.
    #[error("a horizon of {0} sampling radii; it must lie between 1 and 16")]
    Horizon(f64),
    /// The weight at the horizon is not between 1e-12 and 0.5.
    #[error("a weight of {0} at the horizon; it must lie between 1e-12 and 0.5")]
    Threshold(f64),
    /// Fewer than three points span no plane.
    #[error("a least support of {0}; three points are needed to span a plane")]
    Support(u32),
    /// A fixed bandwidth must be a positive length that single precision can square.
    #[error("a bandwidth of {0}; it must be positive, and neither vanish nor be boundless beside the scan")]
    Bandwidth(f64),
}

/// Validated options with what follows from them, for one scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePlan {
    options: SurfaceOptions,
    /// `horizon_i = slope · r_i + level`: one of the two is zero.
    slope: f32,
    level: f32,
    reach_sq: f32,
    /// h/horizon.
    per_horizon: f32,
}

impl SurfacePlan {
    /// All points of a scan in blocks, given their positions and local sampling radii.
    #[must_use]
    pub fn blocks(&self, positions: &[[f32; 3]], radii: &[f32]) -> impl ExactSizeIterator<Item = PointBlock> {
        PointBlock::silent(positions).zip(radii.chunks(PointBlock::WIDTH)).map(|(mut block, radii)| {
            self.tune(&mut block, radii);
            block
        })
    }

    /// Puts a point that is heard as far as `horizon` into a lane of a block.
    ///
    /// # Panics
    /// When there is no such lane.
    #[inline]
    pub fn put(&self, block: &mut PointBlock, lane: usize, position: [f32; 3], horizon: f32) {
        for k in 0..3 {
            block.position[k][lane] = position[k];
        }
        block.horizon[lane] = horizon;
    }

    /// Lets the first points of a block be heard as their local sampling radii want it.
    pub fn tune(&self, block: &mut PointBlock, radii: &[f32]) {
        for (horizon, radius) in block.horizon.iter_mut().zip(radii) {
            *horizon = self.horizon(*radius);
        }
    }

    /// Validates `options` for a scan with this `sampling_radius`; lengths are in the units of its stored
    /// positions, `unit` of which make one of the caller's, in which a fixed bandwidth is given.
    ///
    /// # Errors
    /// Names the option that is out of range.
    pub fn new(options: &SurfaceOptions, sampling_radius: f64, unit: f64) -> Result<Self, SurfaceError> {
        let SurfaceOptions { bandwidth, horizon, threshold, support_min, .. } = *options;
        if !(1.0..=16.0).contains(&horizon) {
            return Err(SurfaceError::Horizon(horizon));
        }
        if !(1e-12..=0.5).contains(&threshold) {
            return Err(SurfaceError::Threshold(threshold));
        }
        if support_min < 3 {
            return Err(SurfaceError::Support(support_min));
        }
        let reach_sq = options.kernel.reach_sq(threshold);
        let (slope, level) = match bandwidth {
            Bandwidth::Local => (horizon, 0.0),
            Bandwidth::Global => (0.0, horizon * sampling_radius),
            Bandwidth::Fixed(h) if REPRESENTABLE.contains(&(h * unit)) => (0.0, h * unit * reach_sq.sqrt()),
            Bandwidth::Fixed(h) => return Err(SurfaceError::Bandwidth(h)),
        };
        #[expect(clippy::cast_possible_truncation, reason = "neighbour sums are single precision")]
        let plan = Self {
            options: *options,
            slope: slope as f32,
            level: level as f32,
            reach_sq: reach_sq as f32,
            per_horizon: (1.0 / reach_sq.sqrt()) as f32,
        };
        Ok(plan)
    }

    /// The options that were validated.
    #[must_use]
    pub fn options(&self) -> &SurfaceOptions {
        &self.options
    }

    /// The kernel.
    #[must_use]
    pub fn kernel(&self) -> Kernel {
        self.options.kernel
    }

    /// How far a point of local sampling radius `radius` is heard.
    #[inline(always)]
    #[must_use]
    pub fn horizon(&self, radius: f32) -> f32 {
        self.slope * radius + self.level
    }

    /// The bandwidth h of a point of local sampling radius `radius`.
    #[inline]
    #[must_use]
    pub fn bandwidth(&self, radius: f32) -> f32 {
        self.horizon(radius) * self.per_horizon
    }

    /// 1/h² of a point that is heard as far as `horizon`.
    #[inline(always)]
    #[must_use]
    pub fn decay(&self, horizon: f32) -> f32 {
        self.reach_sq / (horizon * horizon)
    }

    /// h/horizon.
    #[inline]
    pub(crate) fn per_horizon(&self) -> f32 {
        self.per_horizon
    }

    /// (horizon/h)², the value of d²/h² at which weights end.
    #[inline]
    #[must_use]
    pub fn reach_sq(&self) -> f32 {
        self.reach_sq
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_checked_by_name() {
        let bad = |o: SurfaceOptions| SurfacePlan::new(&o, 1.0, 1.0).unwrap_err();
        let d = SurfaceOptions::default;
        assert_eq!(bad(d().with_horizon(0.5)), SurfaceError::Horizon(0.5));
        assert!(matches!(bad(d().with_horizon(f64::NAN)), SurfaceError::Horizon(_)));
        assert_eq!(bad(d().with_threshold(0.0)), SurfaceError::Threshold(0.0));
        assert_eq!(bad(d().with_support_min(2)), SurfaceError::Support(2));
        for h in [-1.0, 0.0, 1e-300, 1e300, f64::INFINITY] {
            assert_eq!(bad(d().with_bandwidth(Bandwidth::Fixed(h))), SurfaceError::Bandwidth(h));
        }
    }

    #[test]
    fn bandwidths_follow_equation_nine() {
        let local = SurfacePlan::new(&SurfaceOptions::default(), 2.0, 1.0).unwrap();
        let h = 3.0 * 0.5 / (-(1e-4_f64).ln()).sqrt();
        assert!((f64::from(local.bandwidth(0.5)) - h).abs() < 1e-6, "local follows the point");
        let global = SurfaceOptions::default().with_bandwidth(Bandwidth::Global);
        let global = SurfacePlan::new(&global, 2.0, 1.0).unwrap();
        assert!((f64::from(global.bandwidth(0.5)) - 4.0 * h).abs() < 1e-6, "global follows the scan");
        let fixed = SurfaceOptions::default().with_bandwidth(Bandwidth::Fixed(0.25));
        let fixed = SurfacePlan::new(&fixed, 2.0, 8.0).unwrap();
        assert!((fixed.bandwidth(0.5) - 2.0).abs() < 1e-6, "fixed is in the caller's units");
    }
}
