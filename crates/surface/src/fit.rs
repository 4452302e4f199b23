//! The implicit function f(x) = n(x)·(a(x) − x), and the test whether it defines a surface at x.
//!
//! Klein & Zachmann 2004, eq. 1–4: a(x) is the weighted mean of the points. n(x) is the eigenvector
//! of the least eigenvalue of their weighted covariance about a(x). This implementation differs in
//! three ways. Each point has its own bandwidth. The domain is narrower than eq. 6: beside enough
//! support, x must be near a(x), which ends the surface where its samples end, and the points near
//! x must look like one sheet (docs/theory/surface.md). The sign of n is fixed by its largest
//! component, until a graph orients the normals.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x8};
use nearmiss_geometry::nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::eigen::solve_scaled;
use crate::{Moments, SurfacePlan};

/// Greatest distance of a surface point from a(x), in bandwidths. At the border of a half plane the
/// distance is h/√π = 0.564 h, and it grows beyond the border.
pub const BORDER: f64 = 0.56;

/// Square of the greatest distance of a surface point from some sample, in support radii of that
/// sample. Further away, zeros of f occur only at the rims of holes or of the supports.
/// Certificates rely on this limit, because it bounds the distance from a surface point to its
/// nearest sample.
const NEAR_SQ: f32 = 0.25;

/// Limit of the least eigenvalue over h²/2. The ratio is about 0 on a clean sheet, 0.14 on either
/// of two sheets 2h apart, and 1 between them, where n turns tangential and f vanishes in a whole
/// slab.
const SHEET_RATIO: f64 = 0.3;

/// Lower limit of (λ2 − λ1)/(λ1 + λ2 + λ3). The ratio is 0.5 on a sheet, and 0 where n is
/// arbitrary.
const EIGENVALUE_GAP: f64 = 0.1;

/// Validity of f(x).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Status {
    /// f(x) is valid.
    Ok,
    /// Fewer points than the least support are within their support radii of x, or none within half
    /// its support radius.
    Outside,
    /// x is further from a(x) than 0.56 h: beyond the border of the surface, or far from it.
    Border,
    /// The points near x do not look like one sheet.
    Ambiguous,
}

/// The implicit function at a point. Lengths and directions are in the frame of the scan's stored
/// positions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evaluation {
    /// f(x) = n·(a − x). Never NaN; 0 if no point is within its support radius of x, or if the sums
    /// are not finite.
    pub f: f64,
    /// n(x), a unit vector whose largest component is positive.
    pub normal: [f64; 3],
    /// a(x), the weighted mean of the points.
    pub centroid: [f64; 3],
    /// Number of points within their support radii of x.
    pub support: u32,
    /// h(x), the weighted mean of the points' bandwidths.
    pub bandwidth: f64,
    /// Eigenvalues of the weighted covariance, ascending.
    pub eigenvalues: [f64; 3],
    /// Validity of f(x).
    pub status: Status,
}

impl Moments {
    /// Evaluates f at `x`, the point about which these sums were taken. Costs one eigen solve.
    #[inline(always)]
    #[must_use]
    pub fn evaluate(&self, plan: &SurfacePlan, x: [f64; 3]) -> Evaluation {
        let (thrice, vectors) = solve_scaled(self.scaled_covariance());
        self.conclude(plan, x, thrice, vectors[0])
    }

    /// Evaluates f at each of `places`, about which `moments` were taken, and calls `each` in
    /// order. Solves eight eigen problems at a time; results equal those of [`Self::evaluate`] bit
    /// for bit.
    #[inline(always)]
    pub fn evaluate_all<S: Simd>(
        simd: S,
        plan: &SurfacePlan,
        places: &[[f32; 3]],
        moments: &[Self],
        mut each: impl FnMut(usize, Evaluation),
    ) {
        const LANES: usize = 8;
        for (block, (places, moments)) in places.chunks(LANES).zip(moments.chunks(LANES)).enumerate() {
            let mut entries = [[0.0; LANES]; 6];
            for (lane, moments) in moments.iter().enumerate() {
                for (entries, c) in entries.iter_mut().zip(moments.scaled_covariance()) {
                    entries[lane] = c;
                }
            }
            let [xx, xy, xz, yy, yz, zz] = &entries;
            let load = f64x8::load_array_ref;
            let matrices = [
                load(simd, xx),
                load(simd, xy),
                load(simd, xz),
                load(simd, yy),
                load(simd, yz),
                load(simd, zz),
            ];
            let ([a, b, c], [[x, y, z], ..]) = solve_scaled(matrices);
            let (a, b, c) = (a.to_array(), b.to_array(), c.to_array());
            let (x, y, z) = (x.to_array(), y.to_array(), z.to_array());
            for (lane, (place, moments)) in places.iter().zip(moments).enumerate() {
                let (thrice, normal) = ([a[lane], b[lane], c[lane]], [x[lane], y[lane], z[lane]]);
                each(block * LANES + lane, moments.conclude(plan, place.map(f64::from), thrice, normal));
            }
        }
    }

    /// Returns the covariance times the square of the weight, over the square of Σw·R. The
    /// solver needs this scale, and no division depends on another.
    #[inline(always)]
    fn scaled_covariance(&self) -> [f64; 6] {
        let [wx, wy, wz] = self.first;
        let [xx, xy, xz, yy, yz, zz] = self.second.map(|s| s * self.weight);
        let per_square = 1.0 / (self.support_radius * self.support_radius);
        let covariance = [xx - wx * wx, xy - wx * wy, xz - wx * wz, yy - wy * wy, yz - wy * wz, zz - wz * wz];
        covariance.map(|c| c * per_square)
    }

    /// Evaluates f at `x`, given three times the eigenvalues of the scaled covariance, and the
    /// eigenvector of the least.
    #[inline(always)]
    fn conclude(&self, plan: &SurfacePlan, x: [f64; 3], thrice: [f64; 3], least: [f64; 3]) -> Evaluation {
        let (m, support) = (self, self.support);
        let nothing = Evaluation {
            f: 0.0,
            normal: [0.0, 0.0, 1.0],
            centroid: x,
            support,
            bandwidth: 0.0,
            eigenvalues: [0.0; 3],
            status: Status::Outside,
        };
        if m.weight <= 0.0 {
            return nothing;
        }
        let per_weight = 1.0 / m.weight;
        let mean = m.first.map(|s| s * per_weight);
        let support_radius = m.support_radius * per_weight;
        let eigenvalues = thrice.map(|l| l * (support_radius * support_radius * (1.0 / 3.0)));
        let normal = with_positive_largest(least);
        let f = Vector3::from(normal).dot(&Vector3::from(mean));
        let bandwidth = support_radius * f64::from(plan.per_support_radius());
        // Invalid points, as from a damaged file, yield invalid sums.
        if !(f.is_finite() && bandwidth.is_finite()) {
            return nothing;
        }
        let is_near = m.nearest <= NEAR_SQ * plan.reach_sq();
        let status = if support < plan.options().support_min || !is_near {
            Status::Outside
        } else if Vector3::from(mean).norm() > BORDER * bandwidth {
            Status::Border
        } else if !is_one_sheet(eigenvalues, bandwidth) {
            Status::Ambiguous
        } else {
            Status::Ok
        };
        let centroid = [0, 1, 2].map(|k| x[k] + mean[k]);
        Evaluation { f, normal, centroid, support, bandwidth, eigenvalues, status }
    }
}

/// Least length of the weighted mean of oriented unit normals of one sheet.
const AGREEMENT: f64 = 0.5;

impl Evaluation {
    /// Orients n to the side of `sum`, a weighted sum of oriented normals with total weight
    /// `total`. The status becomes ambiguous if these normals disagree, that is if |`sum`| <
    /// `total` / 2.
    #[inline]
    #[must_use]
    pub fn turned_to(self, sum: [f64; 3], total: f64) -> Self {
        let sum = Vector3::from(sum);
        let sign = 1.0_f64.copysign(sum.dot(&Vector3::from(self.normal)));
        let agree = sum.norm() >= AGREEMENT * total;
        let status = if agree || self.status != Status::Ok { self.status } else { Status::Ambiguous };
        Self { f: self.f * sign, normal: self.normal.map(|c| c * sign), status, ..self }
    }
}

fn is_one_sheet([l1, l2, l3]: [f64; 3], h: f64) -> bool {
    l1 < SHEET_RATIO * 0.5 * h * h && l2 - l1 > EIGENVALUE_GAP * (l1 + l2 + l3)
}

/// Returns `v` or −`v`, so that the component of largest magnitude (the first of equals) is
/// positive. Branch-free, because signs are unpredictable.
#[inline(always)]
pub(crate) fn with_positive_largest([x, y, z]: [f64; 3]) -> [f64; 3] {
    let largest = if y.abs() > x.abs() { y } else { x };
    let largest = if z.abs() > largest.abs() { z } else { largest };
    let sign = 1.0_f64.copysign(largest);
    [x * sign, y * sign, z * sign]
}
