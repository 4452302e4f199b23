//! Times of single queries, and their summary.

/// Times in nanoseconds, one per query.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sample {
    times: Vec<f64>,
}

/// Mean, median, 99th percentile and worst of a sample.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Summary {
    /// Arithmetic mean.
    pub mean: f64,
    /// Median.
    pub median: f64,
    /// 99th percentile (nearest rank).
    pub p99: f64,
    /// Largest.
    pub worst: f64,
}

impl Sample {
    /// Adds a time.
    pub fn push(&mut self, nanoseconds: f64) {
        self.times.push(nanoseconds);
    }

    /// Adds all of `other`.
    pub fn extend(&mut self, other: &Self) {
        self.times.extend_from_slice(&other.times);
    }

    /// The number of times.
    #[must_use]
    pub fn len(&self) -> usize {
        self.times.len()
    }

    /// Returns `true` if there are no times.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.times.is_empty()
    }

    /// The summary of the times; zeros for an empty sample.
    #[must_use]
    pub fn summary(&self) -> Summary {
        let mut sorted = self.times.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let Some(&worst) = sorted.last() else {
            return Summary::default();
        };
        let mean = sorted.iter().sum::<f64>() / count(sorted.len());
        Summary { mean, median: quantile(&sorted, 0.5), p99: quantile(&sorted, 0.99), worst }
    }
}

/// The least of the sorted values that at least this share of them does not exceed. `share` is in
/// (0, 1].
///
/// # Panics
/// When there are no values.
#[must_use]
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "between 0 and the number of values"
)]
pub fn quantile(sorted: &[f64], share: f64) -> f64 {
    sorted[(share * count(sorted.len())).ceil().max(1.0) as usize - 1]
}

/// Converts a count to floating point.
#[must_use]
#[expect(clippy::cast_precision_loss, reason = "counts here are far below 2^52")]
pub fn count(n: usize) -> f64 {
    n as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn summaries_are_of_ranks() {
        let mut sample = Sample::default();
        assert_eq!(sample.summary(), Summary::default());
        (1..=101).rev().for_each(|i| sample.push(f64::from(i)));
        assert_eq!(sample.summary(), Summary { mean: 51.0, median: 51.0, p99: 100.0, worst: 101.0 });
    }
}
