//! Sectors of the tangent plane of a point: a border shows as a wide one without a neighbour.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, i32x16, mask32x16};

/// The number of sectors of the tangent plane. They have equal shares of the perimeter of a
/// diamond, so they are 11 to 18 degrees wide.
const SECTORS: u32 = 24;

/// The bits of all sectors.
const ROUND: i32 = (1 << SECTORS) - 1;

/// The square of the least cosine of the angle between the tangent plane and the way to a point that counts:
/// 76°. A point below, as on the other side of a board, shows no direction along the sheet.
const STEEP_SQ: f32 = 0.06;

/// The sectors of the tangent plane of a point with points that support it, as bits, in lanes.
pub(crate) struct Taken<S: Simd>(i32x16<S>);

impl<S: Simd> Taken<S> {
    #[inline(always)]
    pub(crate) fn new(simd: S) -> Self {
        Self(i32x16::splat(simd, 0))
    }

    /// Adds those of sixteen points that have the point within their support radius. `d_sq` are their
    /// squared distances from it, `x` and `y` their coordinates in its tangent plane.
    #[inline(always)]
    pub(crate) fn add(
        &mut self,
        simd: S,
        support_radius: f32x16<S>,
        d_sq: f32x16<S>,
        [x, y]: [f32x16<S>; 2],
    ) {
        let length = x.abs() + y.abs();
        // The angle on the diamond |x| + |y| = 1, from 0 to 4, one for each quarter turn, without
        // trigonometry.
        let share = x / length;
        let quarter = simd.select_f32x16(y.simd_ge(0.0), -(share - 1.0), share + 3.0);
        let turn = quarter * (SECTORS as f32 / 4.0);
        let sector = simd.select_f32x16(turn.simd_lt(SECTORS as f32), turn, f32x16::splat(simd, 0.0));
        let is_beside: mask32x16<S> = (x * x + y * y).simd_gt(d_sq * STEEP_SQ);
        let counts = d_sq.simd_lt(support_radius * support_radius) & is_beside;
        self.0 |= simd.select_i32x16(counts, bit(sector), i32x16::splat(simd, 0));
    }

    /// Returns the greatest number of adjacent sectors without a point.
    #[inline(always)]
    pub(crate) fn widest_gap(self) -> u32 {
        widest_gap_beside(self.0.to_array().into_iter().fold(0, |all, bits| all | bits))
    }

    /// Returns the same for each lane alone, where each has a point of its own; 0 for lanes other than
    /// those of `lanes`.
    #[inline(always)]
    pub(crate) fn gaps(self, simd: S, lanes: mask32x16<S>) -> [i32; 16] {
        let (zero, one) = (i32x16::splat(simd, 0), i32x16::splat(simd, 1));
        let free = simd.select_i32x16(lanes, self.0 ^ ROUND, zero);
        let (mut runs, mut widest) = (free, zero);
        // After k steps a bit remains for each run longer than k.
        for _ in 0..SECTORS {
            let remains: mask32x16<S> = runs.simd_gt(zero);
            if !remains.any_true() {
                break;
            }
            widest += simd.select_i32x16(remains, one, zero);
            runs &= ((runs << 1) | (runs >> (SECTORS - 1))) & ROUND;
        }
        widest.to_array()
    }
}

/// Returns the greatest number of adjacent sectors beside those `taken`.
#[inline(always)]
fn widest_gap_beside(taken: i32) -> u32 {
    let taken = u64::from(taken.cast_unsigned());
    // Repeated, so that a run across the start counts whole.
    let round = taken | taken << SECTORS;
    // After k steps a bit remains for each run longer than k.
    let (mut runs, mut widest) = (!round & ((1 << (2 * SECTORS)) - 1), 0);
    while runs != 0 {
        runs &= runs >> 1;
        widest += 1;
    }
    widest.min(SECTORS)
}

/// Returns the bit of each number from 0 to 30, rounded down: the power of two, made as a
/// floating-point number.
#[inline(always)]
fn bit<S: Simd>(number: f32x16<S>) -> i32x16<S> {
    const ONE: i32 = 127;
    const DIGITS: u32 = 23;
    let exponent = i32x16::truncate_from(number) + ONE;
    let power: f32x16<S> = (exponent << DIGITS).bitcast();
    i32x16::truncate_from(power)
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};
    use nearmiss_testdata::arbitrary::rng;
    use rand::RngExt;

    use super::*;

    #[test]
    fn gaps_in_lanes_are_those_of_a_walk_around_the_point() {
        let walk = |taken: i32| {
            let is_free = |i: u32| taken >> (i % SECTORS) & 1 == 0;
            let run = |start: u32| (start..start + SECTORS).take_while(|i| is_free(*i)).count();
            (0..SECTORS).map(run).max().unwrap()
        };
        let mut rng = rng(9);
        for step in 0..500 {
            let taken: [i32; 16] = std::array::from_fn(|lane| match (step, lane) {
                (0, 0) => 0,
                (0, 1) => ROUND,
                // Few sectors taken, or few free.
                _ => {
                    let [a, b, c] = [(); 3].map(|()| rng.random::<i32>() & ROUND);
                    if lane % 2 == 0 { a & b & c } else { a | b }
                }
            });
            let lanes: u16 = if step == 0 { u16::MAX } else { rng.random() };
            let found = dispatch!(Level::new(), simd => {
                Taken(i32x16::load_array_ref(simd, &taken))
                    .gaps(simd, mask32x16::from_bitmask(simd, u64::from(lanes)))
            });
            for lane in 0..16 {
                let expected = if lanes >> lane & 1 == 1 { walk(taken[lane]) } else { 0 };
                assert_eq!(usize::try_from(found[lane]), Ok(expected), "{:024b}", taken[lane]);
                if lanes >> lane & 1 == 1 {
                    assert_eq!(widest_gap_beside(taken[lane]) as usize, expected, "{:024b}", taken[lane]);
                }
            }
        }
    }
}
