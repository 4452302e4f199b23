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

/// The points in whose horizon x lies, as offsets from x with d²/h² and h. Reused: no allocation once warm.
#[derive(Debug, Clone, Default)]
pub struct Neighbourhood {
    offsets: [Vec<f32>; 3],
    exponents: Vec<f32>,
    bandwidths: Vec<f32>,
}

impl Neighbourhood {
    /// Forgets all points.
    pub fn clear(&mut self) {
        for axis in &mut self.offsets {
            axis.clear();
        }
        self.exponents.clear();
        self.bandwidths.clear();
    }

    /// Adds point `p` of local sampling radius `radius` if its horizon reaches `x`.
    #[inline]
    pub fn offer(&mut self, plan: &SurfacePlan, x: &Centre, p: [f32; 3], radius: f32) {
        let d = x.offset(p);
        let d_sq = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        let horizon = plan.horizon(radius);
        let horizon_sq = horizon * horizon;
        if d_sq < horizon_sq {
            self.push(d, plan.reach_sq() * (d_sq / horizon_sq), plan.bandwidth(radius));
        }
    }

    /// Adds a point at `offset` from x, with its d²/h² and its h.
    #[inline]
    pub fn push(&mut self, offset: [f32; 3], exponent: f32, bandwidth: f32) {
        for k in 0..3 {
            self.offsets[k].push(offset[k]);
        }
        self.exponents.push(exponent);
        self.bandwidths.push(bandwidth);
    }

    /// How many points there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.exponents.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.exponents.is_empty()
    }

    /// The points relative to x.
    pub fn offsets(&self) -> impl Iterator<Item = [f32; 3]> {
        let [x, y, z] = &self.offsets;
        x.iter().zip(y).zip(z).map(|((x, y), z)| [*x, *y, *z])
    }

    /// The weighted sums, with the weights of `kernel`. The last lanes are filled with points of no weight.
    pub(crate) fn moments(&mut self, plan: &SurfacePlan) -> Moments {
        let count = self.len();
        let padded = count.next_multiple_of(LANES);
        let Self { offsets: [x, y, z], exponents, bandwidths } = self;
        for list in [&mut *x, &mut *y, &mut *z, &mut *bandwidths] {
            list.resize(padded, 0.0);
        }
        exponents.resize(padded, f32::MAX);
        let mut sums = [[0.0_f32; LANES]; 11];
        let blocks = x.as_chunks::<LANES>().0.iter().zip(y.as_chunks().0).zip(z.as_chunks().0);
        let weights = exponents.as_chunks().0.iter().zip(bandwidths.as_chunks().0);
        for (((x, y), z), (t, h)) in blocks.zip(weights) {
            add_block(&mut sums, [x, y, z], t, h, plan);
        }
        for list in [x, y, z, exponents, bandwidths] {
            list.truncate(count);
        }
        let s = sums.map(sum_lanes);
        Moments {
            weight: s[0],
            first: [s[1], s[2], s[3]],
            second: [s[4], s[5], s[6], s[7], s[8], s[9]],
            bandwidth: s[10],
        }
    }
}

/// One block of lanes into the eleven sums.
#[inline]
fn add_block(
    sums: &mut [[f32; LANES]; 11],
    [x, y, z]: [&[f32; LANES]; 3],
    t: &[f32; LANES],
    h: &[f32; LANES],
    plan: &SurfacePlan,
) {
    let end = plan.reach_sq();
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
