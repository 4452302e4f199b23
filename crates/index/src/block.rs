//! Blocks of sixteen points.

use bytemuck::{Pod, Zeroable};
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, f32x16, mask32x16, u32x16};
use nearmiss_lanes::wide::{WIDTH, spread_out};

/// Sixteen consecutive points of a scan, stored by coordinate. Point `i` is in block `i` /
/// [`Self::WIDTH`].
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct PointBlock {
    /// Coordinates of the points; 1e30, too far to be a neighbour, in unused lanes.
    pub position: [[f32; WIDTH]; 3],
    /// Support radius of each point; zero in unused lanes.
    pub support_radius: [f32; WIDTH],
}

impl PointBlock {
    /// The number of points in a full block.
    pub const WIDTH: usize = WIDTH;

    /// A block without points.
    pub const EMPTY: Self = Self { position: [[1e30; Self::WIDTH]; 3], support_radius: [0.0; Self::WIDTH] };

    /// Returns the position of point `i` of `blocks`.
    ///
    /// # Panics
    /// If there is no such point.
    #[inline(always)]
    #[must_use]
    pub fn position_in(blocks: &[Self], i: usize) -> [f32; 3] {
        let (block, lane) = (&blocks[i / WIDTH], i % WIDTH);
        [block.position[0][lane], block.position[1][lane], block.position[2][lane]]
    }

    /// Returns a block of at most [`Self::WIDTH`] points with support radius zero.
    #[must_use]
    pub fn of(positions: &[[f32; 3]]) -> Self {
        let mut block = Self::EMPTY;
        block.place(positions);
        block
    }

    /// Sets the positions of the first points; of all if there are more.
    #[inline(always)]
    pub fn place(&mut self, positions: &[[f32; 3]]) {
        spread_out(positions, &mut self.position);
    }

    /// Returns the blocks of all points of a scan, with support radius zero.
    #[must_use]
    pub fn without_support(positions: &[[f32; 3]]) -> impl ExactSizeIterator<Item = Self> {
        positions.chunks(Self::WIDTH).map(Self::of)
    }
}

impl PointBlock {
    /// Finds the points whose distance from `x` is less than `distance` plus their support radius.
    /// Writes `first` plus the lane of each, ascending, to the front of `lanes` and returns their
    /// number; the rest of `lanes` is unspecified. No branch depends on the outcome, which would be
    /// unpredictable.
    #[inline(always)]
    pub fn supporting<S: Simd>(
        &self,
        simd: S,
        x: [f32; 3],
        distance: f32,
        first: u32,
        lanes: &mut [u32; WIDTH],
    ) -> usize {
        let [px, py, pz] = &self.position;
        let (dx, dy, dz) = (
            f32x16::load_array_ref(simd, px) - x[0],
            f32x16::load_array_ref(simd, py) - x[1],
            f32x16::load_array_ref(simd, pz) - x[2],
        );
        let far = f32x16::load_array_ref(simd, &self.support_radius) + distance;
        let supporting: mask32x16<S> = (dx * dx + dy * dy + dz * dz).simd_lt(far * far);
        if let Level::Avx512(_) = simd.level() {
            let ids = u32x16::load_array_ref(simd, &LANES) + first;
            simd.compress_u32x16(ids, supporting).store_slice(&mut lanes[..]);
            return supporting.to_bitmask().count_ones() as usize;
        }
        let [low, high, ..] = supporting.to_bitmask().to_le_bytes();
        let count = low.count_ones() as usize;
        for i in 0..8 {
            lanes[i] = first + u32::from(BITS[usize::from(low)][i]);
        }
        for i in 0..8 {
            lanes[count + i] = first + 8 + u32::from(BITS[usize::from(high)][i]);
        }
        count + high.count_ones() as usize
    }
}

const LANES: [u32; WIDTH] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];

/// The positions of the set bits of each byte, ascending, followed by zeros.
const BITS: [[u8; 8]; 256] = {
    let mut places = [[0; 8]; 256];
    let mut byte = 0;
    while byte < 256 {
        let (mut bit, mut count) = (0_u8, 0);
        while bit < 8 {
            if byte >> bit & 1 != 0 {
                places[byte][count] = bit;
                count += 1;
            }
            bit += 1;
        }
        byte += 1;
    }
    places
};
