//! The growth from the box of a node to its enclosure. Both have the same axes, so six lengths
//! suffice.
//!
//! Stored compactly, because a certificate reads many enclosures whose boxes it has already read:
//! the upper halves of single-precision numbers, rounded up.

use bytemuck::{Pod, Zeroable};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, i32x16, mask32x16, u32x16};
use nearmiss_lanes::wide::WIDTH;
use serde::{Deserialize, Serialize};

use crate::bounds::boxes::{OrientedBox, ROUNDING};

/// The lengths by which an enclosure exceeds the box of its node, on both sides along each axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Pod, Zeroable, Serialize, Deserialize)]
#[repr(C)]
pub struct Growth {
    /// Against the axes, as the upper halves of single-precision numbers.
    low: [u16; 3],
    /// Along the axes.
    high: [u16; 3],
}

/// Returns the upper half of a length, rounded up; [`BOUNDLESS`] for NaN.
#[inline(always)]
fn up(length: f32) -> u16 {
    let bits = if length <= f32::MAX { length.max(0.0).to_bits() } else { f32::INFINITY.to_bits() };
    ((bits + 0xffff) >> 16) as u16
}

/// Infinity: a box with this growth is disjoint from nothing.
const BOUNDLESS: u16 = 0x7f80;

#[inline]
fn length(half: u16) -> f32 {
    f32::from_bits(u32::from(half) << 16)
}

impl Growth {
    /// No growth.
    pub(crate) const NONE: Self = Self { low: [0; 3], high: [0; 3] };

    /// Returns the growth of `bounds` that makes it contain these intervals along its axes.
    pub(crate) fn new(bounds: &OrientedBox, low: [f32; 3], high: [f32; 3]) -> Self {
        Self::beyond(&bounds.along(&bounds.axes), low, high)
    }

    /// Does the same for a box with the intervals `own` along its axes.
    #[inline(always)]
    pub(crate) fn beyond(own: &[[f32; 2]; 3], low: [f32; 3], high: [f32; 3]) -> Self {
        let mut far = 0.0_f32;
        for k in 0..3 {
            far = far.max(low[k].abs()).max(high[k].abs());
        }
        let more = ROUNDING * far;
        // Not `max`, which would turn NaN into zero. Nothing here branches.
        let side = |beyond: f32| up(if beyond < 0.0 { 0.0 } else { beyond } + more);
        let mut growth = Self::NONE;
        for k in 0..3 {
            let is_sound = low[k] <= high[k];
            growth.low[k] = if is_sound { side(own[k][0] - low[k]) } else { BOUNDLESS };
            growth.high[k] = if is_sound { side(high[k] - own[k][1]) } else { BOUNDLESS };
        }
        growth
    }

    /// Returns the results of [`Self::beyond`] for two sets of intervals, each with its lower and upper ends.
    #[inline(always)]
    pub(crate) fn beyond_each<S: Simd>(
        simd: S,
        own: &[[f32; 2]; 3],
        intervals: [[[f32; 3]; 2]; 2],
    ) -> [Self; 2] {
        /// The first lane of the second growth.
        const SECOND: usize = WIDTH / 2;
        let (mut beyond, mut is_empty, mut more) = ([0.0; WIDTH], [0.0; WIDTH], [0.0; WIDTH]);
        for (first, [low, high]) in [0, SECOND].into_iter().zip(intervals) {
            let mut far = 0.0_f32;
            for k in 0..3 {
                far = far.max(low[k].abs()).max(high[k].abs());
                (beyond[first + k], beyond[first + 3 + k]) = (own[k][0] - low[k], high[k] - own[k][1]);
                (is_empty[first + k], is_empty[first + 3 + k]) = (low[k] - high[k], low[k] - high[k]);
            }
            more[first..first + 6].fill(ROUNDING * far);
        }
        let (zero, beyond) = (f32x16::splat(simd, 0.0), f32x16::load_array_ref(simd, &beyond));
        let is_within: mask32x16<S> = beyond.simd_lt(zero);
        let lengths = is_within.select(zero, beyond) + f32x16::load_array_ref(simd, &more);
        // Also false for NaN.
        let is_sound: mask32x16<S> = f32x16::load_array_ref(simd, &is_empty).simd_le(zero)
            & lengths.simd_le(f32x16::splat(simd, f32::MAX));
        let lengths = is_sound.select(lengths, f32x16::splat(simd, f32::INFINITY));
        let bits: u32x16<S> = lengths.bitcast();
        let halves: i32x16<S> = ((bits + 0xffff) >> 16).bitcast();
        let (low, high) = halves.split();
        let halves = low.saturating_narrow(high).to_array().map(i16::cast_unsigned);
        let growth = |first: usize| Self {
            low: [halves[first], halves[first + 1], halves[first + 2]],
            high: [halves[first + 3], halves[first + 4], halves[first + 5]],
        };
        [growth(0), growth(SECOND)]
    }

    /// Returns `bounds` grown. Infinite lengths do not move the centre.
    #[inline]
    #[must_use]
    pub fn of(&self, bounds: &OrientedBox) -> OrientedBox {
        let mut grown = *bounds;
        let (low, high) = self.lengths();
        for k in 0..3 {
            let shift = 0.5 * (high[k] - low[k]);
            let shift = if shift.is_finite() { shift } else { 0.0 };
            for i in 0..3 {
                grown.centre[i] += shift * bounds.axes[k][i];
            }
            grown.half[k] += 0.5 * (high[k] + low[k]);
        }
        grown
    }

    /// Returns the lengths against the axes and along them.
    #[inline]
    pub(crate) fn lengths(&self) -> ([f32; 3], [f32; 3]) {
        (self.low.map(length), self.high.map(length))
    }

    /// Returns the six halves packed in pairs, the first of each pair in the lower half: against
    /// the first and the second axis; against the third and along the first; along the second and
    /// the third.
    #[inline]
    pub(crate) fn pairs(&self) -> [u32; 3] {
        let ([a, b, c], [d, e, f]) = (self.low, self.high);
        [[a, b], [c, d], [e, f]].map(|[first, second]| u32::from(second) << 16 | u32::from(first))
    }

    /// Unpacks the result of [`Self::pairs`].
    #[inline]
    #[expect(clippy::cast_possible_truncation, reason = "halves of the number")]
    pub(crate) fn from_pairs(pairs: [u32; 3]) -> Self {
        let [[a, b], [c, d], [e, f]] = pairs.map(|pair| [pair as u16, (pair >> 16) as u16]);
        Self { low: [a, b, c], high: [d, e, f] }
    }

    /// Returns `true` if every length is valid: not negative and not NaN. Infinity is valid.
    pub(crate) fn is_sound(&self) -> bool {
        self.low.iter().chain(&self.high).all(|&half| half <= BOUNDLESS)
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};
    use nearmiss_testdata::arbitrary::rng;
    use rand::RngExt;

    use super::*;

    #[test]
    fn two_growths_in_lanes_are_those_of_each() {
        let ends = [f32::NEG_INFINITY, -3.5, -1.0, -0.0, 0.0, 1e-30, 0.7, 1.0, 2.5, 1e38, f32::MAX];
        let ends: Vec<f32> = ends.into_iter().chain([f32::INFINITY, f32::NAN]).collect();
        let rng = &mut rng(9);
        for _ in 0..20_000 {
            let mut some = || [(); 3].map(|()| ends[rng.random_range(0..ends.len())]);
            let (own, low, high, other) = (some(), some(), some(), some());
            let own = own.map(|x| [-x, x]);
            let expected = [Growth::beyond(&own, low, high), Growth::beyond(&own, high, other)];
            let found = dispatch!(Level::new(), simd => simd.vectorize(
                #[inline(always)]
                || Growth::beyond_each(simd, &own, [[low, high], [high, other]]),
            ));
            assert_eq!(found, expected, "{own:?} {low:?} {high:?} {other:?}");
        }
    }

    #[test]
    fn lengths_are_rounded_up_by_less_than_a_hundredth() {
        for x in [0.0, 1e-30, 1.0, 1.003, 0.333_333, 7.5e8, f32::MAX] {
            let kept = length(up(x));
            assert!(kept >= x && (kept <= 1.008 * x || kept.is_infinite()), "{x} is kept as {kept}");
        }
        assert_eq!(up(f32::INFINITY), BOUNDLESS);
        assert_eq!(up(f32::NAN), BOUNDLESS, "never less than it may be");
        assert!(!Growth { low: [BOUNDLESS + 1, 0, 0], high: [0; 3] }.is_sound(), "beyond the largest growth");
        assert!(!Growth { low: [0; 3], high: [0x8001, 0, 0] }.is_sound(), "less than nothing");
        assert!(Growth { low: [up(0.5); 3], high: [up(3e9); 3] }.is_sound());
    }
}
