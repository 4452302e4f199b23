//! Numbers that closed forms are written in: one double, or eight side by side.

use std::ops::{Add, BitAnd, Div, Mul, Neg, Sub};

use fearless_simd::prelude::*;
use fearless_simd::{f64x8, mask64x8, u64x8};

/// A double, or as many as fit side by side, of which each gets the same bits as if it were alone.
///
/// Every operation is one that IEEE 754 rounds exactly, so nothing depends on the instruction set. There is
/// no branching on a value; [`Lane::select`] takes its place.
pub(crate) trait Lane:
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
    /// One truth value for each number.
    type Mask: Copy + BitAnd<Output = Self::Mask>;

    /// `x` in the place of each number.
    fn splat(self, x: f64) -> Self;
    fn sqrt(self) -> Self;
    fn abs(self) -> Self;
    fn is_less(self, other: Self) -> Self::Mask;
    /// The greater; anything if either is NaN.
    fn greater(self, other: Self) -> Self;
    /// The end of the range where x is outside it; NaN stays.
    fn within(self, least: f64, greatest: f64) -> Self;
    /// `a` where the mask is true, else `b`.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;
    /// 2⁻ᵉ and 2ᵉ with 2ᵉ ≤ x < 2ᵉ⁺¹, for a normal positive x below 2¹⁰²³.
    fn powers_of_two(self) -> (Self, Self);

    // Loops, as closures given to the standard library are not compiled for the caller's instruction set.

    #[inline(always)]
    fn select_all<const N: usize>(mask: Self::Mask, a: [Self; N], b: [Self; N]) -> [Self; N] {
        let mut selected = b;
        for i in 0..N {
            selected[i] = Self::select(mask, a[i], b[i]);
        }
        selected
    }

    #[inline(always)]
    fn scale_all<const N: usize>(self, mut a: [Self; N]) -> [Self; N] {
        for x in &mut a {
            *x = *x * self;
        }
        a
    }
}

/// The exponent's bits in a double, and the sum of those of 2⁻ᵉ and 2ᵉ.
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
    fn greater(self, other: Self) -> Self {
        self.max(other)
    }

    #[inline(always)]
    fn within(self, least: f64, greatest: f64) -> Self {
        // x86 takes the second of two if either is NaN; others take the NaN.
        Lane::splat(self, least).max(Lane::splat(self, greatest).min(self))
    }

    #[inline(always)]
    fn select(mask: mask64x8<S>, a: Self, b: Self) -> Self {
        mask.select(a, b)
    }

    #[inline(always)]
    fn powers_of_two(self) -> (Self, Self) {
        let exponent: u64x8<S> = self.to_bits() & EXPONENT;
        let opposite = <u64x8<S> as SimdBase<S>>::splat(self.token(), OPPOSITES) - exponent;
        (Self::from_bits(opposite), Self::from_bits(exponent))
    }
}
