//! Kernels: the weight of a point as a function of t = d²/h².
//!
//! * Gaussian, exp(−t), cut off at the support radius, where it falls to θ_ε (Klein & Zachmann
//!   2004, eq. 5 and §4.1.2).
//! * Wendland C², (1−q)⁴(4q+1) with q the distance over the support radius (Wendland, "Piecewise
//!   polynomial, positive definite and compactly supported radial functions of minimal degree",
//!   Adv. Comput. Math. 4, 1995). It falls to zero at the support radius without a step.
//!
//! For both, h is chosen so that the weighted variance of an evenly sampled plane is h²/2 along any
//! direction in the plane. Conditions in terms of h therefore mean the same for both. For
//! Wendland's function ∫q³w / ∫qw = 5/36, hence h² = 5/36 of the squared support radius.

use fearless_simd::{Bytes, Simd, SimdBase, SimdFloat, SimdFrom, f32x8, u32x8};
use serde::{Deserialize, Serialize};

/// The weight function of a point's distance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Kernel {
    /// exp(−d²/h²), cut off at the support radius, as in Klein & Zachmann 2004, eq. 5.
    #[default]
    Gaussian,
    /// Wendland's C² function with compact support.
    Wendland,
}

/// (support radius/h)² of Wendland's function.
const WENDLAND_REACH_SQ: f64 = 36.0 / 5.0;

impl Kernel {
    /// Returns (support radius/h)², the value of t at which the weight ends. `threshold` is θ_ε,
    /// the Gaussian's weight there.
    #[must_use]
    pub fn reach_sq(self, threshold: f64) -> f64 {
        match self {
            Self::Gaussian => -threshold.ln(),
            Self::Wendland => WENDLAND_REACH_SQ,
        }
    }

    /// Returns the weight at t = d²/h², before the cut-off at the support radius.
    #[inline]
    #[must_use]
    pub fn weight(self, t: f32) -> f32 {
        match self {
            Self::Gaussian => exp_neg(t),
            Self::Wendland => wendland(t),
        }
    }

    /// Returns [`Self::weight`] in lanes, equal to the last bit for 0 ≤ t ≤ 80.
    #[inline(always)]
    #[must_use]
    pub fn weights<S: Simd>(self, simd: S, t: f32x8<S>) -> f32x8<S> {
        match self {
            Self::Gaussian => exp_neg_lanes(t),
            Self::Wendland => wendland_lanes(simd, t),
        }
    }
}

/// As [`wendland`], in lanes.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "a constant that f32 holds closely enough")]
fn wendland_lanes<S: Simd>(simd: S, t: f32x8<S>) -> f32x8<S> {
    const INVERSE: f32 = (1.0 / WENDLAND_REACH_SQ) as f32;
    let q = (t * INVERSE).sqrt();
    let (s, zero) = (1.0 - q, f32x8::simd_from(simd, 0.0));
    let s = simd.select_f32x8(s.simd_gt(zero), s, zero);
    (s * s) * (s * s) * (q * 4.0 + 1.0)
}

/// As [`exp_neg`], in lanes.
#[inline(always)]
fn exp_neg_lanes<S: Simd>(t: f32x8<S>) -> f32x8<S> {
    let y = t * -std::f32::consts::LOG2_E;
    let shifted = y + ROUND;
    let r = y - (shifted - ROUND);
    let square = r * r;
    let low = (r * EXP2[1] + EXP2[0]) + (r * EXP2[3] + EXP2[2]) * square;
    let p = low + (r * EXP2[5] + EXP2[4]) * (square * square);
    (p.bitcast::<u32x8<S>>() + (shifted.bitcast::<u32x8<S>>() << 23)).bitcast()
}

#[inline]
#[expect(clippy::cast_possible_truncation, reason = "a constant that f32 holds closely enough")]
fn wendland(t: f32) -> f32 {
    const INVERSE: f32 = (1.0 / WENDLAND_REACH_SQ) as f32;
    let q = (t * INVERSE).sqrt();
    let s = (1.0 - q).max(0.0);
    (s * s) * (s * s) * (4.0 * q + 1.0)
}

/// Added to a number below 2²², this rounds the number to an integer, which is then in the low
/// bits.
const ROUND: f32 = 12_582_912.0;

/// Coefficients of 2^r for |r| ≤ 1/2, lowest power first. Of the polynomials with value 1 and slope
/// ln 2 at 0, this one has the least maximum relative error, 1.1e-7.
const EXP2: [f32; 6] =
    [1.0, std::f32::consts::LN_2, 0.240_222_83, 0.055_505_585, 0.009_669_691, 0.001_330_060_7];

/// Returns exp(−t) for 0 ≤ t ≤ 80, and the value at 80 beyond.
///
/// The relative error is at most 2e-7 + 8e-8 t, about as much as rounding of t causes. The result
/// has the same bits on every machine. There is no call, so it vectorises.
#[inline]
#[must_use]
pub(crate) fn exp_neg(t: f32) -> f32 {
    let y = t.min(80.0) * -std::f32::consts::LOG2_E;
    let shifted = y + ROUND;
    let r = y - (shifted - ROUND);
    // Estrin's scheme shortens the chain of dependent operations.
    let square = r * r;
    let low = (r * EXP2[1] + EXP2[0]) + (r * EXP2[3] + EXP2[2]) * square;
    let p = low + (r * EXP2[5] + EXP2[4]) * (square * square);
    // Multiplies p by a power of two by adding to the exponent.
    f32::from_bits(p.to_bits().wrapping_add(shifted.to_bits() << 23))
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;

    #[test]
    fn exponential_is_accurate_over_its_whole_range() {
        let mut worst = 0.0_f64;
        for i in 0..800_000_u32 {
            #[expect(clippy::cast_precision_loss, reason = "below 2^24")]
            let t = i as f32 * 1e-4;
            let exact = (-f64::from(t)).exp();
            let allowed = 2e-7 + 8e-8 * f64::from(t);
            worst = worst.max((f64::from(exp_neg(t)) / exact - 1.0).abs() / allowed);
        }
        assert!(worst < 1.0, "{worst} of what is allowed");
        assert_eq!(exp_neg(0.0).to_bits(), 1.0_f32.to_bits(), "exactly one at zero");
    }

    #[test]
    fn lanes_weigh_as_one_by_one_at_every_level() {
        fn in_lanes<S: Simd>(simd: S, kernel: Kernel, t: &[f32; 8]) -> [f32; 8] {
            kernel.weights(simd, f32x8::load_array_ref(simd, t)).to_array()
        }
        for i in 0..50_000_u16 {
            let t = std::array::from_fn(|lane| f32::from(i) * 1e-4 * f32::from(u8::try_from(lane).unwrap()));
            for kernel in [Kernel::Gaussian, Kernel::Wendland] {
                let expected = t.map(|t| kernel.weight(t).to_bits());
                let best = Level::new();
                let found = dispatch!(best, simd => in_lanes(simd, kernel, &t));
                assert_eq!(found.map(f32::to_bits), expected, "{kernel:?} at {t:?}");
                let found = dispatch!(Level::baseline(), simd => in_lanes(simd, kernel, &t));
                assert_eq!(found.map(f32::to_bits), expected, "{kernel:?} at {t:?}, baseline");
            }
        }
    }

    #[test]
    fn variance_of_a_plane_is_half_the_squared_bandwidth() {
        for kernel in [Kernel::Gaussian, Kernel::Wendland] {
            let reach = kernel.reach_sq(1e-9).sqrt();
            let (mut mass, mut moment) = (0.0, 0.0);
            let n = 20_000;
            for i in 0..n {
                let d = (f64::from(i) + 0.5) / f64::from(n) * reach;
                #[expect(clippy::cast_possible_truncation, reason = "the kernel is single precision")]
                let w = f64::from(kernel.weight((d * d) as f32)) * d;
                mass += w;
                moment += w * d * d;
            }
            let variance = moment / mass / 2.0;
            assert!((variance - 0.5).abs() < 1e-4, "{kernel:?}: {variance}");
        }
    }

    #[test]
    fn wendland_ends_at_its_support_radius() {
        #[expect(clippy::cast_possible_truncation, reason = "the kernel is single precision")]
        let end = Kernel::Wendland.reach_sq(0.1) as f32;
        assert!(Kernel::Wendland.weight(end) < 1e-20, "zero at the support radius");
        assert!(Kernel::Wendland.weight(2.0 * end) < 1e-20, "and beyond");
        assert_eq!(Kernel::Wendland.weight(0.0).to_bits(), 1.0_f32.to_bits(), "one at the point");
    }
}
