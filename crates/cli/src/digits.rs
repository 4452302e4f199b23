//! Numbers formatted for people, with significant digits only.

/// The largest number of decimals that are written out.
const MOST_DECIMALS: i32 = 9;

/// Magnitudes that are written without an exponent, apart from zero.
const PLAIN: std::ops::Range<f64> = 1e-6..1e15;

/// The number of significant decimal digits of double precision.
const MOST_DIGITS: i32 = 15;

/// Formats a point, rounded to `unit` or finer.
pub(crate) fn place(p: [f64; 3], unit: f64) -> String {
    let [x, y, z] = p.map(|c| rounded(c, unit));
    format!("({x}, {y}, {z})")
}

/// Formats a length, rounded to `unit` or finer.
pub(crate) fn rounded(x: f64, unit: f64) -> String {
    let decimals = decimals(unit);
    // Values that round to zero need no exponent.
    let is_plain = PLAIN.contains(&x.abs()) || x.abs() < PLAIN.start.min(0.5 * unit);
    if let Some(decimals) = decimals.filter(|_| is_plain || x == 0.0) {
        let text = format!("{x:.decimals$}");
        let is_zero = text.bytes().all(|b| matches!(b, b'-' | b'0' | b'.'));
        return if is_zero { text.trim_start_matches('-').to_owned() } else { text };
    }
    if x == 0.0 {
        return "0".to_owned();
    }
    let digits = magnitude(x).saturating_sub(magnitude(unit)).clamp(2, MOST_DIGITS);
    let digits = usize::try_from(digits).unwrap_or(2);
    format!("{x:.digits$e}")
}

/// Formats a positive length, never rounding up, so that a lower bound stays one.
pub(crate) fn rounded_down(x: f64, unit: f64) -> String {
    moved_and_rounded(x, unit, -0.5)
}

/// Formats a positive length, never rounding down, so that an upper bound stays one.
pub(crate) fn rounded_up(x: f64, unit: f64) -> String {
    moved_and_rounded(x, unit, 0.5)
}

/// Formats a positive length that is moved by so many steps of its last digit before it is rounded.
fn moved_and_rounded(x: f64, unit: f64, steps: f64) -> String {
    match decimals(unit) {
        Some(decimals) if x >= unit && PLAIN.contains(&x) => {
            let step = 0.1_f64.powi(i32::try_from(decimals).unwrap_or(0));
            rounded((x + steps * step).max(0.0), unit)
        }
        _ => short(x * (1.0 + 0.01 * steps)),
    }
}

/// Formats the bounds of a length, the lower one rounded down and the upper one up, to `unit` or to a
/// thousandth of the upper one.
pub(crate) fn bounds([lower, upper]: [f64; 2], unit: f64) -> [String; 2] {
    let unit = unit.max(upper / 1000.0);
    [rounded_down(lower, unit), rounded_up(upper, unit)]
}

/// Returns the number of decimals that show `unit`, or `None` if there are more than
/// [`MOST_DECIMALS`].
fn decimals(unit: f64) -> Option<usize> {
    #[expect(clippy::cast_possible_truncation, reason = "the cast saturates")]
    let decimals = (-unit.log10()).ceil() as i32;
    if decimals > MOST_DECIMALS { None } else { usize::try_from(decimals.max(0)).ok() }
}

/// Formats a number with three significant digits.
pub(crate) fn short(x: f64) -> String {
    significant(x, 3)
}

/// Formats a number with two significant digits.
pub(crate) fn rough(x: f64) -> String {
    significant(x, 2)
}

/// Formats a length that has to be sufficient, rounded up to two significant digits.
pub(crate) fn short_up(x: f64) -> String {
    significant(x * 1.05, 2)
}

fn significant(x: f64, digits: i32) -> String {
    if x == 0.0 {
        return "0".to_owned();
    }
    if !x.is_finite() {
        return x.to_string();
    }
    if !PLAIN.contains(&x.abs()) {
        let digits = usize::try_from(digits - 1).unwrap_or(2);
        return format!("{x:.digits$e}");
    }
    let decimals = usize::try_from(digits - 1 - magnitude(x)).unwrap_or(0);
    let text = format!("{x:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Returns the power of ten of the first digit; for zero, the least integer.
#[expect(clippy::cast_possible_truncation, reason = "the cast saturates")]
fn magnitude(x: f64) -> i32 {
    x.abs().log10().floor() as i32
}

/// Formats the size of a file.
#[expect(clippy::cast_precision_loss, reason = "for people")]
pub(crate) fn bytes(n: u64) -> String {
    match n {
        0..10_000 => format!("{n} bytes"),
        10_000..1_000_000 => format!("{:.1} kB", n as f64 / 1e3),
        _ => format!("{:.1} MB", n as f64 / 1e6),
    }
}

/// Formats a number with the thing that it counts, `thing` being the singular.
pub(crate) fn count(n: u64, thing: &str) -> String {
    match thing.strip_suffix("leaf") {
        Some(start) if n != 1 => format!("{n} {start}leaves"),
        _ => format!("{n} {thing}{}", if n == 1 { "" } else { "s" }),
    }
}

/// As [`count`], with the digits of the number in groups of three.
pub(crate) fn grouped_count(n: u64, thing: &str) -> String {
    format!("{} {thing}{}", grouped(n), if n == 1 { "" } else { "s" })
}

/// Formats several numbers with the things that they count, leaving out zeros; empty if all are
/// zero.
pub(crate) fn counts<'a>(things: impl IntoIterator<Item = (u64, &'a str)>) -> String {
    let things = things.into_iter().filter(|(n, _)| *n > 0);
    things.map(|(n, thing)| count(n, thing)).collect::<Vec<_>>().join(", ")
}

/// Formats the work of a search and its time.
pub(crate) fn work<'a>(things: impl IntoIterator<Item = (u64, &'a str)>, micros: f64) -> String {
    let counts = counts(things);
    let divider = if counts.is_empty() { "" } else { ", " };
    format!("{counts}{divider}{micros:.1} µs")
}

/// Formats a whole number with its digits in groups of three.
pub(crate) fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::with_capacity(digits.len() + digits.len() / 3);
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// Formats a share in whole percent.
pub(crate) fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_carry_the_digits_that_mean_something() {
        assert_eq!(rounded(0.123_456, 0.001), "0.123");
        assert_eq!(rounded(0.123_456, 0.000_4), "0.1235", "finer than the unit, never coarser");
        assert_eq!(rounded(1234.567, 12.0), "1235");
        assert_eq!(rounded(-1e-17, 0.001), "0.000", "a zero has no sign and no exponent");
        assert_eq!(
            [short(0.001_234_5), short(1234.5), short(0.5), short(0.0)],
            ["0.00123", "1234", "0.5", "0"]
        );
        assert_eq!(short_up(0.050_1), "0.053", "enough, not nearest");
        assert_eq!(rough(2.71e-11), "2.7e-11");
    }

    #[test]
    fn large_numbers_are_grouped() {
        let shown = [0, 999, 1000, 12_345, 100_000, 1_234_567].map(grouped);
        assert_eq!(shown, ["0", "999", "1,000", "12,345", "100,000", "1,234,567"]);
    }

    #[test]
    fn counts_have_plurals_and_no_zeros() {
        assert_eq!(counts([(1, "leaf"), (0, "edge"), (2, "leaf"), (3, "edge")]), "1 leaf, 2 leaves, 3 edges");
        assert_eq!(work([(0, "node pair")], 1.25), "1.2 µs");
        assert_eq!(work([(1, "node pair"), (0, "leaf pair")], 0.5), "1 node pair, 0.5 µs");
    }

    #[test]
    fn very_large_and_very_small_ones_have_an_exponent() {
        assert_eq!(rounded(1.5e-12, 1e-14), "1.50e-12");
        assert_eq!(rounded(-1.234_567e20, 1e16), "-1.2346e20");
        assert_eq!(rounded(5e-7, 1e-8), "5.00e-7");
        assert_eq!(rounded(0.0, 1e-14), "0");
        assert_eq!(rounded(2.0, 0.0), "2.000000000000000e0", "no unit, all digits");
        assert_eq!([short(1.234e-9), short(5e9), short(1e16)], ["1.23e-9", "5000000000", "1.00e16"]);
    }

    #[test]
    fn bounds_stay_bounds() {
        for (x, unit) in [
            (0.123_46, 0.001),
            (0.000_999_9, 0.001),
            (3.999_6e17, 1e14),
            (9.999e-9, 1e-11),
            (1_391.332_04, 0.000_3),
            (1.004_9, 2.0),
            (0.018_447, 0.02),
        ] {
            let [low, high]: [f64; 2] =
                [rounded_down(x, unit), rounded_up(x, unit)].map(|text| text.parse().unwrap());
            assert!(low <= x && low > 0.98 * x, "{low} for {x}");
            assert!(high >= x && high < 1.02 * x, "{high} for {x}");
        }
        assert_eq!(bounds([1_391.332_04, 1_391.4], 0.000_3), ["1391", "1392"]);
        assert_eq!(bounds([0.0, 0.055_31], 0.001), ["0", "0.056"]);
    }
}
