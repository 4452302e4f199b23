//! The one place of this member that reads a clock.

use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// Clock reads from which [`cost`] takes the least.
const READS: u32 = 1000;

/// Of the times that Linux tells of a process.
const MILLIS_A_TICK: u64 = 10;

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

/// Processor time that this process has spent, on all its threads, to a hundredth of a second; where the
/// system does not tell, the time that has passed. Unlike a clock it leaves out what other programs take.
#[must_use]
pub fn processor_time() -> Duration {
    static START: OnceLock<Instant> = OnceLock::new();
    // After the name, which is in parentheses: user and system time are the twelfth and thirteenth field.
    let told = std::fs::read_to_string("/proc/self/stat").ok().and_then(|text| {
        let fields: Vec<&str> = text.rsplit_once(')')?.1.split_whitespace().collect();
        let ticks = |i: usize| fields.get(i)?.parse::<u64>().ok();
        Some(Duration::from_millis(MILLIS_A_TICK * (ticks(11)? + ticks(12)?)))
    });
    told.unwrap_or_else(|| START.get_or_init(now).elapsed())
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
