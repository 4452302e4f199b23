//! The number of points to draw so that every surfel contains one.

/// Returns the probability that each of `surfels` equal surfels contains one of `points` points
/// drawn uniformly and independently, to 1e-7. By inclusion–exclusion it is Σₖ (−1)ᵏ C(a, k) (1 −
/// k/a)ⁿ; Klein & Zachmann 2005, Lemma 1 gives the limit for many surfels.
#[must_use]
pub fn occupancy(surfels: u32, points: u32) -> f64 {
    /// If this many surfels are expected to stay empty, all are occupied with a probability of
    /// 10⁻⁸.
    const HOPELESS: f64 = 18.0;
    let (a, n) = (f64::from(surfels), f64::from(points));
    if points < surfels || a * (n * (-1.0 / a).ln_1p()).exp() > HOPELESS {
        return 0.0;
    }
    let (mut sum, mut choices) = (1.0, 1.0);
    for k in 1..surfels {
        let left = f64::from(k);
        choices *= (a - left + 1.0) / left;
        let term = choices * (n * (-left / a).ln_1p()).exp();
        sum += if k % 2 == 0 { term } else { -term };
        if term < 1e-12 {
            break;
        }
    }
    sum.clamp(0.0, 1.0)
}

/// Returns the fewest points to draw so that the probability of an empty surfel is at most `error`.
///
/// O(log n) times the cost of [`occupancy`]. Returns 2³² − 1 if fewer points do not suffice.
#[must_use]
pub fn points_for(surfels: u32, error: f64) -> u32 {
    let (mut few, mut enough) = (surfels.saturating_sub(1), surfels.max(1));
    let suffices = |points: u32| points == u32::MAX || 1.0 - occupancy(surfels, points) <= error;
    while !suffices(enough) {
        few = enough;
        enough = enough.saturating_mul(2);
    }
    while enough - few > 1 {
        let middle = few + (enough - few) / 2;
        if suffices(middle) {
            enough = middle;
        } else {
            few = middle;
        }
    }
    enough
}

/// Returns n = a ln a + c a points, with which each of a surfels contains one with probability
/// `exp(−exp(−c))` (Klein & Zachmann 2005, Lemma 1). For ten surfels and more the true probability
/// is greater.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it saturates")]
pub(crate) fn points_to_draw(surfels: f64, probability: f64) -> u32 {
    let c = -(-probability.ln()).ln();
    (surfels * surfels.ln() + c * surfels).ceil().max(1.0) as u32
}

#[cfg(test)]
mod tests {
    use super::{occupancy, points_for, points_to_draw};

    /// The distribution of the number of occupied surfels, updated point by point.
    fn ball_by_ball(surfels: u32, points: u32) -> f64 {
        let a = f64::from(surfels);
        let mut occupied = vec![0.0; surfels as usize + 1];
        occupied[0] = 1.0;
        for _ in 0..points {
            let mut next = vec![0.0; occupied.len()];
            for (k, p) in (0_u32..).zip(&occupied) {
                let share = f64::from(k) / a;
                next[k as usize] += p * share;
                if k < surfels {
                    next[k as usize + 1] += p * (1.0 - share);
                }
            }
            occupied = next;
        }
        occupied[surfels as usize]
    }

    #[test]
    fn occupancy_equals_that_of_balls_in_bins() {
        for surfels in [1, 2, 5, 10, 30, 100] {
            for points in [0, 1, surfels, 2 * surfels, 3 * surfels, 5 * surfels, 10 * surfels] {
                let (found, expected) = (occupancy(surfels, points), ball_by_ball(surfels, points));
                assert!((found - expected).abs() < 1e-7, "{found} for {expected}, {points} in {surfels}");
            }
        }
        // docs/theory: Lemma 1 with c = 3.5 promises 0.970; these are the true probabilities.
        for (surfels, expected) in [(10, 0.980), (30, 0.974), (100, 0.972)] {
            let a = f64::from(surfels);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few hundred")]
            let found = occupancy(surfels, (a * a.ln() + 3.5 * a).ceil() as u32);
            assert!((found - expected).abs() < 2e-3, "{found} for {expected}");
        }
    }

    #[test]
    fn the_fewest_points_suffice_and_no_fewer_do() {
        for surfels in [1, 2, 30, 300, 20_000] {
            for error in [0.5, 0.03, 1e-3, 1e-6] {
                let points = points_for(surfels, error);
                assert!(1.0 - occupancy(surfels, points) <= error, "{points} for {surfels} do not suffice");
                assert!(points == 1 || 1.0 - occupancy(surfels, points - 1) > error, "{points} are too many");
            }
        }
        // Klein & Zachmann 2005, §4.1: about 200 points for 30 surfels. Lemma 1 requires a few more
        // than necessary.
        let asked = points_to_draw(30.0, 0.97);
        assert_eq!((asked, points_for(30, 0.03)), (207, 204), "Lemma 1, and exactly");
    }
}
