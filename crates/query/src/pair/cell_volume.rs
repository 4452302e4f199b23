//! Bounding volumes as the estimate of the probability of a collision sees them.

use nearmiss_hierarchy::{Ball, OrientedBox};
use nearmiss_lanes::vector::{dot, sub};

use crate::pair::cell_table::CellTable;

/// A bounding volume whose intersection with another one has a volume. Both are in one frame.
pub trait CellVolume {
    /// Returns the volume.
    fn volume(&self) -> f32;

    /// Returns the volume of the intersection with `other`, or an estimate from above; 0 if they are
    /// disjoint.
    fn common(&self, other: &Self) -> f32;
}

impl CellVolume for OrientedBox {
    fn volume(&self) -> f32 {
        self.half.iter().map(|half| 2.0 * half).product()
    }

    /// The lesser of the volumes that the extents of each box along the axes of the other cut out of
    /// it. Exact for boxes with common axes.
    fn common(&self, other: &Self) -> f32 {
        let cut = |own: &Self, other: &Self| -> f32 {
            let d = sub(other.centre, own.centre);
            let along = |k: usize| {
                let reach: f32 = (0..3).map(|j| other.half[j] * dot(own.axes[k], other.axes[j]).abs()).sum();
                let most = 2.0 * own.half[k].min(reach);
                (own.half[k] + reach - dot(own.axes[k], d).abs()).clamp(0.0, most)
            };
            along(0) * along(1) * along(2)
        };
        cut(self, other).min(cut(other, self))
    }
}

impl CellVolume for Ball {
    #[expect(clippy::cast_possible_truncation, reason = "an estimate")]
    fn volume(&self) -> f32 {
        (4.0 / 3.0 * std::f64::consts::PI * self.radius.powi(3)) as f32
    }

    /// The volume of the lens, exactly.
    fn common(&self, other: &Self) -> f32 {
        let (r, s) = (self.radius.max(other.radius), self.radius.min(other.radius));
        let d = (0..3).map(|k| other.centre[k] - self.centre[k]).fold(0.0, f64::hypot);
        if d >= r + s {
            return 0.0;
        }
        if d <= r - s {
            return Self { radius: s, ..*self }.volume();
        }
        let caps = (r + s - d).powi(2) * (d * d + 2.0 * d * (r + s) - 3.0 * (r - s).powi(2)) / (12.0 * d);
        #[expect(clippy::cast_possible_truncation, reason = "an estimate")]
        let volume = (std::f64::consts::PI * caps) as f32;
        volume
    }
}

/// Returns the numbers of cells of the intersection of two volumes that each surface fills well,
/// given the numbers of well-filled cells of the volumes.
///
/// The intersection is cut into as many cells as each volume is. They are smaller, so a surface of
/// the same area per volume fills more of them: a count is scaled by the cube root of the share of its
/// volume.
pub(crate) fn filled_cells<V: CellVolume>([a, b]: [&V; 2], counts: [f32; 2]) -> [f32; 2] {
    let common = a.common(b);
    let scaled =
        |volume: &V, count: f32| count * (common / (volume.volume() + f32::MIN_POSITIVE)).min(1.0).cbrt();
    [scaled(a, counts[0]), scaled(b, counts[1])]
}

/// The estimate of the probability that the surfaces in two bounding volumes collide, for bounding
/// volumes of any kind (Klein & Zachmann, slides on average-case collision detection, 2003).
///
/// The intersection of the volumes is cut into [`CELLS`](nearmiss_hierarchy::CELLS) cells. The estimate
/// is the probability that at least a given number of them are well filled by both surfaces, if
/// every placement of the well-filled cells is equally likely.
#[derive(Debug, Clone, PartialEq)]
pub struct CellOdds(CellTable);

impl CellOdds {
    /// Prepares the estimate for at least `shared` common cells, 1 to 16.
    #[must_use]
    pub fn new(shared: u32) -> Self {
        Self(CellTable::new(shared.clamp(1, crate::pair::cell_table::MOST_SHARED)))
    }

    /// Returns the probability of a collision of the surfaces in `a` and `b`, given the numbers of
    /// cells of each volume that its surface fills well, of [`CELLS`](nearmiss_hierarchy::CELLS).
    #[must_use]
    pub fn probability<V: CellVolume>(&self, a: &V, b: &V, filled: [f32; 2]) -> f32 {
        1.0 - self.0.fewer(filled_cells([a, b], filled))
    }
}

#[cfg(test)]
mod tests {
    use nearmiss_hierarchy::CELLS;
    use nearmiss_testdata::arbitrary::{point_in, rng, rotation};
    use rand::RngExt;
    use rand::seq::SliceRandom;

    use super::*;

    type Random = rand_xoshiro::Xoshiro256PlusPlus;

    #[expect(clippy::cast_possible_truncation, reason = "single precision")]
    fn oriented(rng: &mut Random, turned: bool) -> OrientedBox {
        let pose = rotation(rng);
        let axis = |k: usize| {
            let mut axis = [0.0; 3];
            axis[k] = 1.0;
            if turned { pose.rotate(axis) } else { axis }.map(|x| x as f32)
        };
        let half = [0, 1, 2].map(|_| rng.random_range(0.3..1.2));
        let axes = [axis(0), axis(1), axis(2)];
        OrientedBox { centre: point_in(rng, 0.6).map(|x| x as f32), half, axes, reach: 0.0 }
    }

    fn ball(rng: &mut Random) -> Ball {
        Ball { centre: point_in(rng, 0.6), radius: rng.random_range(0.4..1.3) }
    }

    /// The shares of both volumes that their intersection takes up, and its volume, by points at
    /// random.
    fn simulated(rng: &mut Random, holds: [&dyn Fn([f64; 3]) -> bool; 2]) -> [f64; 3] {
        let (mut of_a, mut of_b, mut both) = (0, 0, 0);
        let rounds = 200_000;
        for _ in 0..rounds {
            let p = point_in(rng, 2.8);
            let [a, b] = [holds[0](p), holds[1](p)];
            (of_a, of_b, both) = (of_a + i32::from(a), of_b + i32::from(b), both + i32::from(a && b));
        }
        let [a, b, both] = [of_a, of_b, both].map(f64::from);
        [both / a.max(1.0), both / b.max(1.0), both * 5.6_f64.powi(3) / f64::from(rounds)]
    }

    /// The probability that at least `shared` of the cells are filled by both, by placing them at
    /// random.
    fn placed(rng: &mut Random, filled: [f64; 2], shared: usize) -> f64 {
        let mut cells: Vec<u8> = (0..CELLS).collect();
        let rounds = 20_000;
        let hits = (0..rounds).filter(|_| {
            // A fraction of a cell is filled with this probability.
            let [a, b] = filled.map(|count| {
                let more = rng.random_bool(count.fract());
                count.floor() + f64::from(u8::from(more))
            });
            cells.shuffle(rng);
            let both = (0_u8..).zip(&cells).take_while(|(i, _)| f64::from(*i) < a);
            both.filter(|(_, cell)| f64::from(**cell) < b).count() >= shared
        });
        hits.count() as f64 / f64::from(rounds)
    }

    /// Compares volumes and odds with simulations. Returns `true` if the intersection was estimated
    /// well.
    fn check<V: CellVolume>(
        rng: &mut Random,
        [a, b]: [&V; 2],
        holds: [&dyn Fn([f64; 3]) -> bool; 2],
    ) -> bool {
        let [share_a, share_b, volume] = simulated(rng, holds);
        let common = f64::from(a.common(b));
        assert!((f64::from(b.common(a)) - common).abs() <= 1e-5 * common, "not symmetric");
        // Never below, up to the noise of the simulation.
        assert!(common > 0.9 * volume - 0.02, "{common}, simulated {volume}");
        let counts = [rng.random_range(10..60_u8), rng.random_range(10..60_u8)];
        let odds = CellOdds::new(4).probability(a, b, counts.map(f32::from));
        let is_exact = (common - volume).abs() < 0.1 * volume + 0.02;
        if is_exact && volume > 0.4 {
            let filled = [f64::from(counts[0]) * share_a.cbrt(), f64::from(counts[1]) * share_b.cbrt()];
            let expected = placed(rng, filled, 4);
            assert!((f64::from(odds) - expected).abs() < 0.07, "{odds}, simulated {expected}, {filled:?}");
        }
        is_exact
    }

    #[test]
    fn odds_of_balls_are_those_of_a_simulation() {
        let rng = &mut rng(2241);
        for _ in 0..40 {
            let (a, b) = (ball(rng), ball(rng));
            let within = |ball: &Ball, p: [f64; 3]| {
                (0..3).map(|k| p[k] - ball.centre[k]).fold(0.0, f64::hypot) <= ball.radius
            };
            assert!(check(rng, [&a, &b], [&|p| within(&a, p), &|p| within(&b, p)]), "{a:?}, {b:?}");
        }
    }

    #[test]
    fn odds_of_boxes_are_those_of_a_simulation() {
        let rng = &mut rng(2242);
        for turned in [false, true] {
            let mut exact = 0;
            for _ in 0..40 {
                let (a, b) = (oriented(rng, turned), oriented(rng, turned));
                #[expect(clippy::cast_possible_truncation, reason = "single precision")]
                let within =
                    |bounds: &OrientedBox, p: [f64; 3]| bounds.distance_sq(p.map(|x| x as f32)) == 0.0;
                exact += u32::from(check(rng, [&a, &b], [&|p| within(&a, p), &|p| within(&b, p)]));
            }
            // Turned boxes are estimated from above.
            assert!(turned || exact == 40, "{exact} of 40");
        }
    }
}
