//! Constant time per query (Klein & Zachmann 2004, §5.4).
//!
//! After a query that exceeds its time, the next one has fewer test points and a greater tolerance.
//! After a query with time to spare that tested any leaves, the next one has more test points and a
//! smaller tolerance. A deadline limits each query in any case.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::ask::answer::Answer;
use crate::ask::budget::{Budget, Deadline, now};
use crate::ask::options::{CollidePlan, MOST_TEST_POINTS, Method, Sampling};

/// The share by which the number of test points grows or shrinks. The tolerance changes by a
/// quarter of it.
const STEP: f64 = 0.125;

/// Fewer test points are meaningless.
const LEAST_TEST_POINTS: u32 = 8;

/// Tolerances in sampling radii. Below this range nothing would be found, above it everything.
const TOLERANCES: std::ops::RangeInclusive<f64> = 0.1..=1.0;

/// A query that took more than this share of its time does not get more test points.
const ENOUGH: f64 = 0.9;

/// The number of test points per leaf, adapted so that successive queries take the same time. Owned
/// by the caller and updated in the order of the queries: one for each pair of scans, or one for
/// all.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pacer {
    target: Duration,
    sampling: Sampling,
}

impl Pacer {
    /// Creates a pacer for queries of duration `target` (`t_max` in Klein & Zachmann 2004),
    /// starting with the default test.
    #[must_use]
    pub fn new(target: Duration) -> Self {
        Self { target, sampling: Sampling::default() }
    }

    /// The same pacer with this test for the next query.
    #[must_use]
    pub const fn with_sampling(self, sampling: Sampling) -> Self {
        Self { sampling, ..self }
    }

    /// Returns the test of the next query. The test points are limited to 8 to 65,536 and the
    /// tolerance to 0.1 to 1.
    #[must_use]
    pub fn sampling(&self) -> Sampling {
        // `clamp` would let NaN through.
        let tolerance = self.sampling.tolerance.max(*TOLERANCES.start()).min(*TOLERANCES.end());
        let test_points = self.sampling.test_points.clamp(LEAST_TEST_POINTS, MOST_TEST_POINTS);
        self.sampling.with_tolerance(tolerance).with_test_points(test_points)
    }

    /// Returns the target duration of a query.
    #[must_use]
    pub const fn target(&self) -> Duration {
        self.target
    }

    /// Calls `ask` with the pacer's budget and with `plan`. If the method is [`Method::Sampling`],
    /// the plan's test points are replaced by the pacer's, which are then adapted to the time that
    /// `ask` took. Other methods have nothing to adapt.
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

    /// Adapts the test points to a query that took the time `spent`.
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
        // Small numbers change by at least one test point.
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
