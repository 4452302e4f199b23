//! Parsers of option values.

use std::time::Duration;

/// Parses a length of zero or more.
pub(crate) fn parse_radius(text: &str) -> Result<f64, String> {
    let radius = text.parse().ok().filter(|r: &f64| *r >= 0.0 && r.is_finite());
    radius.ok_or_else(|| "expected a length of zero or more, in world units".into())
}

/// Parses a length of more than zero.
pub(crate) fn parse_length(text: &str) -> Result<f64, String> {
    let length = text.parse().ok().filter(|l: &f64| *l > 0.0 && l.is_finite());
    length.ok_or_else(|| "expected a length of more than zero, in the units of the input".into())
}

/// Parses a limit of the work.
pub(crate) fn parse_work(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_not_a_count| "expected a whole number of zero or more, such as 2000".into())
}

/// Parses a time with its unit.
pub(crate) fn parse_duration(text: &str) -> Result<Duration, String> {
    let unit =
        text.trim_start_matches(|c: char| c.is_ascii_digit() || matches!(c, '.' | '+' | 'e' | 'E' | '-'));
    let number = text.strip_suffix(unit).unwrap_or_default();
    let seconds = match unit {
        "ns" => 1e-9,
        "us" | "µs" | "μs" => 1e-6,
        "ms" => 1e-3,
        "s" => 1.0,
        _ => return Err("expected a number with the unit ns, us, ms or s, such as 200us".into()),
    };
    let time = number.parse::<f64>().ok().and_then(|n| Duration::try_from_secs_f64(n * seconds).ok());
    time.ok_or_else(|| "expected a time of zero or more, such as 200us".into())
}

/// The largest number of threads; more do not help, and may not start.
const MOST_THREADS: usize = 1024;

/// Parses a number of threads.
pub(crate) fn parse_threads(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(n) if n <= MOST_THREADS => Ok(n),
        _ => Err(format!("expected a number from 0 (all cores) to {MOST_THREADS}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_need_a_unit() {
        for (text, nanos) in
            [("200us", 200_000), ("1.5ms", 1_500_000), ("20ns", 20), ("0s", 0), ("3µs", 3000)]
        {
            assert_eq!(parse_duration(text).map(|d| d.as_nanos()), Ok(nanos), "{text}");
        }
        for text in ["", "200", "us", "-1us", "1 us", "1min", "nans", "1e400s"] {
            assert!(parse_duration(text).is_err(), "{text}");
        }
    }
}
