//! Times and counts of methods that follow frames.

use nearmiss::{Evidence, MovingScan, Verdict};
use nearmiss_benches::Failure;
use nearmiss_benches::clock::{nanoseconds, timed};
use nearmiss_benches::sample::count;

/// Positions of all frames.
pub(crate) type Frames = Vec<Vec<[f64; 3]>>;

/// Times in microseconds.
#[derive(Debug, Default)]
pub(crate) struct Times(pub(crate) Vec<f64>);

impl Times {
    pub(crate) fn of<R>(&mut self, work: impl FnOnce() -> R) -> R {
        let (result, time) = timed(work);
        self.0.push(nanoseconds(time) / 1e3);
        result
    }

    pub(crate) fn row(mut self, name: &str) {
        self.0.sort_by(f64::total_cmp);
        let (n, total) = (self.0.len(), self.0.iter().sum::<f64>());
        if n > 0 {
            println!("| {name} | {:.1} | {:.1} | {:.1} |", total / count(n), self.0[n / 2], self.0[n - 1]);
        }
    }
}

/// Follows frames by one method alone, from `first` on, with questions about each frame. Each frame is
/// written to the same memory just before, as by a simulation or a camera. Prints two rows: for calls from a
/// thread of the pool, and for calls from outside of it.
pub(crate) fn alone(
    name: &str,
    frames: &Frames,
    first: &MovingScan,
    follow: impl Fn(&mut MovingScan, &[[f64; 3]]) -> Result<(), Failure> + Sync,
    mut ask: impl FnMut(&MovingScan, &[[f64; 3]]) -> Result<(), Failure> + Send,
) -> Result<(), Failure> {
    let mut pass = || {
        let (mut times, mut now, mut scan) = (Times::default(), Vec::new(), first.clone());
        for frame in frames {
            now.clone_from(frame);
            times.of(|| follow(&mut scan, &now))?;
            ask(&scan, &now)?;
        }
        Ok::<_, Failure>(times)
    };
    // Messages, as errors of any type may not pass between threads.
    rayon::scope(|_| pass().map_err(|failure| failure.to_string()))?.row(name);
    pass()?.row(&format!("{name}, from outside of the pool"));
    Ok(())
}

pub(crate) fn heading(what: &str) {
    println!("\n## {what}\n\n| µs | mean | median | most |\n| --- | --: | --: | --: |");
}

/// Counts over all frames and poses, of refitted, renewed and rebuilt scans.
#[derive(Debug, Default)]
pub(crate) struct Totals {
    /// Verdicts that differ from those of a scan prepared anew, and those beyond the band.
    pub(crate) differ: [usize; 2],
    pub(crate) beyond: [usize; 2],
    /// Certified separations.
    pub(crate) proven: [usize; 3],
    pub(crate) apart: usize,
    /// Points fitted anew by refits, in all frames and at most.
    pub(crate) fitted: usize,
    pub(crate) most: usize,
    pub(crate) loosest: f64,
}

pub(crate) fn is_proof(verdict: &Verdict) -> bool {
    matches!(verdict, Verdict::Separated { evidence: Evidence::Certified, .. })
}
