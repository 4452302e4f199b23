//! Triangles in a scan's stored frame, compared with sixteen points at a time.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x4, f32x16, mask32x4, mask32x16};
use nearmiss_hierarchy::{LEAF_TRIANGLES, LeafBlock, ObstacleParts, THICKNESS};
use nearmiss_lanes::wide::{Vectors, along, bits, cross, load, product, squared};

/// Coordinates beyond this have squares near the end of single precision.
const FARTHEST: f32 = 1e15;

/// A triangle whose sines sum up to less than this is compared by its edges alone, as rounding
/// leaves its normal no direction.
const NEEDLE: f32 = 2e-4;

/// Relative error of a distance. Rounding tilts the normal by up to 5e-7 over [`NEEDLE`], which
/// shortens a height by half the square of that.
const RELATIVE: f32 = 1e-5;

/// Rounding error along an edge and of the plane within the triangle, relative to the longest edge.
const OF_EDGES: f32 = 4e-6;

/// The number of steps of a position or normal in a [`LeafBlock`].
pub(super) const STEPS: f32 = 32767.0;

/// One number for each triangle of a leaf.
type Four = [f32; LEAF_TRIANGLES];

/// The triangles of a leaf in a scan's stored frame, prepared for distances.
pub(super) struct Prepared {
    corners: [[Four; 3]; 3],
    /// Unit directions of the edges; zero for an edge without length.
    along: [[Four; 3]; 3],
    lengths: [Four; 3],
    /// Unit normals; not used for needles.
    normal: [Four; 3],
    /// Unit vectors in the plane of a triangle, from each edge inwards.
    inward: [[Four; 3]; 3],
    /// The triangles that are no needles, as a bit mask.
    faces: u32,
    /// The errors of distances; infinite if coordinates are out of range.
    off: Four,
}

/// A triangle of [`Prepared`].
pub(super) struct LaneTriangle {
    corners: [[f32; 3]; 3],
    along: [[f32; 3]; 3],
    lengths: [f32; 3],
    normal: [f32; 3],
    inward: [[f32; 3]; 3],
    has_face: bool,
    off: f32,
}

// No closures in code for lanes: those may be compiled separately, without the instruction set of
// their caller.

#[inline(always)]
fn minus<S: Simd>(a: &[f32x4<S>; 3], b: &[f32x4<S>; 3]) -> [f32x4<S>; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn times<S: Simd>(v: &[f32x4<S>; 3], by: f32x4<S>) -> [f32x4<S>; 3] {
    [v[0] * by, v[1] * by, v[2] * by]
}

#[inline(always)]
fn stored<S: Simd>(v: &[f32x4<S>; 3]) -> [Four; 3] {
    [v[0].to_array(), v[1].to_array(), v[2].to_array()]
}

/// Returns the factor that makes vectors of these lengths unit vectors; 0 for no length.
#[inline(always)]
fn per_length<S: Simd>(simd: S, length: f32x4<S>) -> f32x4<S> {
    let zero = f32x4::splat(simd, 0.0);
    let is_long: mask32x4<S> = length.simd_gt(zero);
    is_long.select(f32x4::splat(simd, 1.0) / length, zero)
}

impl Prepared {
    /// Prepares triangles whose corners are each off by at most `slack` in each coordinate.
    #[inline(always)]
    pub(super) fn new<S: Simd>(simd: S, corners: [[f32x4<S>; 3]; 3], slack: f32) -> Self {
        let zero = f32x4::splat(simd, 0.0);
        let mut is_near: mask32x4<S> = zero.simd_eq(zero);
        for corner in &corners {
            for row in corner {
                // NaN is not near.
                is_near &= row.abs().simd_lt(f32x4::splat(simd, FARTHEST));
            }
        }
        let mut corners = corners;
        for corner in &mut corners {
            for row in corner {
                *row = is_near.select(*row, zero);
            }
        }
        let edges = [
            minus(&corners[1], &corners[0]),
            minus(&corners[2], &corners[1]),
            minus(&corners[0], &corners[2]),
        ];
        let lengths = [
            product(edges[0], edges[0]).sqrt(),
            product(edges[1], edges[1]).sqrt(),
            product(edges[2], edges[2]).sqrt(),
        ];
        let longest = lengths[0].max(lengths[1]).max(lengths[2]);
        let along = [
            times(&edges[0], per_length(simd, lengths[0])),
            times(&edges[1], per_length(simd, lengths[1])),
            times(&edges[2], per_length(simd, lengths[2])),
        ];
        // Each is the normal times the sine of the angle at a corner.
        let [p, q, r] = [cross(along[0], along[1]), cross(along[1], along[2]), cross(along[2], along[0])];
        let normal = [p[0] + q[0] + r[0], p[1] + q[1] + r[1], p[2] + q[2] + r[2]];
        // Rounding tilts this sum by more the thinner a triangle is. A tilt along its longest edge would
        // move the far end of the plane.
        let mut axis = along[2];
        for (edge, length) in [(along[1], lengths[1]), (along[0], lengths[0])] {
            let is_longest: mask32x4<S> = length.simd_eq(longest);
            axis = [
                is_longest.select(edge[0], axis[0]),
                is_longest.select(edge[1], axis[1]),
                is_longest.select(edge[2], axis[2]),
            ];
        }
        let normal = minus(&normal, &times(&axis, product(axis, normal)));
        let sines = product(normal, normal).sqrt();
        let is_face: mask32x4<S> = sines.simd_gt(f32x4::splat(simd, NEEDLE));
        let normal = times(&normal, per_length(simd, sines));
        let [u, v, w] = [cross(normal, along[0]), cross(normal, along[1]), cross(normal, along[2])];
        // A needle is no wider than its longest edge times the sum of its sines.
        let width = is_face.select(zero, longest * NEEDLE);
        let off = longest * OF_EDGES + width + 4.0 * slack;
        #[expect(clippy::cast_possible_truncation, reason = "four bits")]
        let faces = is_face.to_bitmask() as u32;
        Self {
            corners: [stored(&corners[0]), stored(&corners[1]), stored(&corners[2])],
            along: [stored(&along[0]), stored(&along[1]), stored(&along[2])],
            lengths: [lengths[0].to_array(), lengths[1].to_array(), lengths[2].to_array()],
            normal: stored(&normal),
            inward: [stored(&u), stored(&v), stored(&w)],
            faces,
            off: is_near.select(off, f32x4::splat(simd, f32::INFINITY)).to_array(),
        }
    }

    /// The triangle in a lane.
    #[inline(always)]
    pub(super) fn get(&self, lane: usize) -> LaneTriangle {
        let lane = lane % LEAF_TRIANGLES;
        LaneTriangle {
            corners: each(&self.corners, lane),
            along: each(&self.along, lane),
            lengths: of(&self.lengths, lane),
            normal: of(&self.normal, lane),
            inward: each(&self.inward, lane),
            has_face: self.faces >> lane & 1 != 0,
            off: self.off[lane],
        }
    }
}

#[inline(always)]
fn of(rows: &[Four; 3], lane: usize) -> [f32; 3] {
    [rows[0][lane], rows[1][lane], rows[2][lane]]
}

#[inline(always)]
fn each(vectors: &[[Four; 3]; 3], lane: usize) -> [[f32; 3]; 3] {
    [of(&vectors[0], lane), of(&vectors[1], lane), of(&vectors[2], lane)]
}

impl LaneTriangle {
    /// Lower bounds on the distances of these points from the triangle. Negative for points that
    /// may lie on it.
    #[inline(always)]
    pub(super) fn distances<S: Simd>(&self, simd: S, [x, y, z]: &Vectors<S>) -> f32x16<S> {
        let mut nearest = f32x16::splat(simd, f32::INFINITY);
        let (mut inside, mut height) = (nearest, nearest);
        for i in 0..3 {
            let ([cx, cy, cz], [ux, uy, uz]) = (self.corners[i], self.along[i]);
            let d = [*x - cx, *y - cy, *z - cz];
            let share = along(d, self.along[i]).max(0.0).min(self.lengths[i]);
            nearest = nearest.min(squared([d[0] - share * ux, d[1] - share * uy, d[2] - share * uz]));
            inside = inside.min(along(d, self.inward[i]));
            height = along(d, self.normal);
        }
        if self.has_face {
            let is_above: mask32x16<S> = inside.simd_ge(f32x16::splat(simd, 0.0));
            nearest = is_above.select(nearest.min(height * height), nearest);
        }
        nearest.sqrt() * (1.0 - RELATIVE) - self.off
    }

    /// The least and the greatest heights of the corners over the planes of these points, and the sum of the
    /// coordinates of the way to the furthest corner.
    #[inline(always)]
    pub(super) fn heights<S: Simd>(
        &self,
        simd: S,
        points: &Vectors<S>,
        normals: &Vectors<S>,
    ) -> (f32x16<S>, f32x16<S>, f32x16<S>) {
        let (mut low, mut far) = (f32x16::splat(simd, f32::INFINITY), f32x16::splat(simd, 0.0));
        let mut high = -low;
        for [cx, cy, cz] in self.corners {
            let d = [-(points[0] - cx), -(points[1] - cy), -(points[2] - cz)];
            let height = product(d, *normals);
            (low, high) = (low.min(height), high.max(height));
            far = far.max(d[0].abs() + d[1].abs() + d[2].abs());
        }
        (low, high, far)
    }

    /// Lower bounds on the distances of the parts of these points from the triangle.
    #[inline(always)]
    pub(super) fn gaps_to_parts<S: Simd>(
        &self,
        simd: S,
        points: &Vectors<S>,
        parts: &ObstacleParts,
    ) -> f32x16<S> {
        let (low, high, far) = self.heights(simd, points, &load(simd, &parts.normals));
        let reaches = f32x16::load_array_ref(simd, &parts.reaches);
        let slabs = f32x16::load_array_ref(simd, &parts.slabs);
        let beside = low.max(-high) - slabs - far * RELATIVE - self.off;
        (self.distances(simd, points) - reaches).max(beside)
    }

    /// The lanes of discs that may be within their thickness or within `reach` of the triangle, as
    /// a bit mask.
    #[inline(always)]
    pub(super) fn discs_near<S: Simd>(&self, simd: S, block: &LeafBlock, reach: f32) -> u32 {
        let (positions, normals, discs) = (block.positions(simd), block.normals(simd), block.discs(simd));
        let step = step_of(block);
        let thick = (discs * THICKNESS).max(reach);
        let (low, high, far) = self.heights(simd, &positions, &normals);
        // Normals are off by less than a step in each component.
        let most = thick + far * (1.3 / STEPS) + (step + self.off);
        let beside: mask32x16<S> = low.simd_gt(most) | high.simd_lt(-most);
        if bits(beside) == 0xffff {
            return 0;
        }
        let gaps = self.distances(simd, &positions) - (discs + thick + step);
        let beyond: mask32x16<S> = gaps.simd_gt(0.0);
        !bits(beside | beyond) & 0xffff
    }
}

/// The error of a position and of a radius in a block.
#[inline(always)]
pub(super) fn step_of(block: &LeafBlock) -> f32 {
    let [x, y, z] = block.half;
    2.0 * (x * x + y * y + z * z).sqrt() / STEPS
}
