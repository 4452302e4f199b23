//! Doubles for code that runs on one number or on eight at once.

use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use fearless_simd::prelude::*;
use fearless_simd::{f64x8, mask64x8, u64x8};

/// A double, or a vector of doubles. Each lane gets the same bits as a single double would.
///
/// Every operation is one that IEEE 754 rounds exactly, so results do not depend on the instruction
/// set. [`Lane::select`] replaces branches on values.
pub trait Lane:
    Copy
    + Add<Output = Self>
    + Add<f64, Output = Self>
    + Sub<Output = Self>
    + Sub<f64, Output = Self>
    + Mul<Output = Self>
    + Mul<f64, Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// One boolean for each lane.
    type Mask: Copy + BitAnd<Output = Self::Mask> + BitOr<Output = Self::Mask> + Not<Output = Self::Mask>;

    /// Returns `x` in every lane.
    #[must_use]
    fn splat(self, x: f64) -> Self;
    /// Returns the square root; NaN of a negative number.
    #[must_use]
    fn sqrt(self) -> Self;
    /// Returns the magnitude.
    #[must_use]
    fn abs(self) -> Self;
    /// Returns `true` where the number is less than the other one, and `false` if either is NaN.
    fn is_less(self, other: Self) -> Self::Mask;
    /// Returns `true` where the number is at most the other one, and `false` if either is NaN.
    fn is_at_most(self, other: Self) -> Self::Mask;
    /// Returns the greater number; unspecified if either is NaN.
    #[must_use]
    fn greater(self, other: Self) -> Self;
    /// Clamps to `least..=greatest`; NaN stays NaN.
    #[must_use]
    fn within(self, least: f64, greatest: f64) -> Self;
    /// Returns `a` where the mask is true, else `b`.
    #[must_use]
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;
    /// Returns a mask that is `false` in every lane.
    #[inline(always)]
    fn nowhere(self) -> Self::Mask {
        self.is_less(self)
    }
    /// Returns `true` if the mask is true in any lane.
    fn any(mask: Self::Mask) -> bool;
    /// Returns 2⁻ᵉ and 2ᵉ with 2ᵉ ≤ x < 2ᵉ⁺¹, for a normal positive x below 2¹⁰²³.
    #[must_use]
    fn powers_of_two(self) -> (Self, Self);

    // The methods below use loops, because closures passed to the standard library are not compiled
    // for the caller's instruction set.

    /// Returns all of `a` where the mask is true, else all of `b`.
    #[must_use]
    #[inline(always)]
    fn select_all<const N: usize>(mask: Self::Mask, a: [Self; N], b: [Self; N]) -> [Self; N] {
        let mut selected = b;
        for i in 0..N {
            selected[i] = Self::select(mask, a[i], b[i]);
        }
        selected
    }

    /// Returns all of `a` times this number.
    #[must_use]
    #[inline(always)]
    fn scale_all<const N: usize>(self, mut a: [Self; N]) -> [Self; N] {
        for x in &mut a {
            *x = *x * self;
        }
        a
    }

    /// Returns `a` in every lane.
    #[must_use]
    #[inline(always)]
    fn splat_all<const N: usize>(self, a: [f64; N]) -> [Self; N] {
        let mut all = [self; N];
        for i in 0..N {
            all[i] = self.splat(a[i]);
        }
        all
    }
}

/// a · b, summed in the order of the coordinates.
#[inline(always)]
#[must_use]
pub fn dot<L: Lane>(a: [L; 3], b: [L; 3]) -> L {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a + b.
#[inline(always)]
#[must_use]
pub fn sum<L: Lane>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// a − b.
#[inline(always)]
#[must_use]
pub fn difference<L: Lane>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// The exponent bits of a double, and the sum of the exponent bits of 2⁻ᵉ and 2ᵉ.
const EXPONENT: u64 = 0x7ff << 52;
const OPPOSITES: u64 = 2046 << 52;

impl Lane for f64 {
    type Mask = bool;

    #[inline(always)]
    fn splat(self, x: f64) -> Self {
        x
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self::sqrt(self)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self::abs(self)
    }

    #[inline(always)]
    fn is_less(self, other: Self) -> bool {
        self < other
    }

    #[inline(always)]
    fn is_at_most(self, other: Self) -> bool {
        self <= other
    }

    #[inline(always)]
    fn greater(self, other: Self) -> Self {
        if self > other { self } else { other }
    }

    #[inline(always)]
    fn within(self, least: f64, greatest: f64) -> Self {
        let x = if greatest < self { greatest } else { self };
        if least > x { least } else { x }
    }

    #[inline(always)]
    fn select(mask: bool, a: Self, b: Self) -> Self {
        if mask { a } else { b }
    }

    #[inline(always)]
    fn any(mask: bool) -> bool {
        mask
    }

    #[inline(always)]
    fn powers_of_two(self) -> (Self, Self) {
        let exponent = self.to_bits() & EXPONENT;
        (Self::from_bits(OPPOSITES.wrapping_sub(exponent)), Self::from_bits(exponent))
    }
}

impl<S: Simd> Lane for f64x8<S> {
    type Mask = mask64x8<S>;

    #[inline(always)]
    fn splat(self, x: f64) -> Self {
        SimdBase::splat(self.token(), x)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        SimdFloat::sqrt(self)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        SimdBase::abs(self)
    }

    #[inline(always)]
    fn is_less(self, other: Self) -> mask64x8<S> {
        self.simd_lt(other)
    }

    #[inline(always)]
    fn is_at_most(self, other: Self) -> mask64x8<S> {
        self.simd_le(other)
    }

    #[inline(always)]
    fn greater(self, other: Self) -> Self {
        self.max(other)
    }

    #[inline(always)]
    fn within(self, least: f64, greatest: f64) -> Self {
        // If either operand is NaN, x86 returns the second one and other machines return the NaN.
        Lane::splat(self, least).max(Lane::splat(self, greatest).min(self))
    }

    #[inline(always)]
    fn select(mask: mask64x8<S>, a: Self, b: Self) -> Self {
        mask.select(a, b)
    }

    #[inline(always)]
    fn any(mask: mask64x8<S>) -> bool {
        mask.any_true()
    }

    #[inline(always)]
    fn powers_of_two(self) -> (Self, Self) {
        let exponent: u64x8<S> = self.to_bits() & EXPONENT;
        let opposite = <u64x8<S> as SimdBase<S>>::splat(self.token(), OPPOSITES) - exponent;
        (Self::from_bits(opposite), Self::from_bits(exponent))
    }
}
