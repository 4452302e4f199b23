//! Fixed-width integers for determinants that no floating-point expansion can hold.

/// Limbs for coordinates whose bits span at most [`SMALL_SPAN`] places.
pub(crate) const SMALL: usize = 4;

/// Greatest span, in bits, that fits [`SMALL`] limbs: a volume of coordinates below 2^D is a sum of
/// six products of three differences, each below 2^(D + 1), so it is below 2^(3 D + 6) ≤ 2^246.
pub(crate) const SMALL_SPAN: i32 = 80;

/// Limbs for coordinates whose bits span at most [`MEDIUM_SPAN`] places.
pub(crate) const MEDIUM: usize = 8;

/// As [`SMALL_SPAN`]: volumes are below 2^486.
pub(crate) const MEDIUM_SPAN: i32 = 160;

/// Limbs for any finite coordinates: they span 2098 bits, and a volume takes 6300 of 6400 bits.
pub(crate) const ANY: usize = 100;

/// Bits of the significand of an `f64` below its leading one.
const FRACTION: i32 = 52;

/// A signed integer in two's complement, least significant limb first. Arithmetic wraps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Wide<const N: usize>([u64; N]);

impl<const N: usize> Wide<N> {
    /// `x` / 2^`unit`. Exact if `unit` is at most the [`lowest_bit`] of `x` and the result fits.
    pub(crate) fn scaled(x: f64, unit: i32) -> Self {
        let (significand, exponent) = parts(x);
        let mut limbs = [0; N];
        if significand != 0 {
            let shift = usize::try_from(exponent - unit).unwrap_or(0);
            let (limb, bit) = (shift / 64, shift % 64);
            let placed = u128::from(significand) << bit;
            let halves = [placed & u128::from(u64::MAX), placed >> 64];
            for (target, half) in limbs.iter_mut().skip(limb).zip(halves) {
                *target = u64::try_from(half).unwrap_or(u64::MAX);
            }
        }
        let magnitude = Self(limbs);
        if x < 0.0 { magnitude.negated() } else { magnitude }
    }

    fn negated(self) -> Self {
        let mut carry = true;
        Self(self.0.map(|limb| {
            let (sum, over) = (!limb).overflowing_add(u64::from(carry));
            carry = over;
            sum
        }))
    }

    pub(crate) fn plus(&self, other: &Self) -> Self {
        let mut carry = false;
        let mut sum = [0; N];
        for (i, limb) in sum.iter_mut().enumerate() {
            let (partial, over) = self.0[i].overflowing_add(other.0[i]);
            let (total, over_again) = partial.overflowing_add(u64::from(carry));
            *limb = total;
            carry = over || over_again;
        }
        Self(sum)
    }

    pub(crate) fn minus(&self, other: &Self) -> Self {
        self.plus(&other.negated())
    }

    /// The lowest N limbs of the product. In two's complement they do not depend on the signs.
    pub(crate) fn times(&self, other: &Self) -> Self {
        let mut product = [0_u64; N];
        for i in 0..N {
            let mut carry = 0_u128;
            for j in 0..N - i {
                let sum = u128::from(self.0[i]) * u128::from(other.0[j]) + u128::from(product[i + j]) + carry;
                product[i + j] = u64::try_from(sum & u128::from(u64::MAX)).unwrap_or(u64::MAX);
                carry = sum >> 64;
            }
        }
        Self(product)
    }

    /// -1, 0 or 1.
    pub(crate) fn signum(&self) -> i32 {
        if self.0[N - 1] >> 63 == 1 { -1 } else { i32::from(self.0.iter().any(|&limb| limb != 0)) }
    }

    pub(crate) fn magnitude(self) -> Self {
        if self.signum() < 0 { self.negated() } else { self }
    }

    /// A nonnegative number as m · 2^e with m in [0.5, 1], or m = 0; m is off by at most 2^-52.
    fn rounded(&self) -> (f64, i32) {
        let Some(top) = self.0.iter().rposition(|&limb| limb != 0) else {
            return (0.0, 0);
        };
        let zeros = self.0[top].leading_zeros();
        let below = if top > 0 { self.0[top - 1] } else { 0 };
        let both = (u128::from(self.0[top]) << 64 | u128::from(below)) << zeros;
        let leading = u64::try_from(both >> 64).unwrap_or(u64::MAX);
        let bits = 64 * (top + 1) - zeros as usize;
        (leading as f64 / 2.0_f64.powi(64), i32::try_from(bits).unwrap_or(i32::MAX))
    }

    /// The quotient of two nonnegative numbers, `other` not zero. The relative error is at most
    /// 2^-51; a quotient below about 2^-1000 is returned as 0.
    pub(crate) fn ratio(&self, other: &Self) -> f64 {
        let (high, high_exponent) = self.rounded();
        let (low, low_exponent) = other.rounded();
        let exponent = high_exponent - low_exponent;
        if exponent < -1000 { 0.0 } else { high / low * 2.0_f64.powi(exponent.min(1000)) }
    }
}

/// The magnitude of `x` as an integer times a power of two.
fn parts(x: f64) -> (u64, i32) {
    let bits = x.to_bits();
    let fraction = bits & ((1 << FRACTION) - 1);
    let biased = i32::try_from(bits >> FRACTION & 0x7ff).unwrap_or(0);
    // Subnormal numbers have no leading one and the exponent of the least normal ones.
    if biased == 0 { (fraction, -1074) } else { (fraction | 1 << FRACTION, biased - 1075) }
}

/// The place of the lowest bit that `x` may have set; `None` for 0.
pub(crate) fn lowest_bit(x: f64) -> Option<i32> {
    (x != 0.0).then(|| parts(x).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wide(x: i64) -> Wide<3> {
        let magnitude = Wide([x.unsigned_abs(), 0, 0]);
        if x < 0 { magnitude.negated() } else { magnitude }
    }

    #[test]
    fn arithmetic_is_that_of_integers() {
        let numbers = [0, 1, -1, 5, -7, i64::MAX, -i64::MAX, 1 << 40, -(1 << 33) + 3];
        for a in numbers {
            for b in numbers {
                let sum = i128::from(a) + i128::from(b);
                let product = i128::from(a) * i128::from(b);
                let as_i128 = |w: Wide<3>| i128::from(w.0[0]) | (i128::from(w.0[1].cast_signed()) << 64);
                assert_eq!(as_i128(wide(a).plus(&wide(b))), sum, "{a} + {b}");
                assert_eq!(as_i128(wide(a).minus(&wide(-b))), sum, "{a} - {}", -b);
                assert_eq!(as_i128(wide(a).times(&wide(b))), product, "{a} * {b}");
                assert_eq!(wide(a).times(&wide(b)).signum(), i32::from(product.signum() as i8), "{a} {b}");
            }
        }
    }

    #[test]
    fn floats_are_scaled_exactly() {
        assert_eq!(Wide::<3>::scaled(-12.5, -49), wide(-25 << 48), "-12.5 in units of 2^-49");
        assert_eq!(Wide::<3>::scaled(0.0, -1074), wide(0), "zero");
        assert_eq!(Wide::<3>::scaled(f64::from_bits(3), -1074), wide(3), "subnormal");
        let large = Wide::<3>::scaled(2.0_f64.powi(100), 0);
        assert_eq!(large.0, [0, 1 << 36, 0], "2^100");
        let most = Wide::<ANY>::scaled(f64::MAX, -1074);
        assert_eq!(most.rounded().1, 1024 + 1074, "f64::MAX in units of the least subnormal");
    }

    #[test]
    fn ratios_are_accurate() {
        for (a, b) in [(1, 3), (0, 7), (2, 2), (i64::MAX, i64::MAX - 1), (12_345, 1 << 50)] {
            let expected = a as f64 / b as f64;
            let square = wide(b).times(&wide(b));
            assert!((wide(a).ratio(&wide(b)) - expected).abs() <= 1e-15 * expected, "{a} / {b}");
            let product = wide(a).times(&wide(b)).ratio(&square);
            assert!((product - expected).abs() <= 1e-15 * expected, "{a} {b} / {b}^2");
        }
    }
}
