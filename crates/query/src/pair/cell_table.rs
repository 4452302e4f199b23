//! The probability that two volumes share well-filled cells (Klein & Zachmann, slides on
//! average-case collision detection, 2003).
//!
//! The intersection of two bounding volumes is cut into s cells, of which a fills `filled_a` well and
//! b `filled_b`. If every placement of these cells among the s is equally likely, the number c of
//! cells that both fill is hypergeometric:
//!
//! `Pr[c ≥ x] = 1 − Σ_{t < x} C(s_a, t) C(s − s_a, s_b − t) / C(s, s_b)`.
//!
//! Smooth sheets that are near and parallel are not placed independently. The probability therefore
//! orders pairs of nodes and never prunes one.

use std::ops::Mul;

/// The number of cells s.
const CELLS: usize = nearmiss_hierarchy::CELLS as usize;

/// Entries along each side of the table: counts of 0 to s.
const SIDE: usize = CELLS + 1;

/// The greatest number x of shared cells.
pub(crate) const MOST_SHARED: u32 = 16;

/// The mean of c for two counts of filled cells. It orders pairs as the probability does, and does
/// not saturate.
#[inline(always)]
pub(crate) fn expected<V: Mul<Output = V> + Mul<f32, Output = V>>([a, b]: [V; 2]) -> V {
    a * b * (1.0 / CELLS as f32)
}

/// `Pr[c < x]` for every pair of counts. The complement keeps its precision where a collision is all
/// but certain.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CellTable {
    shared: u32,
    /// Row by row; empty until first used.
    fewer: Vec<f32>,
}

impl CellTable {
    /// A table for `shared` cells or more, x in the formula.
    pub(crate) fn new(shared: u32) -> Self {
        let mut logs = [0.0_f64; SIDE];
        for k in 1..SIDE {
            #[expect(clippy::cast_precision_loss, reason = "at most 64")]
            let log = (k as f64).ln();
            logs[k] = logs[k - 1] + log;
        }
        let binomial = |n: usize, k: usize| logs[n] - logs[k] - logs[n - k];
        let mut fewer = vec![0.0; SIDE * SIDE];
        for (at, fewer) in fewer.iter_mut().enumerate() {
            let (a, b) = (at / SIDE, at % SIDE);
            // At least a + b − s cells are shared, at most the lesser count.
            let (least, most) = ((a + b).saturating_sub(CELLS), a.min(b));
            let sum: f64 = (least..(shared as usize).min(most + 1))
                .map(|t| (binomial(a, t) + binomial(CELLS - a, b - t) - binomial(CELLS, b)).exp())
                .sum();
            #[expect(clippy::cast_possible_truncation, reason = "a probability")]
            let sum = sum.min(1.0) as f32;
            *fewer = sum;
        }
        Self { shared, fewer }
    }

    /// The number of cells that the table is for.
    pub(crate) fn shared(&self) -> u32 {
        self.shared
    }

    /// A lower bound of the mean of c where `Pr[c < x]` is at most `threshold`, by Markov's inequality:
    /// `Pr[c ≥ x]` is at most the mean of c divided by x.
    #[inline]
    pub(crate) fn least_expected(&self, threshold: f32) -> f32 {
        // Less the rounding of the table.
        (1.0 - threshold - 1e-6) * self.shared as f32
    }

    /// `Pr[c < x]` for two counts of 0 to s, interpolated between whole counts.
    #[inline]
    pub(crate) fn fewer(&self, filled: [f32; 2]) -> f32 {
        #[expect(clippy::cast_precision_loss, reason = "at most 64")]
        let most = CELLS as f32;
        let [a, b] = filled.map(|count| count.max(0.0).min(most));
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 63")]
        let [i, j] = [a, b].map(|count| (count as usize).min(CELLS - 1));
        #[expect(clippy::cast_precision_loss, reason = "at most 64")]
        let (u, v) = (a - i as f32, b - j as f32);
        let [low, high] = [i * SIDE + j, (i + 1) * SIDE + j];
        let Some([p, q]) = self.fewer.get(low..low + 2).and_then(|two| <[f32; 2]>::try_from(two).ok()) else {
            return 1.0;
        };
        let Some([r, s]) = self.fewer.get(high..high + 2).and_then(|two| <[f32; 2]>::try_from(two).ok())
        else {
            return 1.0;
        };
        (1.0 - u) * ((1.0 - v) * p + v * q) + u * ((1.0 - v) * r + v * s)
    }
}

#[cfg(test)]
mod tests {
    use nearmiss_testdata::arbitrary::rng;
    use rand::RngExt;
    use rand::seq::SliceRandom;

    use super::*;

    /// The values of docs/theory, and a simulation of cells that are placed at random.
    #[test]
    fn the_table_is_that_of_cells_placed_at_random() {
        let rng = &mut rng(2211);
        let mut cells: Vec<usize> = (0..CELLS).collect();
        for (a, b) in [(20_u16, 15_u16), (5, 3), (60, 40), (1, 64), (33, 33)] {
            for shared in [1, 3, 5, 8] {
                let table = CellTable::new(shared);
                let rounds = 20_000;
                let fewer = (0..rounds).filter(|_| {
                    cells.shuffle(rng);
                    let both = cells[..usize::from(a)].iter().filter(|&&cell| cell < usize::from(b)).count();
                    both < shared as usize
                });
                let simulated = fewer.count() as f32 / rounds as f32;
                let found = table.fewer([f32::from(a), f32::from(b)]);
                assert!((found - simulated).abs() < 0.015, "{a}, {b}, {shared}: {found}, {simulated}");
            }
        }
        for (shared, expected) in [(1, 0.9986), (3, 0.9223), (5, 0.5386), (8, 0.0391)] {
            let found = 1.0 - CellTable::new(shared).fewer([20.0, 15.0]);
            assert!((found - expected).abs() < 1e-4, "{shared}: {found}");
        }
    }

    #[test]
    fn pairs_that_count_have_the_least_mean() {
        let rng = &mut rng(2212);
        let mut closest = f32::INFINITY;
        for shared in [1, 4, MOST_SHARED] {
            let table = CellTable::new(shared);
            for _ in 0..200_000 {
                let filled = [(); 2].map(|()| rng.random_range(0.0..64.0_f32));
                let (mean, least) = (expected(filled), table.least_expected(table.fewer(filled)));
                assert!(mean >= least, "{filled:?}, {shared}: {mean}, {least}");
                closest = closest.min(mean - least);
            }
        }
        assert!(closest < 0.1, "{closest}");
    }

    #[test]
    fn more_filled_cells_make_a_collision_likelier() {
        for shared in [1, 2, 10, MOST_SHARED] {
            let table = CellTable::new(shared);
            for a in 0..u16::from(nearmiss_hierarchy::CELLS) {
                for step in 0..40_u8 {
                    let (b, a) = (f32::from(step) * 1.6, f32::from(a));
                    let own = table.fewer([a, b]);
                    assert!((0.0..=1.0).contains(&own));
                    assert!(table.fewer([a + 0.7, b]) <= own + 1e-6);
                    assert!((table.fewer([b, a]) - own).abs() < 1e-5);
                }
            }
            assert_eq!(table.fewer([0.0, 64.0]), 1.0);
        }
    }
}
