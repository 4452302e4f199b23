//! Vectors of three coordinates, sixteen side by side.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16};
use nearmiss_surface::PointBlock;

/// Sixteen vectors.
pub(crate) type Vectors<S> = [f32x16<S>; 3];

/// The points of a block.
#[inline(always)]
pub(crate) fn load<S: Simd>(simd: S, block: &PointBlock) -> Vectors<S> {
    let [x, y, z] = &block.position;
    [f32x16::load_array_ref(simd, x), f32x16::load_array_ref(simd, y), f32x16::load_array_ref(simd, z)]
}

/// The points of a block as seen from `p`.
#[inline(always)]
pub(crate) fn seen_from<S: Simd>(simd: S, block: &PointBlock, p: [f32; 3]) -> Vectors<S> {
    let [x, y, z] = load(simd, block);
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

/// The least of all and `least`.
#[inline(always)]
pub(crate) fn least<S: Simd>(lanes: f32x16<S>, mut least: f32) -> f32 {
    for x in lanes.to_array() {
        least = if x < least { x } else { least };
    }
    least
}

/// The greatest of all and `greatest`.
#[inline(always)]
pub(crate) fn greatest<S: Simd>(lanes: f32x16<S>, mut greatest: f32) -> f32 {
    for x in lanes.to_array() {
        greatest = if x > greatest { x } else { greatest };
    }
    greatest
}
