//! Oriented boxes in SIMD lanes.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x4, f32x16};
use nearmiss_lanes::wide::{cross, each_repeated, each_spread, product};

use crate::bounds::boxes::{OrientedBox, Relative};

/// Oriented boxes in lanes: centres, half edge lengths and the directions of the edges.
#[derive(Debug, Clone, Copy)]
pub struct Boxes<V> {
    /// The centres.
    pub centre: [V; 3],
    /// Half the edge lengths.
    pub half: [V; 3],
    /// Unit directions of the edges. The third one is the product of the first two.
    pub axes: [[V; 3]; 3],
}

// Functions instead of closures: those may be compiled separately, without the instruction set of
// their caller.

impl<S: Simd> Boxes<f32x4<S>> {
    /// Returns the same box in all four lanes.
    #[inline(always)]
    #[must_use]
    pub fn splat(simd: S, of: &OrientedBox) -> Self {
        let [u, v, w] = of.axes;
        Self {
            centre: splat(simd, of.centre),
            half: splat(simd, of.half),
            axes: [splat(simd, u), splat(simd, v), splat(simd, w)],
        }
    }

    /// Returns each box four times: box i in lanes i, 4 + i, 8 + i and 12 + i.
    #[inline(always)]
    #[must_use]
    pub fn repeated(&self) -> Boxes<f32x16<S>> {
        let [u, v, w] = self.axes;
        Boxes {
            centre: each_repeated(self.centre),
            half: each_repeated(self.half),
            axes: [each_repeated(u), each_repeated(v), each_repeated(w)],
        }
    }

    /// Returns each box four times: box i in lanes 4i to 4i + 3.
    #[inline(always)]
    #[must_use]
    pub fn spread(&self) -> Boxes<f32x16<S>> {
        let [u, v, w] = self.axes;
        Boxes {
            centre: each_spread(self.centre),
            half: each_spread(self.half),
            axes: [each_spread(u), each_spread(v), each_spread(w)],
        }
    }
}

#[inline(always)]
fn splat<S: Simd>(simd: S, [x, y, z]: [f32; 3]) -> [f32x4<S>; 3] {
    [f32x4::splat(simd, x), f32x4::splat(simd, y), f32x4::splat(simd, z)]
}

impl Relative {
    /// Transforms four boxes of b's frame to a's. Uses the order of operations of [`Self::moved`].
    #[inline(always)]
    #[must_use]
    pub fn boxes_of_four<S: Simd>(&self, b: &Boxes<f32x4<S>>) -> Boxes<f32x4<S>> {
        let ([x, y, z], scale) = (b.half, self.scale());
        let [u, v] = [self.directions_of_four(b.axes[0]), self.directions_of_four(b.axes[1])];
        Boxes {
            centre: self.points_of_four(b.centre),
            half: [x * scale, y * scale, z * scale],
            axes: [u, v, cross(u, v)],
        }
    }
}

/// Passes the distances of the centres and the sums of the half extents of boxes of a and b to
/// `tell`, along each of the six face normals: those of a, then those of b. Uses the order of
/// operations of [`Relative::gap`].
#[inline(always)]
pub fn along_normals<S: Simd, V: SimdBase<S>>(a: &Boxes<V>, b: &Boxes<V>, mut tell: impl FnMut(V, V)) {
    let d = [b.centre[0] - a.centre[0], b.centre[1] - a.centre[1], b.centre[2] - a.centre[2]];
    let mut reach_b = b.half;
    // Unrolled by hand: a loop would keep all of a in memory.
    let (away, reach) = along_axis(&a.axes[0], a.half[0], b, &d, &mut reach_b);
    tell(away, reach);
    let (away, reach) = along_axis(&a.axes[1], a.half[1], b, &d, &mut reach_b);
    tell(away, reach);
    let (away, reach) = along_axis(&a.axes[2], a.half[2], b, &d, &mut reach_b);
    tell(away, reach);
    tell(product(b.axes[0], d).abs(), reach_b[0]);
    tell(product(b.axes[1], d).abs(), reach_b[1]);
    tell(product(b.axes[2], d).abs(), reach_b[2]);
}

/// Returns the distance of the centres along an axis of a and the sum of the half extents there.
/// Adds the contribution of this edge of a to the half extents along the axes of b.
#[inline(always)]
fn along_axis<S: Simd, V: SimdBase<S>>(
    axis: &[V; 3],
    half: V,
    b: &Boxes<V>,
    d: &[V; 3],
    reach_b: &mut [V; 3],
) -> (V, V) {
    let cosines =
        [product(*axis, b.axes[0]).abs(), product(*axis, b.axes[1]).abs(), product(*axis, b.axes[2]).abs()];
    reach_b[0] += half * cosines[0];
    reach_b[1] += half * cosines[1];
    reach_b[2] += half * cosines[2];
    let reach = half + b.half[0] * cosines[0] + b.half[1] * cosines[1] + b.half[2] * cosines[2];
    (product(*axis, *d).abs(), reach)
}
