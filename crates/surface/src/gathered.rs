//! Points near a place, gathered from their blocks for several evaluations of f there.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16};
use nearmiss_index::PointBlock;
use nearmiss_lanes::wide::{bits, seen_from, squared};

use crate::SurfacePlan;

const WIDTH: usize = PointBlock::WIDTH;

/// Number of points in half a block, which fills one AVX2 register. Half blocks are more often
/// without a contributing point than blocks, and their sums fit into the available registers.
pub(crate) const HALF: usize = WIDTH / 2;

/// Bound on the relative rounding error of a comparison of distances.
pub(crate) const GROWN: f32 = 1.0 + 1e-5;

/// Bound on the rounding error of a position and of a distance from it, relative to the greatest
/// coordinate of the position.
const ROUNDING: f32 = 1e-6;

/// The number of rows for which memory is taken at first; most places need about thirty.
const USUAL_ROWS: usize = 64;

/// Half a block of points.
#[derive(Debug, Clone, Copy, Default)]
#[repr(align(64))]
pub(crate) struct Row {
    pub(crate) position: [[f32; HALF]; 3],
    pub(crate) support_radius: [f32; HALF],
    /// 1/h²; infinite in unused lanes.
    pub(crate) decay: [f32; HALF],
    /// The places of the points relative to that of the last evaluation.
    pub(crate) from: [[f32; HALF]; 3],
    /// d²/h² of the points there, then their weights.
    pub(crate) weights: [f32; HALF],
}

/// Half blocks, one after the other, that hold points which support f at positions near a place.
///
/// They are about half of those in the blocks whose support comes there. As the others add nothing,
/// the sums of a [`Neighbourhood`](crate::Neighbourhood) have the same bits as with all blocks.
#[derive(Debug, Clone, Default)]
pub struct Gathered {
    rows: Vec<Row>,
    /// The number of rows in use.
    count: usize,
}

impl Gathered {
    /// Gathers half blocks with points that support positions up to `distance` from `place`.
    /// `supporting` are the indices, ascending, of the blocks that may hold any. Compiled for the
    /// instruction set of the caller; does not allocate once warm.
    #[inline(always)]
    pub fn gather<S: Simd>(
        &mut self,
        simd: S,
        plan: &SurfacePlan,
        (blocks, supporting): (&[PointBlock], &[u32]),
        place: [f32; 3],
        distance: f32,
    ) {
        let most = 2 * supporting.len() + 1;
        if self.rows.len() < most {
            self.rows.resize(most.max(USUAL_ROWS), Row::default());
        }
        let (rows, mut count) = (&mut self.rows[..most], 0);
        let slack = place.iter().fold(distance, |slack, c| slack + ROUNDING * c.abs());
        for &id in supporting {
            let Some(block) = blocks.get(id as usize) else { continue };
            let d_sq = squared(seen_from(simd, &block.position, place));
            let support_radius = f32x16::load_array_ref(simd, &block.support_radius);
            let far = (support_radius + slack) * GROWN;
            let lanes = bits(d_sq.simd_le(far * far));
            let (low, high) = simd.split_f32x16(plan.decays(simd, block));
            // No branch depends on the outcome, which is unpredictable.
            for (half, decay) in [low, high].into_iter().enumerate() {
                if let Some(row) = rows.get_mut(count) {
                    let [x, y, z] = &block.position;
                    row.position = [*half_of(x, half), *half_of(y, half), *half_of(z, half)];
                    row.support_radius = *half_of(&block.support_radius, half);
                    row.decay = decay.to_array();
                }
                count += usize::from(lanes >> (HALF * half) & 0xff != 0);
            }
        }
        self.count = count;
    }

    #[inline(always)]
    pub(crate) fn rows(&mut self) -> &mut [Row] {
        self.rows.get_mut(..self.count).unwrap_or_default()
    }
}

/// Returns the lower or the upper half of sixteen lanes.
#[inline(always)]
pub(crate) fn half_of(lanes: &[f32; WIDTH], half: usize) -> &[f32; HALF] {
    let halves: &[[f32; HALF]; 2] = bytemuck::cast_ref(lanes);
    &halves[half]
}
