//! The local frame in which a cloud's positions are stored as `f32`.

use serde::{Deserialize, Serialize};

/// world = origin + scale · local; the scale is a power of two, 1 unless the extent leaves 2^±30.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// Where the local zero lies, in the caller's frame.
    pub origin: [f64; 3],
    /// Length of a local unit in the caller's units.
    pub scale: f64,
}

impl Default for Frame {
    fn default() -> Self {
        Self { origin: [0.0; 3], scale: 1.0 }
    }
}

/// Beyond 2^±30 squares of single-precision lengths would leave their range together with what is computed
/// from them.
const MAX_EXPONENT: i32 = 30;

impl Frame {
    /// The frame for points within `min..=max`: the caller's own where that loses nothing, else about the
    /// middle, on a grid so coarse that single-precision input stays exact.
    #[must_use]
    pub fn around(min: [f64; 3], max: [f64; 3]) -> Self {
        let half = (0..3).map(|k| 0.5 * max[k] - 0.5 * min[k]).fold(0.0, f64::max);
        if half == 0.0 {
            return Self { origin: min, scale: 1.0 };
        }
        let exponent = exponent(half);
        let scale = if exponent.abs() > MAX_EXPONENT { exp2(exponent) } else { 1.0 };
        let reach = (0..3).map(|k| max[k].abs().max(min[k].abs())).fold(0.0, f64::max);
        if reach <= 4.0 * half {
            return Self { origin: [0.0; 3], scale };
        }
        let grid = exp2(exponent - 4);
        let origin = [0, 1, 2].map(|k| ((0.5 * min[k] + 0.5 * max[k]) / grid).round() * grid);
        Self { origin, scale }
    }

    /// A point of the caller's frame, rounded to the local one.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is the purpose")]
    pub fn to_local(&self, p: [f64; 3]) -> [f32; 3] {
        // Adding zero turns -0 into 0, so that equal points have equal bits.
        [0, 1, 2].map(|k| ((p[k] - self.origin[k]) / self.scale) as f32 + 0.0)
    }

    /// A stored point in the caller's frame.
    #[must_use]
    pub fn to_world(&self, p: [f32; 3]) -> [f64; 3] {
        [0, 1, 2].map(|k| self.origin[k] + self.scale * f64::from(p[k]))
    }
}

/// Floor of the binary logarithm of a positive finite number, at least −1000, so that the power is normal.
fn exponent(x: f64) -> i32 {
    #[expect(clippy::cast_possible_truncation, reason = "between -1075 and 1024")]
    let e = x.log2().floor() as i32;
    e.max(-1000)
}

/// 2^e, for any exponent of a normal number.
fn exp2(e: i32) -> f64 {
    2.0_f64.powi(e)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn single_precision_input_far_away_stays_exact() {
        let a = [1_000_000.062_5_f64, -3.0, 5.5];
        let b = [1_000_010.937_5_f64, 7.0, 5.75];
        let frame = Frame::around(a, b);
        assert!(frame.origin[0] > 1e6, "a far cloud gets an origin of its own");
        for p in [a, b] {
            assert_eq!(frame.to_world(frame.to_local(p)), p, "no bit lost");
        }
    }

    #[test]
    fn denormal_extents_stay_finite() {
        let frame = Frame::around([0.0; 3], [4e-310; 3]);
        assert!(frame.scale.is_normal(), "{frame:?}");
        assert!(frame.to_local([4e-310; 3]).iter().all(|x| x.is_finite()), "{frame:?}");
    }

    #[test]
    fn extreme_extents_are_scaled_by_a_power_of_two() {
        for size in [1e-25, 1e12] {
            let frame = Frame::around([-size; 3], [size; 3]);
            let local = frame.to_local([size; 3]);
            assert!((1.0..=2.0).contains(&local[0]), "size {size}: {local:?}");
            assert!((frame.to_world(local)[0] / size - 1.0).abs() < 1e-7, "size {size}");
        }
        assert_eq!(Frame::around([-1e9; 3], [1e9; 3]).scale.to_bits(), 1.0_f64.to_bits(), "1e9 needs none");
    }
}
