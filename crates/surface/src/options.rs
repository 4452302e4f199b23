//! Options that define the surface, and the validated plan made from them.

use std::fmt;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16};
use nearmiss_index::PointBlock;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::Kernel;

/// The distance from x to a point by which the point is weighted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Metric {
    /// Straight-line distance: Klein & Zachmann 2004, eq. 1.
    #[default]
    Euclidean,
    /// Distance along a proximity graph, which keeps nearby sheets apart: Klein & Zachmann 2005,
    /// eq. 5.
    Geodesic,
}

impl Metric {
    /// Returns the metric's name in lower case.
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

/// The choice of the kernel's bandwidth.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Bandwidth {
    /// A bandwidth for each point, from its local sampling radius: m · r_i / √(−ln θ_ε).
    #[default]
    Local,
    /// One bandwidth for all points, from the scan's sampling radius: Klein & Zachmann 2004, eq. 9.
    Global,
    /// One bandwidth of this length for all points, in the units of the scan.
    Fixed(f64),
}

/// Options that define the surface. [`SurfacePlan::new`] validates them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct SurfaceOptions {
    /// Kernel. Default: Gaussian.
    pub kernel: Kernel,
    /// Choice of the bandwidth. Default: local.
    pub bandwidth: Bandwidth,
    /// m, the support radius in sampling radii (Klein & Zachmann 2004, eq. 9): 1 to 16, default 3.
    /// A larger value smooths noise, rounds edges and merges close sheets. The cost grows with its
    /// square.
    pub support_radius: f64,
    /// θ_ε, the weight at the support radius: 1e-12 to 0.5, default 1e-4. A smaller value narrows
    /// the kernel within the same support radius. Only the Gaussian uses it.
    pub threshold: f64,
    /// Least number of points whose support radius must reach a surface point: at least 3, default
    /// 6.
    pub support_min: u32,
}

impl Default for SurfaceOptions {
    fn default() -> Self {
        Self {
            kernel: Kernel::Gaussian,
            bandwidth: Bandwidth::Local,
            support_radius: 3.0,
            threshold: 1e-4,
            support_min: 6,
        }
    }
}

impl SurfaceOptions {
    /// Sets the kernel.
    #[must_use]
    pub const fn with_kernel(self, kernel: Kernel) -> Self {
        Self { kernel, ..self }
    }

    /// Sets the bandwidth.
    #[must_use]
    pub const fn with_bandwidth(self, bandwidth: Bandwidth) -> Self {
        Self { bandwidth, ..self }
    }

    /// Sets the support radius, in sampling radii.
    #[must_use]
    pub const fn with_support_radius(self, support_radius: f64) -> Self {
        Self { support_radius, ..self }
    }

    /// Sets the weight at the support radius.
    #[must_use]
    pub const fn with_threshold(self, threshold: f64) -> Self {
        Self { threshold, ..self }
    }

    /// Sets the least support.
    #[must_use]
    pub const fn with_support_min(self, support_min: u32) -> Self {
        Self { support_min, ..self }
    }
}

/// Bandwidths, in stored units, whose squares are in the range of single precision.
const REPRESENTABLE: std::ops::RangeInclusive<f64> = 1e-18..=1e18;

/// Error of [`SurfacePlan::new`]: an option out of range.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SurfaceError {
    /// A support radius that is not between 1 and 16 sampling radii.
    #[error("expected a support radius of 1 to 16 sampling radii, got {0}")]
    SupportRadius(f64),
    /// A weight at the support radius that is not between 1e-12 and 0.5.
    #[error("expected a weight of 1e-12 to 0.5 at the support radius, got {0}")]
    Threshold(f64),
    /// A least support below 3, the number of points that span a plane.
    #[error("expected a minimum support of at least 3 points, got {0}")]
    Support(u32),
    /// A fixed bandwidth that is not positive, or whose square is out of the range of single
    /// precision.
    #[error("expected a positive bandwidth comparable to the extent of the scan, got {0}")]
    Bandwidth(f64),
}

/// Validated options and derived quantities, for one scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePlan {
    options: SurfaceOptions,
    /// `R_i = slope · r_i + level`; one of the two is zero.
    slope: f32,
    level: f32,
    reach_sq: f32,
    /// h over the support radius.
    per_support_radius: f32,
}

impl SurfacePlan {
    /// Returns blocks of all points of a scan, given their positions and local sampling radii.
    #[must_use]
    pub fn blocks(&self, positions: &[[f32; 3]], radii: &[f32]) -> impl ExactSizeIterator<Item = PointBlock> {
        PointBlock::without_support(positions).zip(radii.chunks(PointBlock::WIDTH)).map(
            |(mut block, radii)| {
                self.tune(&mut block, radii);
                block
            },
        )
    }

    /// Sets the point in a lane of a block; `support_radius` is its support radius.
    ///
    /// # Panics
    /// Panics if there is no such lane.
    #[inline]
    pub fn put(&self, block: &mut PointBlock, lane: usize, position: [f32; 3], support_radius: f32) {
        for k in 0..3 {
            block.position[k][lane] = position[k];
        }
        block.support_radius[lane] = support_radius;
    }

    /// Sets the support radii of the first points of a block from their local sampling radii.
    pub fn tune(&self, block: &mut PointBlock, radii: &[f32]) {
        for (support_radius, radius) in block.support_radius.iter_mut().zip(radii) {
            *support_radius = self.support_radius(*radius);
        }
    }

    /// Validates `options` for a scan with this `sampling_radius`, in the units of its stored
    /// positions.
    ///
    /// `unit` is the number of stored units in one unit of the caller, in which a fixed bandwidth
    /// is given.
    ///
    /// # Errors
    /// Fails if an option is out of range; the error names it.
    pub fn new(options: &SurfaceOptions, sampling_radius: f64, unit: f64) -> Result<Self, SurfaceError> {
        let SurfaceOptions { bandwidth, support_radius, threshold, support_min, .. } = *options;
        if !(1.0..=16.0).contains(&support_radius) {
            return Err(SurfaceError::SupportRadius(support_radius));
        }
        if !(1e-12..=0.5).contains(&threshold) {
            return Err(SurfaceError::Threshold(threshold));
        }
        if support_min < 3 {
            return Err(SurfaceError::Support(support_min));
        }
        let reach_sq = options.kernel.reach_sq(threshold);
        let (slope, level) = match bandwidth {
            Bandwidth::Local => (support_radius, 0.0),
            Bandwidth::Global => (0.0, support_radius * sampling_radius),
            Bandwidth::Fixed(h) if REPRESENTABLE.contains(&(h * unit)) => (0.0, h * unit * reach_sq.sqrt()),
            Bandwidth::Fixed(h) => return Err(SurfaceError::Bandwidth(h)),
        };
        #[expect(clippy::cast_possible_truncation, reason = "neighbour sums are single precision")]
        let plan = Self {
            options: *options,
            slope: slope as f32,
            level: level as f32,
            reach_sq: reach_sq as f32,
            per_support_radius: (1.0 / reach_sq.sqrt()) as f32,
        };
        Ok(plan)
    }

    /// Returns the validated options.
    #[must_use]
    pub fn options(&self) -> &SurfaceOptions {
        &self.options
    }

    /// Returns the kernel.
    #[must_use]
    pub fn kernel(&self) -> Kernel {
        self.options.kernel
    }

    /// Returns the support radius of a point with local sampling radius `radius`.
    #[inline(always)]
    #[must_use]
    pub fn support_radius(&self, radius: f32) -> f32 {
        self.slope * radius + self.level
    }

    /// Returns the bandwidth h of a point with local sampling radius `radius`.
    #[inline]
    #[must_use]
    pub fn bandwidth(&self, radius: f32) -> f32 {
        self.support_radius(radius) * self.per_support_radius
    }

    /// Returns 1/h² of a point with this support radius.
    #[inline(always)]
    #[must_use]
    pub fn decay(&self, support_radius: f32) -> f32 {
        self.reach_sq / (support_radius * support_radius)
    }

    /// Returns 1/h² of the points of a block; infinite in unused lanes.
    #[inline(always)]
    #[must_use]
    pub fn decays<S: Simd>(&self, simd: S, block: &PointBlock) -> f32x16<S> {
        let support_radius = f32x16::load_array_ref(simd, &block.support_radius);
        f32x16::splat(simd, self.reach_sq) / (support_radius * support_radius)
    }

    /// Returns h over the support radius.
    #[inline]
    pub(crate) fn per_support_radius(&self) -> f32 {
        self.per_support_radius
    }

    /// Returns (support radius/h)², the value of d²/h² at which weights end.
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
        assert_eq!(bad(d().with_support_radius(0.5)), SurfaceError::SupportRadius(0.5));
        assert!(matches!(bad(d().with_support_radius(f64::NAN)), SurfaceError::SupportRadius(_)));
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
