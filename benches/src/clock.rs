//! The one place of this member that reads a clock.

use std::time::{Duration, Instant};

/// Clock reads from which [`cost`] takes the least.
const READS: u32 = 1000;

/// Now.
#[must_use]
#[expect(clippy::disallowed_methods, reason = "benchmarks are what a clock is for")]
pub fn now() -> Instant {
    Instant::now()
}

/// What `work` returns, and how long it took, one read of the clock included.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, Duration) {
    let start = now();
    let result = work();
    (result, start.elapsed())
}

/// How long an empty measurement takes, in nanoseconds: the mean of many. It is part of every time that is
/// reported for a single query, and not taken off.
#[must_use]
pub fn cost() -> f64 {
    let total: Duration = (0..READS).map(|_| timed(|| ()).1).sum();
    nanoseconds(total) / f64::from(READS)
}

/// A duration in nanoseconds.
#[must_use]
pub fn nanoseconds(time: Duration) -> f64 {
    time.as_secs_f64() * 1e9
}
