//! The local frame in which a cloud's positions are stored as `f32`.

use serde::{Deserialize, Serialize};

/// The local frame of a cloud: world = `origin` + `scale` · local.
///
/// `scale` is a power of two. It is 1 unless the extent is outside 2^±30.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// Origin of the local frame, in the caller's frame.
    pub origin: [f64; 3],
    /// Length of a local unit in the caller's units.
    pub scale: f64,
}

impl Default for Frame {
    fn default() -> Self {
        Self { origin: [0.0; 3], scale: 1.0 }
    }
}

/// Beyond 2^±30, squares of single-precision lengths and values computed from these squares would
/// leave the range of `f32`.
const MAX_EXPONENT: i32 = 30;

impl Frame {
    /// Returns the frame for points within `min..=max`.
    ///
    /// The origin is 0 where that loses no precision. Otherwise it is near the middle of the
    /// bounds, on a grid so coarse that single-precision input stays exact.
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

    /// Converts a point from the caller's frame to the local frame, rounding to `f32`.
    #[inline]
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is the purpose")]
    pub fn to_local(&self, p: [f64; 3]) -> [f32; 3] {
        // Exact, for a power of two. Loops compute it once.
        let per_unit = 1.0 / self.scale;
        // Adding 0 turns -0 into 0, so that equal points have equal bits.
        [0, 1, 2].map(|k| ((p[k] - self.origin[k]) * per_unit) as f32 + 0.0)
    }

    /// Converts a stored point to the caller's frame.
    #[must_use]
    pub fn to_world(&self, p: [f32; 3]) -> [f64; 3] {
        [0, 1, 2].map(|k| self.origin[k] + self.scale * f64::from(p[k]))
    }
}

/// Floor of the binary logarithm of a positive finite number, at least −1000 so that its power of
/// two is normal.
fn exponent(x: f64) -> i32 {
    #[expect(clippy::cast_possible_truncation, reason = "between -1075 and 1024")]
    let e = x.log2().floor() as i32;
    e.max(-1000)
}

/// 2^`e`, for `e` in the exponent range of normal numbers.
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
