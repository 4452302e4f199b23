//! Kernels: the weight of a point by its distance, as a function of t = d²/h².
//!
//! * Gaussian, exp(−t), cut at the horizon where it falls to θ_ε (Klein & Zachmann 2004, eq. 5 and §4.1.2).
//! * Wendland C², (1−q)⁴(4q+1) with q the distance in horizons (Wendland, "Piecewise polynomial, positive
//!   definite and compactly supported radial functions of minimal degree", Adv. Comput. Math. 4, 1995). It
//!   reaches zero at the horizon without a step.
//!
//! Both are given the bandwidth h for which an evenly sampled plane has the weighted variance h²/2 along
//! either of its directions, so that every condition in terms of h means the same for both. For Wendland's
//! function ∫q³w / ∫qw = 5/36, hence h² = 5/36 of the squared horizon.

use fearless_simd::{Bytes, Simd, SimdBase, SimdFloat, SimdFrom, f32x8, u32x8};
use serde::{Deserialize, Serialize};

/// How the weight of a point falls off with its distance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Kernel {
    /// exp(−d²/h²), cut at the horizon: the papers' kernel.
    #[default]
    Gaussian,
    /// Wendland's C² function with compact support.
    Wendland,
}

/// (horizon/h)² of Wendland's function.
const WENDLAND_REACH_SQ: f64 = 36.0 / 5.0;

impl Kernel {
    /// (horizon/h)²: the value of t at which the weight ends, given the Gaussian's cut-off weight θ_ε.
    #[must_use]
    pub fn reach_sq(self, threshold: f64) -> f64 {
        match self {
            Self::Gaussian => -threshold.ln(),
            Self::Wendland => WENDLAND_REACH_SQ,
        }
    }

    /// The weight at t = d²/h², before the cut at the horizon.
    #[inline]
    #[must_use]
    pub fn weight(self, t: f32) -> f32 {
        match self {
            Self::Gaussian => exp_neg(t),
            Self::Wendland => wendland(t),
        }
    }

    /// [`Self::weight`] in lanes, the same to the last bit for 0 ≤ t ≤ 80.
    #[inline(always)]
    #[must_use]
    pub fn weights<S: Simd>(self, simd: S, t: f32x8<S>) -> f32x8<S> {
        match self {
            Self::Gaussian => exp_neg_lanes(t),
            Self::Wendland => wendland_lanes(simd, t),
        }
    }
}

/// As [`wendland`].
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "a constant that f32 holds closely enough")]
fn wendland_lanes<S: Simd>(simd: S, t: f32x8<S>) -> f32x8<S> {
    const INVERSE: f32 = (1.0 / WENDLAND_REACH_SQ) as f32;
    let q = (t * INVERSE).sqrt();
    let (s, zero) = (1.0 - q, f32x8::simd_from(simd, 0.0));
    let s = simd.select_f32x8(s.simd_gt(zero), s, zero);
    (s * s) * (s * s) * (q * 4.0 + 1.0)
}

/// As [`exp_neg`].
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

/// Adding this to a number below 2²² rounds it to an integer, which then stands in the low bits.
const ROUND: f32 = 12_582_912.0;

/// 2^r for |r| ≤ 1/2, that of r⁰ first: of the polynomials that are 1 and have the slope ln 2 at 0 the one
/// whose greatest relative error, 1.1e-7, is least.
const EXP2: [f32; 6] =
    [1.0, std::f32::consts::LN_2, 0.240_222_83, 0.055_505_585, 0.009_669_691, 0.001_330_060_7];

/// exp(−t) for 0 ≤ t ≤ 80, with a relative error of 2e-7 + 8e-8 t, which is what the rounding of t makes
/// anyway; the same bits on every machine, and without a call, so that it vectorises. Beyond 80 the value at
/// 80.
#[inline]
#[must_use]
pub(crate) fn exp_neg(t: f32) -> f32 {
    let y = t.min(80.0) * -std::f32::consts::LOG2_E;
    let shifted = y + ROUND;
    let r = y - (shifted - ROUND);
    // By thirds, which leaves shorter chains of operations that wait for each other.
    let square = r * r;
    let low = (r * EXP2[1] + EXP2[0]) + (r * EXP2[3] + EXP2[2]) * square;
    let p = low + (r * EXP2[5] + EXP2[4]) * (square * square);
    // Times a power of two: its exponent is added to that of p.
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
    fn wendland_ends_at_its_horizon() {
        #[expect(clippy::cast_possible_truncation, reason = "the kernel is single precision")]
        let end = Kernel::Wendland.reach_sq(0.1) as f32;
        assert!(Kernel::Wendland.weight(end) < 1e-20, "zero at the horizon");
        assert!(Kernel::Wendland.weight(2.0 * end) < 1e-20, "and beyond");
        assert_eq!(Kernel::Wendland.weight(0.0).to_bits(), 1.0_f32.to_bits(), "one at the point");
    }
}
