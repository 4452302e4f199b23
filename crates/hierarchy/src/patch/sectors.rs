//! Sectors of the tangent plane of a point: a border shows as a wide one without a neighbour.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, i32x16, mask32x16};

/// The number of sectors of the tangent plane. They have equal shares of the perimeter of a
/// diamond, so they are 11 to 18 degrees wide.
const SECTORS: u32 = 24;

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
        let counts: mask32x16<S> = d_sq.simd_lt(support_radius * support_radius) & length.simd_gt(0.0);
        self.0 |= simd.select_i32x16(counts, bit(sector), i32x16::splat(simd, 0));
    }

    /// Returns the greatest number of adjacent sectors without a point.
    #[inline(always)]
    pub(crate) fn widest_gap(self) -> u32 {
        widest_gap_beside(self.0.to_array().into_iter().fold(0, |all, bits| all | bits))
    }

    /// Returns the same for each lane alone, where each has a point of its own.
    #[inline(always)]
    pub(crate) fn gaps(self) -> [u32; 16] {
        self.0.to_array().map(widest_gap_beside)
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
