//! The points that f(x) needs, relative to x, and their weighted moments.

use crate::{Kernel, SurfacePlan};

/// Lanes of the sums: enough for one AVX register, two of SSE2 or NEON. Their order is fixed, so the sums are
/// the same whatever the machine.
const LANES: usize = 8;

/// Weighted sums over a neighbourhood, relative to the point it was gathered about.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Moments {
    /// Σw.
    pub(crate) weight: f64,
    /// Σw(p−x).
    pub(crate) first: [f64; 3],
    /// Σw(p−x)(p−x)ᵀ as xx xy xz yy yz zz.
    pub(crate) second: [f64; 6],
    /// Σw·h.
    pub(crate) bandwidth: f64,
    /// The least d²/h².
    pub(crate) nearest: f32,
}

/// A point split into the nearest `f32` and the rest, so that differences from stored points keep their
/// digits: (p − high) is exact for a near p, and the rest is then taken off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Centre {
    high: [f32; 3],
    low: [f32; 3],
}

impl Centre {
    /// The split of `x`.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "the rest is kept in `low`")]
    pub fn new(x: [f64; 3]) -> Self {
        let high = x.map(|c| c as f32);
        let low = [0, 1, 2].map(|k| (x[k] - f64::from(high[k])) as f32);
        Self { high, low }
    }

    /// p − x.
    #[inline]
    #[must_use]
    pub fn offset(&self, p: [f32; 3]) -> [f32; 3] {
        let ([x, y, z], [lx, ly, lz]) = (self.high, self.low);
        [(p[0] - x) - lx, (p[1] - y) - ly, (p[2] - z) - lz]
    }

    /// x in single precision.
    #[inline]
    #[must_use]
    pub fn rounded(&self) -> [f32; 3] {
        self.high
    }
}

/// Eight points side by side, to be offered together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointBlock {
    position: [[f32; LANES]; 3],
    radius: [f32; LANES],
    /// Squared; 0 where there is no point.
    horizon_sq: [f32; LANES],
}

impl PointBlock {
    /// How many points fit.
    pub const WIDTH: usize = LANES;

    /// No points.
    pub const EMPTY: Self =
        Self { position: [[0.0; LANES]; 3], radius: [0.0; LANES], horizon_sq: [0.0; LANES] };

    /// Puts the point `p` of local sampling radius `radius` into a lane.
    ///
    /// # Panics
    /// When there is no such lane.
    #[inline]
    pub fn set(&mut self, lane: usize, plan: &SurfacePlan, p: [f32; 3], radius: f32) {
        for k in 0..3 {
            self.position[k][lane] = p[k];
        }
        let horizon = plan.horizon(radius);
        self.radius[lane] = radius;
        self.horizon_sq[lane] = horizon * horizon;
    }
}

/// Points side by side: what is filled in is added up, the rest has no weight.
#[derive(Debug, Clone, Copy)]
struct Block {
    offset: [[f32; LANES]; 3],
    /// d²/h².
    exponent: [f32; LANES],
    bandwidth: [f32; LANES],
}

const EMPTY: Block =
    Block { offset: [[0.0; LANES]; 3], exponent: [f32::MAX; LANES], bandwidth: [0.0; LANES] };

/// The points in whose horizon x lies, as offsets from x with d²/h² and h. Reused: no allocation once warm.
#[derive(Debug, Clone, Default)]
pub struct Neighbourhood {
    blocks: Vec<Block>,
    count: usize,
}

impl Neighbourhood {
    /// Forgets all points.
    pub fn clear(&mut self) {
        self.blocks.clear();
        self.count = 0;
    }

    /// Adds point `p` of local sampling radius `radius` if its horizon reaches `x`.
    ///
    /// Written without a branch on the outcome, which no processor could predict: the point always goes into the
    /// next lane, and stays there only if it counts.
    #[inline]
    pub fn offer(&mut self, plan: &SurfacePlan, x: &Centre, p: [f32; 3], radius: f32) {
        let d = x.offset(p);
        let d_sq = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        let horizon = plan.horizon(radius);
        let horizon_sq = horizon * horizon;
        let counts = d_sq < horizon_sq;
        let exponent = if counts { plan.reach_sq() * (d_sq / horizon_sq) } else { f32::MAX };
        self.put(d, exponent, plan.bandwidth(radius));
        self.count += usize::from(counts);
    }

    /// As [`Self::offer`], of all points of a block, in order.
    #[inline]
    pub fn offer_block(&mut self, plan: &SurfacePlan, x: &Centre, block: &PointBlock) {
        let mut d = [[0.0_f32; LANES]; 3];
        for k in 0..3 {
            for i in 0..LANES {
                d[k][i] = (block.position[k][i] - x.high[k]) - x.low[k];
            }
        }
        let mut exponent = [0.0_f32; LANES];
        let mut counts = [0_u32; LANES];
        for i in 0..LANES {
            let d_sq = d[0][i] * d[0][i] + d[1][i] * d[1][i] + d[2][i] * d[2][i];
            counts[i] = u32::from(d_sq < block.horizon_sq[i]) << i;
            exponent[i] = plan.reach_sq() * (d_sq / block.horizon_sq[i]);
        }
        let mut bits: u32 = counts.iter().sum();
        while bits != 0 {
            let i = bits.trailing_zeros() as usize % LANES;
            bits &= bits - 1;
            self.push([d[0][i], d[1][i], d[2][i]], exponent[i], plan.bandwidth(block.radius[i]));
        }
    }

    /// Adds a point at `offset` from x, with its d²/h² and its h.
    #[inline]
    pub fn push(&mut self, offset: [f32; 3], exponent: f32, bandwidth: f32) {
        self.put(offset, exponent, bandwidth);
        self.count += 1;
    }

    /// Fills the lane after the last point that counts.
    #[inline]
    fn put(&mut self, offset: [f32; 3], exponent: f32, bandwidth: f32) {
        let (block, lane) = (self.count / LANES, self.count % LANES);
        if block == self.blocks.len() {
            self.blocks.push(EMPTY);
        }
        if let Some(block) = self.blocks.get_mut(block) {
            block.offset[0][lane] = offset[0];
            block.offset[1][lane] = offset[1];
            block.offset[2][lane] = offset[2];
            block.exponent[lane] = exponent;
            block.bandwidth[lane] = bandwidth;
        }
    }

    /// How many points there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The points relative to x.
    pub fn offsets(&self) -> impl Iterator<Item = [f32; 3]> {
        let lane = |i: usize| {
            let [x, y, z] = &self.blocks[i / LANES].offset;
            [x[i % LANES], y[i % LANES], z[i % LANES]]
        };
        (0..self.count).map(lane)
    }

    /// The weighted sums, with the weights of the plan's kernel.
    pub(crate) fn moments(&self, plan: &SurfacePlan) -> Moments {
        let mut sums = [[0.0_f32; LANES]; 11];
        let mut nearest = [f32::MAX; LANES];
        for block in &self.blocks {
            add_block(&mut sums, block, plan);
            for (least, t) in nearest.iter_mut().zip(&block.exponent) {
                *least = if t < least { *t } else { *least };
            }
        }
        let s = sums.map(sum_lanes);
        Moments {
            weight: s[0],
            first: [s[1], s[2], s[3]],
            second: [s[4], s[5], s[6], s[7], s[8], s[9]],
            bandwidth: s[10],
            nearest: nearest.into_iter().fold(f32::MAX, f32::min),
        }
    }
}

/// One block of lanes into the eleven sums.
#[inline]
fn add_block(sums: &mut [[f32; LANES]; 11], block: &Block, plan: &SurfacePlan) {
    let end = plan.reach_sq();
    let Block { offset: [x, y, z], exponent: t, bandwidth: h } = block;
    let mut w = [0.0_f32; LANES];
    match plan.kernel() {
        Kernel::Gaussian => (0..LANES).for_each(|i| w[i] = Kernel::Gaussian.weight(t[i])),
        kernel => (0..LANES).for_each(|i| w[i] = kernel.weight(t[i])),
    }
    for i in 0..LANES {
        w[i] = if t[i] <= end { w[i] } else { 0.0 };
    }
    for i in 0..LANES {
        let (wx, wy, wz) = (w[i] * x[i], w[i] * y[i], w[i] * z[i]);
        sums[0][i] += w[i];
        sums[1][i] += wx;
        sums[2][i] += wy;
        sums[3][i] += wz;
        sums[4][i] += wx * x[i];
        sums[5][i] += wx * y[i];
        sums[6][i] += wx * z[i];
        sums[7][i] += wy * y[i];
        sums[8][i] += wy * z[i];
        sums[9][i] += wz * z[i];
        sums[10][i] += w[i] * h[i];
    }
}

fn sum_lanes(lanes: [f32; LANES]) -> f64 {
    lanes.iter().map(|&x| f64::from(x)).sum()
}
