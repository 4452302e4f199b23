//! Intervals of doubles that contain the exact results of sums and products.
//!
//! The rounding error of a sum, and of a product that does not underflow, is a double itself. Its
//! sign tells on which side of the rounded value the exact result is. So exact results remain
//! points, and touching is not overlapping.

use std::ops::{Add, Mul, Sub};

/// A real number between two doubles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Interval {
    pub(crate) low: f64,
    pub(crate) high: f64,
}

/// Below this, the error of a product may be too small for a double.
const UNDERFLOW: f64 = 1e-280;

impl Interval {
    /// Returns a double as an interval; NaN gives all numbers.
    pub(crate) fn new(x: f64) -> Self {
        Self::spanned(x, x)
    }

    /// Returns the interval from `low` to `high`; all numbers if either is NaN.
    fn spanned(low: f64, high: f64) -> Self {
        if low.is_nan() || high.is_nan() {
            return Self { low: f64::NEG_INFINITY, high: f64::INFINITY };
        }
        Self { low, high }
    }

    pub(crate) fn magnitude(self) -> Self {
        if self.low >= 0.0 {
            self
        } else if self.high <= 0.0 {
            Self { low: -self.high, high: -self.low }
        } else {
            Self { low: 0.0, high: self.high.max(-self.low) }
        }
    }

    /// Returns the square root of non-negative numbers; square roots are rounded correctly.
    pub(crate) fn root(self) -> Self {
        Self::spanned(self.low.max(0.0).sqrt().next_down().max(0.0), self.high.max(0.0).sqrt().next_up())
    }
}

impl Add for Interval {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self::spanned(sum(self.low, other.low)[0], sum(self.high, other.high)[1])
    }
}

impl Sub for Interval {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self::spanned(sum(self.low, -other.high)[0], sum(self.high, -other.low)[1])
    }
}

impl Mul for Interval {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let corners = [
            product(self.low, other.low),
            product(self.low, other.high),
            product(self.high, other.low),
            product(self.high, other.high),
        ];
        let low = corners.iter().map(|c| c[0]).fold(f64::INFINITY, f64::min);
        let high = corners.iter().map(|c| c[1]).fold(f64::NEG_INFINITY, f64::max);
        Self::spanned(low, high)
    }
}

/// Returns a·b for vectors.
pub(crate) fn dot(a: [Interval; 3], b: [Interval; 3]) -> Interval {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Returns bounds of a + b; the error is Knuth's.
fn sum(a: f64, b: f64) -> [f64; 2] {
    let sum = a + b;
    let part = sum - a;
    bracket(sum, (a - (sum - part)) + (b - part))
}

/// Returns bounds of a · b. An infinite bound times zero is zero, because no number in the interval
/// is infinite.
fn product(a: f64, b: f64) -> [f64; 2] {
    if a == 0.0 || b == 0.0 {
        return [0.0; 2];
    }
    let product = a * b;
    let error = if product.abs() > UNDERFLOW { a.mul_add(b, -product) } else { f64::NAN };
    bracket(product, error)
}

/// Returns bounds of a number that was rounded to `value`. The sign of `missing` is that of the
/// error; NaN if it is unknown.
fn bracket(value: f64, missing: f64) -> [f64; 2] {
    let low = if missing >= 0.0 { value } else { value.next_down() };
    let high = if missing <= 0.0 { value } else { value.next_up() };
    [low, high]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::Source;

    /// Returns an integer of at most 53 bits, often a short one.
    fn integer(source: &mut Source) -> i64 {
        let bits = source.next() % 53 + 1;
        let size = i64::try_from(source.next() >> (64 - bits)).unwrap();
        if source.next().is_multiple_of(2) { size } else { -size }
    }

    #[expect(clippy::cast_precision_loss, reason = "53 bits fit")]
    fn double(x: i64) -> f64 {
        x as f64
    }

    /// Bounds of integers beyond 2^53 are integers.
    #[expect(clippy::cast_possible_truncation, reason = "the tests stay below 2^127")]
    fn whole(x: f64) -> i128 {
        assert_eq!(x.fract().to_bits() << 1, 0, "{x} is an integer");
        x as i128
    }

    #[test]
    fn sums_and_products_contain_the_exact_integers() {
        let mut source = Source::new(1);
        let mut inexact = 0;
        for _ in 0..200_000 {
            let (x, y) = (integer(&mut source), integer(&mut source));
            let (a, b) = (Interval::new(double(x)), Interval::new(double(y)));
            let far = Interval::new(double(y) * 2.0_f64.powi(20));
            let (x, y) = (i128::from(x), i128::from(y));
            for (found, exact) in [
                (a * b, x * y),
                (a + b, x + y),
                (a - b, x - y),
                (a + far, x + (y << 20)),
                (a * far, (x * y) << 20),
            ] {
                if found.low == found.high {
                    assert_eq!(whole(found.low), exact, "{x} and {y}: a point is exact");
                    continue;
                }
                inexact += 1;
                assert!(whole(found.low) < exact && exact < whole(found.high), "{x} and {y}: {found:?}");
                assert_eq!(found.low.next_up().to_bits(), found.high.to_bits(), "{x} and {y}: neighbours");
            }
        }
        assert!(inexact > 100_000, "most cases round: {inexact}");
    }

    #[test]
    fn wide_intervals_contain_all_combinations() {
        let mut source = Source::new(2);
        for _ in 0..50_000 {
            let mut wide = || {
                let (x, y) = (integer(&mut source), integer(&mut source));
                (x.min(y), x.max(y))
            };
            let ((a, b), (c, d)) = (wide(), wide());
            let x = Interval::spanned(double(a), double(b));
            let y = Interval::spanned(double(c), double(d));
            let inside = |i: Interval, exact: i128| {
                assert!(whole(i.low) <= exact && exact <= whole(i.high), "{x:?} and {y:?}: {exact} in {i:?}");
            };
            for p in [a, b, i64::midpoint(a, b)].map(i128::from) {
                for q in [c, d, i64::midpoint(c, d)].map(i128::from) {
                    inside(x * y, p * q);
                    inside(x + y, p + q);
                    inside(x - y, p - q);
                }
                inside(x.magnitude(), p.abs());
            }
        }
    }

    #[test]
    fn roots_contain_the_exact_root() {
        let mut source = Source::new(3);
        for _ in 0..100_000 {
            let x = double(integer(&mut source)).abs();
            let Interval { low, high } = Interval::new(x).root();
            // root² − x, without rounding: both terms are exact.
            let beyond = |r: f64| (r * r - x) + r.mul_add(r, -(r * r));
            assert!(beyond(low) <= 0.0 && beyond(high) >= 0.0, "{low} ≤ √{x} ≤ {high}");
        }
    }

    #[test]
    fn extremes_stay_bounds() {
        let tiny = Interval::new(f64::MIN_POSITIVE) * Interval::new(-0.3);
        assert!(tiny.low < tiny.high && tiny.high <= 0.0, "{tiny:?}");
        let nothing = Interval::new(1e-200) * Interval::new(1e-200);
        assert!(nothing.low < 0.0 && nothing.high > 0.0, "{nothing:?}");
        let huge = Interval::new(f64::MAX) + Interval::new(f64::MAX);
        assert!(huge.low == f64::MAX && huge.high == f64::INFINITY, "{huge:?}");
        assert!((huge - huge).low == f64::NEG_INFINITY, "nothing is known of the difference");
        assert!(Interval::new(f64::NAN).high == f64::INFINITY, "nor of what is no number");
    }
}
