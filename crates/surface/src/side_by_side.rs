//! Weighted sums about sixteen points at once, one in each lane. All of them take a neighbour at the
//! same time, as the pixels of an image do.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, mask32x16};
use nearmiss_lanes::wide::Bits;

use crate::{Moments, SurfacePlan};

/// Running sums about sixteen points, as [`crate::Neighbourhood`] keeps them about one.
#[derive(Debug, Clone, Copy)]
pub struct SideBySide<'a, S: Simd> {
    plan: &'a SurfacePlan,
    weight: f32x16<S>,
    first: [f32x16<S>; 3],
    second: [f32x16<S>; 6],
    support_radius: f32x16<S>,
    nearest: f32x16<S>,
    support: f32x16<S>,
}

impl<'a, S: Simd> SideBySide<'a, S> {
    /// Creates the sums of no points.
    #[inline(always)]
    #[must_use]
    pub fn new(simd: S, plan: &'a SurfacePlan) -> Self {
        let zero = f32x16::splat(simd, 0.0);
        Self {
            plan,
            weight: zero,
            first: [zero; 3],
            second: [zero; 6],
            support_radius: zero,
            nearest: f32x16::splat(simd, f32::INFINITY),
            support: zero,
        }
    }

    /// Adds a neighbour in each lane if it has the point of the lane within its support radius. `d`
    /// is its place as seen from that point, `decay` is its 1/h² ([`SurfacePlan::decay`]).
    #[inline(always)]
    pub fn add(&mut self, simd: S, d: [f32x16<S>; 3], support_radius: f32x16<S>, decay: f32x16<S>) {
        let [x, y, z] = d;
        let t = (x * x + y * y + z * z) * decay;
        let counts: mask32x16<S> = t.simd_lt(self.plan.reach_sq());
        let (low, high) = simd.split_f32x16(t);
        let kernel = self.plan.kernel();
        let w = simd.combine_f32x8(kernel.weights(simd, low), kernel.weights(simd, high));
        let zero = f32x16::splat(simd, 0.0);
        let w = simd.select_f32x16(counts, w, zero);
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
        self.nearest = self.nearest.min(t);
        self.support += simd.select_f32x16(counts, f32x16::splat(simd, 1.0), zero);
    }

    /// Appends the sums about the points in `lanes`, given as bits, to `all`.
    #[inline(always)]
    pub fn append_to(&self, all: &mut Vec<Moments>, lanes: u32) {
        let (weight, nearest) = (self.weight.to_array(), self.nearest.to_array());
        let (support, radius) = (self.support.to_array(), self.support_radius.to_array());
        let [x, y, z] = self.first;
        let first = [x.to_array(), y.to_array(), z.to_array()];
        let [a, b, c, d, e, f] = self.second;
        let second = [a.to_array(), b.to_array(), c.to_array(), d.to_array(), e.to_array(), f.to_array()];
        for lane in Bits(lanes) {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small count")]
            let support = support[lane] as u32;
            let mut moments = Moments {
                weight: f64::from(weight[lane]),
                first: [0.0; 3],
                second: [0.0; 6],
                support_radius: f64::from(radius[lane]),
                nearest: nearest[lane],
                support,
            };
            for k in 0..3 {
                moments.first[k] = f64::from(first[k][lane]);
            }
            for k in 0..6 {
                moments.second[k] = f64::from(second[k][lane]);
            }
            all.push(moments);
        }
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};
    use nearmiss_index::PointBlock;

    use super::*;
    use crate::SurfaceOptions;

    #[test]
    fn sums_side_by_side_are_those_about_each_point() {
        let plan = SurfacePlan::new(&SurfaceOptions::default(), 1.0, 1.0).unwrap();
        let place = |i: u8| {
            let (x, y) = (f32::from(i % 8), f32::from(i / 8));
            [0.9 * x + 0.1 * (y * 2.0).sin(), y + 0.2 * x.cos(), 0.3 * (x + 0.5 * y).sin()]
        };
        let points: Vec<[f32; 3]> = (0..64).map(place).collect();
        let radii: Vec<f32> = (0..64_u8).map(|i| 0.8 + 0.01 * f32::from(i)).collect();
        let blocks: Vec<PointBlock> = plan.blocks(&points, &radii).collect();
        let centres = &points[20..36];
        let found = dispatch!(Level::new(), simd => simd.vectorize(
            #[inline(always)]
            || {
                let mut sums = SideBySide::new(simd, &plan);
                for (p, radius) in points.iter().zip(&radii) {
                    let d = [0, 1, 2].map(|k| {
                        let lanes: [f32; 16] = std::array::from_fn(|i| p[k] - centres[i][k]);
                        f32x16::load_array_ref(simd, &lanes)
                    });
                    let support = plan.support_radius(*radius);
                    let splat = |x| f32x16::splat(simd, x);
                    sums.add(simd, d, splat(support), splat(plan.decay(support)));
                }
                let (mut all, [first, others]) = (Vec::new(), [1, 0xfffe]);
                sums.append_to(&mut all, first);
                sums.append_to(&mut all, others);
                all
            },
        ));
        assert_eq!(found.len(), centres.len());
        for (centre, found) in centres.iter().zip(found) {
            let x = centre.map(f64::from);
            let expected = Moments::about(Level::new(), &plan, x, blocks.iter().copied());
            assert_eq!(found.support, expected.support, "at {x:?}");
            let (a, b) = (found.evaluate(&plan, x), expected.evaluate(&plan, x));
            assert_eq!(a.status, b.status, "at {x:?}");
            let cosine: f64 = (0..3).map(|k| a.normal[k] * b.normal[k]).sum();
            assert!(cosine > 1.0 - 1e-5 && (a.f - b.f).abs() < 1e-5, "at {x:?}: {a:?}, {b:?}");
        }
    }
}
