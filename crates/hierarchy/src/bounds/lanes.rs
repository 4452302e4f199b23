//! Oriented boxes in SIMD lanes.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use nearmiss_lanes::wide::product;

/// Oriented boxes in lanes: centres, half edge lengths and the directions of the edges.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Boxes<V> {
    pub(crate) centre: [V; 3],
    pub(crate) half: [V; 3],
    pub(crate) axes: [[V; 3]; 3],
}

/// Passes the distances of the centres and the sums of the half extents of boxes of a and b to
/// `tell`, along each of the six face normals. Uses the order of operations of
/// [`Relative::gap`](crate::Relative::gap).
#[inline(always)]
pub(crate) fn along_normals<S: Simd, V: SimdBase<S>>(a: &Boxes<V>, b: &Boxes<V>, mut tell: impl FnMut(V, V)) {
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
