//! Boxes in lanes.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use nearmiss_lanes::wide::product;

/// Boxes in lanes: their middles, half their edge lengths and the directions of these.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Boxes<V> {
    pub(crate) centre: [V; 3],
    pub(crate) half: [V; 3],
    pub(crate) axes: [[V; 3]; 3],
}

/// Tells of boxes of a and b in each lane, along each of the six face normals, the distance of their centres
/// and how far both reach: in the order of operations of [`Relative::gap`](crate::Relative::gap).
#[inline(always)]
pub(crate) fn along_normals<S: Simd, V: SimdBase<S>>(a: &Boxes<V>, b: &Boxes<V>, mut tell: impl FnMut(V, V)) {
    let d = [b.centre[0] - a.centre[0], b.centre[1] - a.centre[1], b.centre[2] - a.centre[2]];
    let mut reach_b = b.half;
    for i in 0..3 {
        let mut reach_a = a.half[i];
        for j in 0..3 {
            let cosine = product(a.axes[i], b.axes[j]).abs();
            reach_a += b.half[j] * cosine;
            reach_b[j] += a.half[i] * cosine;
        }
        tell(product(a.axes[i], d).abs(), reach_a);
    }
    for j in 0..3 {
        tell(product(b.axes[j], d).abs(), reach_b[j]);
    }
}
