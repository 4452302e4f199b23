//! The same time for every query: S0 §5.4.
//!
//! A query that takes longer than it may has fewer test points and a greater tolerance next time; one that
//! has time left has more and a lesser one, if it came to test any. A time budget cuts off what is too long
//! all the same.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::ask::answer::Answer;
use crate::ask::budget::{Budget, Deadline, now};
use crate::ask::options::{CollidePlan, MOST_TEST_POINTS, Method, Sampling};

/// Test points grow and shrink by this share, the tolerance by a quarter of it.
const STEP: f64 = 0.125;

/// Fewer test points say nothing.
const LEAST_TEST_POINTS: u32 = 8;

/// Tolerances, in sampling radii, below which nothing would be found and above which everything would.
const TOLERANCES: std::ops::RangeInclusive<f64> = 0.1..=1.0;

/// A query that took more than this share of its time had enough to do.
const ENOUGH: f64 = 0.9;

/// How many test points leaves get, so that successive queries take the same time. Owned by the caller,
/// stepped in the order of the queries: one for each pair of scans, or one for all.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pacer {
    target: Duration,
    sampling: Sampling,
}

impl Pacer {
    /// Queries of `target` each (S0's `t_max`), the first of them with the default test.
    #[must_use]
    pub fn new(target: Duration) -> Self {
        Self { target, sampling: Sampling::default() }
    }

    /// The same pace, next with this test.
    #[must_use]
    pub const fn with_sampling(self, sampling: Sampling) -> Self {
        Self { sampling, ..self }
    }

    /// What the next query tests leaves with: 8 to 65,536 test points, a tolerance of 0.1 to 1, whatever was
    /// wanted.
    #[must_use]
    pub fn sampling(&self) -> Sampling {
        // `clamp` would let through what is no number.
        let tolerance = self.sampling.tolerance.max(*TOLERANCES.start()).min(*TOLERANCES.end());
        let test_points = self.sampling.test_points.clamp(LEAST_TEST_POINTS, MOST_TEST_POINTS);
        self.sampling.with_tolerance(tolerance).with_test_points(test_points)
    }

    /// How long a query is to take.
    #[must_use]
    pub const fn target(&self) -> Duration {
        self.target
    }

    /// Calls `ask` with the pacer's budget and with `plan`, whose test points are replaced by the pacer's if
    /// its method is [`Method::Sampling`]; then adapts the test points to the time that `ask` took. Other
    /// methods have nothing to adapt.
    ///
    /// ```
    /// # use std::time::Duration;
    /// # use nearmiss_query::{Answer, CollidePlan, Pacer, Pair, Scratch};
    /// fn frame(pair: Pair<'_>, plan: &CollidePlan, pacer: &mut Pacer, scratch: &mut Scratch) -> Answer {
    ///     pacer.pace(plan, |plan, budget| pair.within(budget).collide(plan, scratch))
    /// }
    /// ```
    pub fn pace(&mut self, plan: &CollidePlan, ask: impl FnOnce(&CollidePlan, &Budget) -> Answer) -> Answer {
        let start = now();
        let budget = Budget::UNLIMITED.with_deadline(Deadline::within(self.target));
        let Method::Sampling(Sampling { seed, flat, .. }) = plan.options().method else {
            return ask(plan, &budget);
        };
        let plan = plan.with_sampling(self.sampling().with_seed(seed).with_flat(flat));
        let answer = ask(&plan, &budget);
        self.adapt(now().saturating_duration_since(start), &answer);
        answer
    }

    /// Learns from a query that took so long.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count within bounds")]
    pub fn adapt(&mut self, spent: Duration, answer: &Answer) {
        let Sampling { test_points, tolerance, .. } = self.sampling();
        let step = if spent > self.target {
            1.0 - STEP
        } else if spent < self.target.mul_f64(ENOUGH)
            && answer.statistics.leaf_pairs > 0
            && !answer.verdict.is_intersecting()
        {
            1.0 + STEP
        } else {
            return;
        };
        let wanted = (f64::from(test_points) * step).round() as u32;
        // One test more or less is the least step of small numbers.
        let wanted = if step > 1.0 { wanted.max(test_points + 1) } else { wanted.min(test_points - 1) };
        let wider = 1.0 + 0.25 * (1.0 - step);
        self.sampling = self.sampling.with_test_points(wanted).with_tolerance(tolerance * wider);
        self.sampling = self.sampling();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ask::answer::{Evidence, Statistics, Verdict};

    fn answer(leaf_pairs: u64) -> Answer {
        Answer {
            band: f64::INFINITY,
            verdict: Verdict::Separated { gap: 0.0, evidence: Evidence::Estimated },
            distance_estimate: None,
            statistics: Statistics { leaf_pairs, ..Statistics::default() },
        }
    }

    #[test]
    fn a_pacer_settles_where_queries_take_their_time() {
        // Each test point takes two microseconds.
        for (target, wanted) in [(2000, 1000), (100, 50), (20, 10)] {
            let mut pacer = Pacer::new(Duration::from_micros(target));
            for _ in 0..200 {
                let spent = Duration::from_micros(2 * u64::from(pacer.sampling().test_points));
                pacer.adapt(spent, &answer(1));
            }
            let points = pacer.sampling().test_points;
            assert!((wanted * 8 / 10..=wanted * 11 / 10).contains(&points), "{points} for {target} µs");
        }
    }

    #[test]
    fn what_cannot_be_adapted_stays() {
        let mut pacer = Pacer::new(Duration::from_micros(100));
        let before = pacer.sampling();
        pacer.adapt(Duration::from_micros(10), &answer(0));
        assert_eq!(pacer.sampling(), before, "no leaves were tested");
        for _ in 0..1000 {
            pacer.adapt(Duration::from_secs(1), &answer(1));
        }
        assert_eq!(pacer.sampling().test_points, LEAST_TEST_POINTS);
        assert!((pacer.sampling().tolerance - 1.0).abs() < 1e-12, "{}", pacer.sampling().tolerance);
    }
}
