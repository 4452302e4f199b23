//! Vectors of three coordinates side by side, sixteen if nothing else is said, and boxes.

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16};
use nearmiss_surface::PointBlock;

const WIDTH: usize = PointBlock::WIDTH;

/// Sixteen vectors.
pub(crate) type Vectors<S> = [f32x16<S>; 3];

/// Vectors by their coordinates.
#[inline(always)]
pub(crate) fn load<S: Simd>(simd: S, [x, y, z]: &[[f32; WIDTH]; 3]) -> Vectors<S> {
    [f32x16::load_array_ref(simd, x), f32x16::load_array_ref(simd, y), f32x16::load_array_ref(simd, z)]
}

/// The points of a block as seen from `p`.
#[inline(always)]
pub(crate) fn seen_from<S: Simd>(simd: S, block: &PointBlock, p: [f32; 3]) -> Vectors<S> {
    let [x, y, z] = load(simd, &block.position);
    [x - p[0], y - p[1], z - p[2]]
}

/// How far each goes along `axis`: the sum of products in the order of [`dot`](crate::boxes::dot), bit for
/// bit the same.
#[inline(always)]
pub(crate) fn along<S: Simd>([x, y, z]: Vectors<S>, axis: [f32; 3]) -> f32x16<S> {
    x * axis[0] + y * axis[1] + z * axis[2]
}

/// The products of any number of vectors, in that order too.
#[inline(always)]
pub(crate) fn product<S: Simd, V: SimdBase<S>>(a: [V; 3], b: [V; 3]) -> V {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Boxes in lanes: their middles, half their edge lengths and the directions of these.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Boxes<V> {
    pub(crate) centre: [V; 3],
    pub(crate) half: [V; 3],
    pub(crate) axes: [[V; 3]; 3],
}

/// Tells of boxes of a and b in each lane, along each of the six face normals, the distance of their centres
/// and how far both reach: in the order of operations of [`Relative::gaps`](crate::Relative::gaps).
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

/// The lanes of a block that hold any of `points`, as bits: point i stands in lane i % 16 of block i / 16.
/// None of the points may end before the block starts.
#[inline(always)]
pub(crate) fn lanes_of(block: usize, points: &Range<usize>) -> u64 {
    let first = block * WIDTH;
    let (start, end) = (points.start.saturating_sub(first), (points.end - first).min(WIDTH));
    (1 << end) - (1 << start)
}

/// The least of all and `least`, none of which is anything but a number.
#[inline(always)]
pub(crate) fn least<S: Simd>(lanes: f32x16<S>, least: f32) -> f32 {
    fold(lanes, least, |a, b| if a < b { a } else { b })
}

/// The greatest of all and `greatest`, none of which is anything but a number.
#[inline(always)]
pub(crate) fn greatest<S: Simd>(lanes: f32x16<S>, greatest: f32) -> f32 {
    fold(lanes, greatest, |a, b| if a > b { a } else { b })
}

/// Halves onto each other, for all orders give the same.
#[inline(always)]
fn fold<S: Simd>(lanes: f32x16<S>, with: f32, f: impl Fn(f32, f32) -> f32) -> f32 {
    let mut lanes = lanes.to_array();
    let mut width = WIDTH / 2;
    while width > 0 {
        for i in 0..width {
            lanes[i] = f(lanes[i], lanes[i + width]);
        }
        width /= 2;
    }
    f(lanes[0], with)
}
