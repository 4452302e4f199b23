//! Weighted sums over the points near x, relative to x.
//!
//! A point contributes if x is within its support radius.

use fearless_simd::{
    Level, Simd, SimdBase, SimdFrom, SimdMask, dispatch, f32x4, f32x8, f32x16, mask32x8, mask32x16,
};

use nearmiss_index::PointBlock;

use crate::gathered::{GROWN, Gathered, HALF, half_of};
use crate::{Kernel, SurfacePlan};

/// Weighted sums over a neighbourhood, relative to the point x for which they were taken.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Moments {
    /// Σw.
    pub(crate) weight: f64,
    /// Σw(p−x).
    pub(crate) first: [f64; 3],
    /// Σw(p−x)(p−x)ᵀ as xx xy xz yy yz zz.
    pub(crate) second: [f64; 6],
    /// Σw·R.
    pub(crate) support_radius: f64,
    /// The least d²/h².
    pub(crate) nearest: f32,
    /// Number of points.
    pub(crate) support: u32,
}

impl Moments {
    /// Sums over the points of all `blocks` that have `x` within their support radius. `level` is
    /// the instruction set to use; it does not affect the result.
    #[must_use]
    pub fn about(
        level: Level,
        plan: &SurfacePlan,
        x: [f64; 3],
        blocks: impl IntoIterator<Item = PointBlock>,
    ) -> Self {
        let x = Centre::new(x);
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || {
                let mut near = Neighbourhood::new(simd, plan, &x);
                for block in blocks {
                    near.offer(simd, &block);
                }
                near.moments(simd)
            },
        ))
    }
}

/// A block of points with explicit distances, such as distances along a graph.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredBlock {
    /// The points; the support radius is zero in unused lanes.
    pub points: PointBlock,
    /// Distance of each point from x, which determines its weight. A point counts if this is less
    /// than its support radius.
    pub distance: [f32; WIDTH],
}

impl MeasuredBlock {
    /// A block without points.
    pub const EMPTY: Self = Self { points: PointBlock::EMPTY, distance: [f32::INFINITY; WIDTH] };
}

impl Moments {
    /// Sums over the points of all `blocks`, weighted by the given distances from `x`.
    ///
    /// The distance to the nearest point remains Euclidean, because it decides whether x can be on
    /// the surface, and a path along the surface does not measure the height above it. `level` is
    /// the instruction set to use and does not affect the result; the order of the points may.
    #[must_use]
    pub fn measured<'b>(
        level: Level,
        plan: &SurfacePlan,
        x: [f64; 3],
        blocks: impl IntoIterator<Item = &'b MeasuredBlock>,
    ) -> Self {
        let x = Centre::new(x);
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || {
                let mut near = Neighbourhood::new(simd, plan, &x);
                for block in blocks {
                    near.offer_measured(simd, block);
                }
                near.moments(simd)
            },
        ))
    }
}

/// A point split into the nearest `f32` and the remainder. Differences from stored points thus keep
/// their precision: (p − high) is exact for a near p, and `low` is subtracted afterwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Centre {
    high: [f32; 3],
    low: [f32; 3],
}

impl Centre {
    /// Splits `x`.
    #[must_use]
    #[inline]
    #[expect(clippy::cast_possible_truncation, reason = "the rest is kept in `low`")]
    pub fn new(x: [f64; 3]) -> Self {
        let high = x.map(|c| c as f32);
        let low = [0, 1, 2].map(|k| (x[k] - f64::from(high[k])) as f32);
        Self { high, low }
    }

    /// Returns x rounded to single precision.
    #[inline]
    #[must_use]
    pub fn rounded(&self) -> [f32; 3] {
        self.high
    }
}

const WIDTH: usize = PointBlock::WIDTH;

/// Scratch memory for half a block, between the passes of [`Neighbourhood::offer_all`].
#[derive(Debug, Clone, Copy, Default)]
#[repr(align(64))]
pub struct HalfBlock {
    /// d²/h² of the points, then their weights.
    lanes: [f32; HALF],
    /// Index of the half block: 2b for the lower half of block b, 2b + 1 for the upper half.
    id: u32,
}

/// Running sums over the points that have x within their support radius.
///
/// A point adds to the lane of its index modulo 8; points too far from x add zero. Blocks come in
/// ascending order, so the sums depend neither on blocks without contributing points, nor on the
/// register width of the machine. All methods are inlined into a caller compiled for some
/// instruction set.
#[derive(Debug, Clone, Copy)]
pub struct Neighbourhood<'a, S: Simd> {
    plan: &'a SurfacePlan,
    high: [f32; 3],
    low: [f32; 3],
    weight: f32x8<S>,
    first: [f32x8<S>; 3],
    second: [f32x8<S>; 6],
    support_radius: f32x8<S>,
    nearest: f32x8<S>,
    support: u32,
}

impl<'a, S: Simd> Neighbourhood<'a, S> {
    /// Creates the sums of no points, relative to `x`.
    #[inline(always)]
    #[must_use]
    pub fn new(simd: S, plan: &'a SurfacePlan, x: &Centre) -> Self {
        let zero = f32x8::simd_from(simd, 0.0);
        Self {
            plan,
            high: x.high,
            low: x.low,
            weight: zero,
            first: [zero; 3],
            second: [zero; 6],
            support_radius: zero,
            nearest: f32x8::simd_from(simd, f32::INFINITY),
            support: 0,
        }
    }

    /// Adds the points of a block that have x within their support radius.
    #[inline(always)]
    pub fn offer(&mut self, simd: S, block: &PointBlock) {
        let (t, _) = self.distances(simd, block, self.plan.decays(simd, block));
        let (low, high) = simd.split_f32x16(t);
        let (low, high) = (self.weights(simd, low), self.weights(simd, high));
        self.add_half(simd, block, 0, low);
        self.add_half(simd, block, 1, high);
    }

    /// Adds the blocks with indices `supporting`, ascending, as [`Self::offer`] does. Moves the indices of
    /// those with a point that has x within its support radius to the front, and returns their number; by
    /// rounding, others may be among them. `decays` has the [decays](SurfacePlan::decays) of each block. If
    /// it is empty they are computed here, by a division that takes a third of the time. `halves` is scratch
    /// memory; its contents afterwards are unspecified.
    ///
    /// Computes first the distances for all blocks, then the weights, then the sums. This avoids an
    /// unpredictable branch on whether a half block contributes: of the blocks near x about every
    /// other half does not. It also keeps dependency chains short enough for out-of-order
    /// execution, and the constants of the kernel and the sums do not compete for registers.
    #[inline(always)]
    pub fn offer_all(
        &mut self,
        simd: S,
        (blocks, decays): (&[PointBlock], &[[f32; WIDTH]]),
        supporting: &mut [u32],
        halves: &mut Vec<HalfBlock>,
    ) -> usize {
        let most = 2 * supporting.len() + 1;
        if halves.len() < most {
            halves.resize(most, HalfBlock::default());
        }
        let (halves, mut count, mut kept) = (&mut halves[..most], 0, 0);
        for i in 0..supporting.len() {
            let id = supporting[i];
            if let (Some(block), Some([one, other, ..])) =
                (blocks.get(id as usize), halves.get_mut(count..).and_then(<[_]>::first_chunk_mut::<2>))
            {
                let decay = match decays.get(id as usize) {
                    Some(decay) => f32x16::load_array_ref(simd, decay),
                    None => self.plan.decays(simd, block),
                };
                let (t, [any_low, any_high]) = self.distances(simd, block, decay);
                let (low, high) = simd.split_f32x16(t);
                *one = HalfBlock { lanes: low.to_array(), id: 2 * id };
                let next = if any_low { other } else { one };
                *next = HalfBlock { lanes: high.to_array(), id: 2 * id + 1 };
                count += usize::from(any_low) + usize::from(any_high);
                let is_near: mask32x16<S> = t.simd_lt(self.plan.reach_sq() * GROWN);
                supporting[kept] = id;
                kept += usize::from(is_near.any_true());
            }
        }
        for half in &mut halves[..count] {
            half.lanes = self.weights(simd, f32x8::load_array_ref(simd, &half.lanes)).to_array();
        }
        for half in &halves[..count] {
            if let Some(block) = blocks.get(half.id as usize / 2) {
                self.add_half(simd, block, half.id as usize % 2, f32x8::load_array_ref(simd, &half.lanes));
            }
        }
        kept
    }

    /// Adds gathered points, as [`Self::offer_all`] adds those of blocks, in the same passes.
    #[inline(always)]
    pub fn offer_gathered(&mut self, simd: S, points: &mut Gathered) {
        let (kernel, reach_sq) = (self.plan.kernel(), self.plan.reach_sq());
        let (rows, load) = (points.rows(), f32x8::load_array_ref);
        for row in &mut *rows {
            let [x, y, z] = self.relative(simd, [&row.position[0], &row.position[1], &row.position[2]]);
            let t = (x * x + y * y + z * z) * load(simd, &row.decay);
            let counts: mask32x8<S> = t.simd_lt(reach_sq);
            self.support += counts.to_bitmask().count_ones();
            self.nearest = self.nearest.min(t);
            row.from = [x.to_array(), y.to_array(), z.to_array()];
            row.weights = t.to_array();
        }
        for row in &mut *rows {
            let t = load(simd, &row.weights);
            row.weights = weights(simd, kernel, reach_sq, t).to_array();
        }
        for row in rows {
            let from = [load(simd, &row.from[0]), load(simd, &row.from[1]), load(simd, &row.from[2])];
            self.add(from, load(simd, &row.support_radius), load(simd, &row.weights));
        }
    }

    /// Adds the points of a block whose given distance is less than their support radius.
    #[inline(always)]
    fn offer_measured(&mut self, simd: S, block: &MeasuredBlock) {
        let distance = f32x16::load_array_ref(simd, &block.distance);
        let decay = self.plan.decays(simd, &block.points);
        let t = distance * distance * decay;
        let counts: mask32x16<S> = t.simd_lt(self.plan.reach_sq());
        let support = self.support + counts.to_bitmask().count_ones();
        let (straight, _) = self.distances(simd, &block.points, decay);
        let straight = simd.select_f32x16(counts, straight, f32x16::simd_from(simd, f32::INFINITY));
        let (low, high) = simd.split_f32x16(straight);
        let nearest = self.nearest.min(low.min(high));
        let (low, high) = simd.split_f32x16(t);
        let (low, high) = (self.weights(simd, low), self.weights(simd, high));
        self.add_half(simd, &block.points, 0, low);
        self.add_half(simd, &block.points, 1, high);
        (self.nearest, self.support) = (nearest, support);
    }

    /// Returns d²/h² of the points of a block with these decays, and for each half whether any point
    /// contributes. Counts the contributing points.
    #[inline(always)]
    fn distances(&mut self, simd: S, block: &PointBlock, decay: f32x16<S>) -> (f32x16<S>, [bool; 2]) {
        let [px, py, pz] = &block.position;
        let (high, low) = (self.high, self.low);
        let x = (f32x16::load_array_ref(simd, px) - high[0]) - low[0];
        let y = (f32x16::load_array_ref(simd, py) - high[1]) - low[1];
        let z = (f32x16::load_array_ref(simd, pz) - high[2]) - low[2];
        let t = (x * x + y * y + z * z) * decay;
        let counts: mask32x16<S> = t.simd_lt(self.plan.reach_sq());
        let bits = counts.to_bitmask();
        self.support += bits.count_ones();
        (t, [bits & 0xff != 0, bits >> HALF != 0])
    }

    /// Returns the weights of points with these d²/h²; zero for points too far from x.
    #[inline(always)]
    fn weights(&mut self, simd: S, t: f32x8<S>) -> f32x8<S> {
        self.nearest = self.nearest.min(t);
        weights(simd, self.plan.kernel(), self.plan.reach_sq(), t)
    }

    /// Adds the points of half a block, given their weights.
    #[inline(always)]
    fn add_half(&mut self, simd: S, block: &PointBlock, half: usize, w: f32x8<S>) {
        let [x, y, z] = &block.position;
        let place = self.relative(simd, [half_of(x, half), half_of(y, half), half_of(z, half)]);
        let support_radius = f32x8::load_array_ref(simd, half_of(&block.support_radius, half));
        self.add(place, support_radius, w);
    }

    /// Returns the places of points relative to x.
    #[inline(always)]
    fn relative(&self, simd: S, [px, py, pz]: [&[f32; HALF]; 3]) -> [f32x8<S>; 3] {
        let (high, low) = (self.high, self.low);
        [
            (f32x8::load_array_ref(simd, px) - high[0]) - low[0],
            (f32x8::load_array_ref(simd, py) - high[1]) - low[1],
            (f32x8::load_array_ref(simd, pz) - high[2]) - low[2],
        ]
    }

    /// Adds points at `x`, `y`, `z` relative to the centre, given their weights.
    #[inline(always)]
    fn add(&mut self, [x, y, z]: [f32x8<S>; 3], support_radius: f32x8<S>, w: f32x8<S>) {
        let (wx, wy, wz) = (w * x, w * y, w * z);
        self.weight += w;
        self.first[0] += wx;
        self.first[1] += wy;
        self.first[2] += wz;
        self.second[0] += wx * x;
        self.second[1] += wx * y;
        self.second[2] += wx * z;
        self.second[3] += wy * y;
        self.second[4] += wy * z;
        self.second[5] += wz * z;
        self.support_radius += w * support_radius;
    }

    /// Returns the sums over all lanes.
    #[inline(always)]
    #[must_use]
    pub fn moments(&self, simd: S) -> Moments {
        let [x, y, z] = self.first;
        let [xx, xy, xz, yy, yz, zz] = self.second;
        let [weight, x, y, z] = totals(simd, [self.weight, x, y, z]);
        let [xx, xy, xz, yy] = totals(simd, [xx, xy, xz, yy]);
        let [yz, zz, support_radius, _] = totals(simd, [yz, zz, self.support_radius, self.support_radius]);
        let (low, high) = simd.split_f32x8(self.nearest);
        let [a, b, c, d] = low.min(high).to_array();
        let nearest = a.min(b).min(c.min(d));
        let (first, second) = ([x, y, z], [xx, xy, xz, yy, yz, zz]);
        Moments { weight, first, second, support_radius, nearest, support: self.support }
    }
}

/// Returns the weights of points with these d²/h²; zero for points too far away.
#[inline(always)]
fn weights<S: Simd>(simd: S, kernel: Kernel, reach_sq: f32, t: f32x8<S>) -> f32x8<S> {
    let counts: mask32x8<S> = t.simd_lt(reach_sq);
    simd.select_f32x8(counts, kernel.weights(simd, t), f32x8::simd_from(simd, 0.0))
}

/// Returns the sum over the lanes of each register. The halves are added first, then the last four
/// lanes of four registers at once.
#[inline(always)]
fn totals<S: Simd>(simd: S, [a, b, c, d]: [f32x8<S>; 4]) -> [f64; 4] {
    let (a, b, c, d) = (half(simd, a), half(simd, b), half(simd, c), half(simd, d));
    let ac = simd.zip_low_f32x4(a, c) + simd.zip_high_f32x4(a, c);
    let bd = simd.zip_low_f32x4(b, d) + simd.zip_high_f32x4(b, d);
    let [a, b, c, d] = (simd.zip_low_f32x4(ac, bd) + simd.zip_high_f32x4(ac, bd)).to_array();
    [f64::from(a), f64::from(b), f64::from(c), f64::from(d)]
}

#[inline(always)]
fn half<S: Simd>(simd: S, lanes: f32x8<S>) -> f32x4<S> {
    let (low, high) = simd.split_f32x8(lanes);
    low + high
}
