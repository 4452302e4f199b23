//! The sixteen pairs of triangles of two leaves, in lanes.
//!
//! A filter in single precision: it rejects a pair only if the triangles' bounding boxes along the axes
//! of a's frame are disjoint, or all corners of one triangle are on one side of the other's plane,
//! rounding included. The exact test decides about the other pairs.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16};
use nearmiss_hierarchy::{LEAF_TRIANGLES, Relative, TriangleBlock};
use nearmiss_lanes::wide::{bits, cross, each_repeated, each_spread, product};

type Vector<S> = [f32x16<S>; 3];

/// Returns the lanes of the triangle pairs that may meet, as bits. Lane 4j + i has triangle i of
/// a's leaf and triangle j of b's.
pub(crate) fn may_meet(level: Level, [a, b]: [&TriangleBlock; 2], relative: &Relative) -> u32 {
    dispatch!(level, simd => simd.vectorize(
        #[inline(always)]
        || may_meet_by(simd, [a, b], relative),
    ))
}

#[inline(always)]
fn may_meet_by<S: Simd>(simd: S, blocks: [&TriangleBlock; 2], relative: &Relative) -> u32 {
    let [a, b] = in_lanes(simd, blocks, relative);
    let slack = relative.slack();
    let apart = are_boxes_apart(&a, &b, slack) | is_beside(&a, &b, slack) | is_beside(&b, &a, slack);
    !bits(apart) & 0xffff
}

/// Loads the corners of all sixteen pairs, in a's stored frame.
#[inline(always)]
pub(crate) fn in_lanes<S: Simd>(
    simd: S,
    [a, b]: [&TriangleBlock; 2],
    relative: &Relative,
) -> [[Vector<S>; 3]; 2] {
    let ([p, q, r], [u, v, w]) = (a.load(simd), b.load(simd));
    let (u, v, w) = (relative.points_of_four(u), relative.points_of_four(v), relative.points_of_four(w));
    [[each_repeated(p), each_repeated(q), each_repeated(r)], [each_spread(u), each_spread(v), each_spread(w)]]
}

/// Returns the lanes in which the bounding boxes of the triangles are disjoint. Each coordinate is off
/// by at most the slack.
#[inline(always)]
fn are_boxes_apart<S: Simd>(a: &[Vector<S>; 3], b: &[Vector<S>; 3], slack: f32) -> mask32x16<S> {
    box_gap(a, b, 0).max(box_gap(a, b, 1)).max(box_gap(a, b, 2)).simd_gt(2.5 * slack)
}

// Functions instead of closures: those may be compiled separately, without the instruction set of
// their caller.

/// Returns the gap of the bounding boxes of two triangles along an axis.
#[inline(always)]
fn box_gap<S: Simd>(a: &[Vector<S>; 3], b: &[Vector<S>; 3], axis: usize) -> f32x16<S> {
    (low(b, axis) - high(a, axis)).max(low(a, axis) - high(b, axis))
}

#[inline(always)]
fn low<S: Simd>(t: &[Vector<S>; 3], axis: usize) -> f32x16<S> {
    t[0][axis].min(t[1][axis]).min(t[2][axis])
}

#[inline(always)]
fn high<S: Simd>(t: &[Vector<S>; 3], axis: usize) -> f32x16<S> {
    t[0][axis].max(t[1][axis]).max(t[2][axis])
}

/// Returns the lanes in which all corners of `other` are on one side of the plane of `own`.
///
/// With the corners p, q, r of `own`, e = q − p, f = r − p, n = e × f and a corner x, the side is the
/// sign of n·(x − p). Each coordinate is off by at most δ, the slack of the relative pose. Then e
/// and f are off by 2δ, n by 4δ (|e| + |f| + 2δ), and the product by δ |n|₁ + 4δ (|e| + |f| + 2δ)
/// |x − p|₁. The rounding of the operations adds less than one δ to each factor, because δ exceeds
/// 4e-6 of all coordinates.
#[inline(always)]
fn is_beside<S: Simd>(own: &[Vector<S>; 3], other: &[Vector<S>; 3], slack: f32) -> mask32x16<S> {
    let [p, q, r] = own;
    let (e, f) = (sub(q, p), sub(r, p));
    let n = cross(e, f);
    let [x, y, z] = [sub(&other[0], p), sub(&other[1], p), sub(&other[2], p)];
    let [dx, dy, dz] = [product(n, x), product(n, y), product(n, z)];
    let far = size(&x).max(size(&y)).max(size(&z));
    let off = (size(&n) * 1.5 + (size(&e) + size(&f) + 2.0 * slack) * far * 6.0) * slack;
    let (low, high) = (dx.min(dy).min(dz), dx.max(dy).max(dz));
    low.simd_gt(off) | high.simd_lt(-off)
}

/// Returns a lower bound on the distance of each pair of triangles, in a's stored frame; 0 where they
/// may meet. Lanes are those of [`may_meet`].
pub(crate) fn least_distances(
    level: Level,
    blocks: [&TriangleBlock; 2],
    relative: &Relative,
) -> [f32; LEAF_TRIANGLES * LEAF_TRIANGLES] {
    dispatch!(level, simd => simd.vectorize(
        #[inline(always)]
        || least_distances_by(simd, blocks, relative),
    ))
}

#[inline(always)]
fn least_distances_by<S: Simd>(
    simd: S,
    blocks: [&TriangleBlock; 2],
    relative: &Relative,
) -> [f32; LEAF_TRIANGLES * LEAF_TRIANGLES] {
    let [a, b] = in_lanes(simd, blocks, relative);
    let gap = gap_along(simd, &a, &b, sub(&thrice_centre(&b), &thrice_centre(&a)))
        .max(gap_along(simd, &a, &b, normal(&a)))
        .max(gap_along(simd, &a, &b, normal(&b)));
    // Coordinates are off by δ, so the gap along a direction is off by 2√3 δ, and by less than 1e-6
    // of itself because the direction is a unit vector up to rounding only.
    (gap * (1.0 - 1e-5) - 6.0 * relative.slack()).max(0.0).to_array()
}

#[inline(always)]
fn thrice_centre<S: Simd>(t: &[Vector<S>; 3]) -> Vector<S> {
    [t[0][0] + t[1][0] + t[2][0], t[0][1] + t[1][1] + t[2][1], t[0][2] + t[1][2] + t[2][2]]
}

/// Returns the gap of two triangles along a direction, of any length.
#[inline(always)]
fn gap_along<S: Simd>(simd: S, a: &[Vector<S>; 3], b: &[Vector<S>; 3], way: Vector<S>) -> f32x16<S> {
    // The tiny number keeps a vanishing direction from becoming NaN; it then bounds nothing.
    let per_length = f32x16::splat(simd, 1.0) / (product(way, way) + 1e-30).sqrt();
    let way = [way[0] * per_length, way[1] * per_length, way[2] * per_length];
    // Relative to a corner, where rounding is least.
    let p = &a[0];
    let [q, r] = [product(way, sub(&a[1], p)), product(way, sub(&a[2], p))];
    let [u, v, w] = [product(way, sub(&b[0], p)), product(way, sub(&b[1], p)), product(way, sub(&b[2], p))];
    let zero = f32x16::splat(simd, 0.0);
    let (low_a, high_a) = (q.min(r).min(zero), q.max(r).max(zero));
    let (low_b, high_b) = (u.min(v).min(w), u.max(v).max(w));
    (low_b - high_a).max(low_a - high_b)
}

#[inline(always)]
fn normal<S: Simd>([p, q, r]: &[Vector<S>; 3]) -> Vector<S> {
    cross(sub(q, p), sub(r, p))
}

#[inline(always)]
fn sub<S: Simd>(a: &Vector<S>, b: &Vector<S>) -> Vector<S> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// The sum of the magnitudes of the coordinates.
#[inline(always)]
fn size<S: Simd>(v: &Vector<S>) -> f32x16<S> {
    v[0].abs() + v[1].abs() + v[2].abs()
}
