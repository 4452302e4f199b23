//! The only place of this crate that reads a clock.

use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// Clock reads that [`cost`] averages.
const READS: u32 = 1000;

/// Milliseconds in a tick, the unit of process times on Linux.
const MILLIS_A_TICK: u64 = 10;

/// The current time.
#[must_use]
#[expect(clippy::disallowed_methods, reason = "benchmarks are what a clock is for")]
pub fn now() -> Instant {
    Instant::now()
}

/// Runs `work`; returns its result and its duration, which includes one clock read.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, Duration) {
    let start = now();
    let result = work();
    (result, start.elapsed())
}

/// Processor time of this process, all threads together, to a hundredth of a second. Unlike
/// wall-clock time it excludes other programs. Returns the elapsed time where the system does not
/// report it.
#[must_use]
pub fn processor_time() -> Duration {
    static START: OnceLock<Instant> = OnceLock::new();
    // User and system time are the twelfth and thirteenth field after the name, which is in
    // parentheses.
    let told = std::fs::read_to_string("/proc/self/stat").ok().and_then(|text| {
        let fields: Vec<&str> = text.rsplit_once(')')?.1.split_whitespace().collect();
        let ticks = |i: usize| fields.get(i)?.parse::<u64>().ok();
        Some(Duration::from_millis(MILLIS_A_TICK * (ticks(11)? + ticks(12)?)))
    });
    told.unwrap_or_else(|| START.get_or_init(now).elapsed())
}

/// The mean duration of an empty measurement, in nanoseconds. It is part of every reported time of
/// a single query and is not subtracted.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn processor_time_passes_with_work() {
        let start = processor_time();
        let ((), spent) = timed(|| {
            while processor_time() < start + Duration::from_millis(50) {
                std::hint::black_box((0..10_000_u64).sum::<u64>());
            }
        });
        assert!(spent > Duration::from_millis(20), "{spent:?} for 50 ms of work");
    }
}
