//! Vectors of three coordinates, sixteen side by side.

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

/// How far each goes along `axis`: the sum of products in the order of [`dot`](crate::boxes::dot), bit for bit the same.
#[inline(always)]
pub(crate) fn along<S: Simd>([x, y, z]: Vectors<S>, axis: [f32; 3]) -> f32x16<S> {
    x * axis[0] + y * axis[1] + z * axis[2]
}

/// The products of vectors, in that order too.
#[inline(always)]
pub(crate) fn product<S: Simd>(a: Vectors<S>, b: Vectors<S>) -> f32x16<S> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The lanes of a block in which those of some points stand that are its, as bits: point i in lane i % 16 of block i / 16.
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
