//! A triangle compared with sixteen points at a time, in single precision.
//!
//! Distances are lower bounds, rounding included: a filter by them loses nothing, and a gap that
//! they show is proven.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x4, f32x16, mask32x16};
use nearmiss_hierarchy::{LEAF_TRIANGLES, LeafBlock, OrientedBox, Relative, THICKNESS, TriangleBlock};
use nearmiss_lanes::wide::{Vectors, along, bits, load, product, squared};

/// Coordinates beyond this have squares near the end of single precision.
const FARTHEST: f32 = 1e15;

/// A triangle narrower than this share of its longest edge is compared by its edges alone, as
/// rounding leaves its normal no direction.
const NEEDLE: f64 = 1e-4;

/// Relative error of a distance. Rounding tilts the normal by up to 2e-7 over [`NEEDLE`], which
/// shortens a height by half the square of that.
const RELATIVE: f32 = 1e-5;

/// Rounding error along an edge, relative to the longest edge.
const OF_EDGES: f32 = 2e-6;

/// The number of steps of a position or normal in a [`LeafBlock`].
const STEPS: f32 = 32767.0;

/// A triangle in a scan's stored frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LaneTriangle {
    corners: [[f32; 3]; 3],
    /// Unit directions of the edges; zero for an edge without length.
    along: [[f32; 3]; 3],
    lengths: [f32; 3],
    /// The unit normal, and unit vectors in the plane from each edge inwards. `None` for needles.
    face: Option<([f32; 3], [[f32; 3]; 3])>,
    /// The error of a distance; infinite if coordinates are out of range.
    off: f32,
}

#[expect(clippy::cast_possible_truncation, reason = "the error is counted in `off`")]
fn single(v: [f64; 3]) -> [f32; 3] {
    v.map(|c| c as f32)
}

fn dot([a, b, c]: [f64; 3], [x, y, z]: [f64; 3]) -> f64 {
    a * x + b * y + c * z
}

fn cross(e: [f64; 3], f: [f64; 3]) -> [f64; 3] {
    [e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]]
}

impl LaneTriangle {
    /// A triangle whose corners are each off by at most `slack` in each coordinate.
    #[expect(clippy::cast_possible_truncation, reason = "the error is counted in `off`")]
    pub(crate) fn new(corners: [[f32; 3]; 3], slack: f32) -> Self {
        let wide = corners.map(|corner| corner.map(f64::from));
        let edges = [0, 1, 2].map(|i| [0, 1, 2].map(|k| wide[(i + 1) % 3][k] - wide[i][k]));
        let lengths = edges.map(|edge| dot(edge, edge).sqrt());
        let unit = |v: [f64; 3], length: f64| v.map(|c| if length > 0.0 { c / length } else { 0.0 });
        let longest = lengths[0].max(lengths[1]).max(lengths[2]);
        let normal = cross(edges[0], edges[1]);
        let twice_area = dot(normal, normal).sqrt();
        let is_needle = !(twice_area > NEEDLE * longest * longest);
        let face = (!is_needle).then(|| {
            let normal = unit(normal, twice_area);
            let inward = [0, 1, 2].map(|i| single(cross(normal, unit(edges[i], lengths[i]))));
            (single(normal), inward)
        });
        let width = if is_needle { (NEEDLE * longest) as f32 } else { 0.0 };
        let is_far = !corners.iter().flatten().all(|x| x.abs() < FARTHEST);
        let off = if is_far { f32::INFINITY } else { 4.0 * slack + OF_EDGES * longest as f32 + width };
        Self {
            corners: if is_far { [[0.0; 3]; 3] } else { corners },
            along: [0, 1, 2].map(|i| single(unit(edges[i], lengths[i]))),
            lengths: lengths.map(|length| length as f32),
            face: face.filter(|_| !is_far),
            off,
        }
    }

    /// Lower bounds on the distances of these points from the triangle. Negative for points that
    /// may lie on it.
    #[inline(always)]
    fn distances<S: Simd>(&self, simd: S, [x, y, z]: &Vectors<S>) -> f32x16<S> {
        let mut nearest = f32x16::splat(simd, f32::INFINITY);
        let mut inside = f32x16::splat(simd, f32::INFINITY);
        let mut height = inside;
        for i in 0..3 {
            let ([cx, cy, cz], [ux, uy, uz]) = (self.corners[i], self.along[i]);
            let d = [*x - cx, *y - cy, *z - cz];
            let share = along(d, self.along[i]).max(0.0).min(self.lengths[i]);
            nearest = nearest.min(squared([d[0] - share * ux, d[1] - share * uy, d[2] - share * uz]));
            if let Some((normal, inward)) = &self.face {
                inside = inside.min(along(d, inward[i]));
                height = along(d, *normal);
            }
        }
        if self.face.is_some() {
            let zero = f32x16::splat(simd, 0.0);
            let is_above: mask32x16<S> = inside.simd_ge(zero);
            nearest = is_above.select(nearest.min(height * height), nearest);
        }
        nearest.sqrt() * (1.0 - RELATIVE) - self.off
    }

    /// Lower bounds on the distances of the points of a block.
    pub(crate) fn distances_of(&self, level: Level, positions: &[[f32; 16]; 3]) -> [f32; 16] {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.distances(simd, &load(simd, positions)).to_array(),
        ))
    }

    /// The least of the distances of the points among `lanes`, a bit mask, each less its reach.
    pub(crate) fn least_gap(
        &self,
        level: Level,
        positions: &[[f32; 16]; 3],
        reaches: &[f32; 16],
        lanes: u32,
    ) -> f32 {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || {
                let gaps = self.distances(simd, &load(simd, positions)) - f32x16::load_array_ref(simd, reaches);
                let there = mask32x16::from_bitmask(simd, u64::from(lanes));
                there.select(gaps, f32x16::splat(simd, f32::INFINITY)).reduce_min()
            },
        ))
    }

    /// The lanes of balls within `reach` of the triangle, as a bit mask. Lanes with a radius of 0
    /// hold no ball.
    pub(crate) fn balls_near(
        &self,
        level: Level,
        positions: &[[f32; 16]; 3],
        balls: &[f32; 16],
        reach: f32,
    ) -> u32 {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.balls_near_by(simd, positions, balls, reach),
        ))
    }

    #[inline(always)]
    fn balls_near_by<S: Simd>(
        &self,
        simd: S,
        positions: &[[f32; 16]; 3],
        balls: &[f32; 16],
        reach: f32,
    ) -> u32 {
        let balls = f32x16::load_array_ref(simd, balls);
        let gaps = self.distances(simd, &load(simd, positions)) - balls;
        // Not `<=`, which would be false for NaN.
        let beyond: mask32x16<S> = gaps.simd_gt(reach);
        let are_balls: mask32x16<S> = balls.simd_gt(0.0);
        !bits(beyond) & bits(are_balls)
    }

    /// The lanes of discs that may be within their thickness or within `reach` of the triangle, as
    /// a bit mask.
    #[inline]
    pub(crate) fn discs_near(&self, level: Level, block: &LeafBlock, reach: f32) -> u32 {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.discs_near_by(simd, block, reach),
        ))
    }

    #[inline(always)]
    fn discs_near_by<S: Simd>(&self, simd: S, block: &LeafBlock, reach: f32) -> u32 {
        let (positions, normals, discs) = (block.positions(simd), block.normals(simd), block.discs(simd));
        let [hx, hy, hz] = block.half;
        // The error of a stored position and of a stored radius.
        let step = 2.0 * (hx * hx + hy * hy + hz * hz).sqrt() / STEPS;
        let thick = (discs * THICKNESS).max(reach);
        // Heights of the corners over the planes of the discs. Normals are off by less than a step
        // in each component.
        let (mut low, mut far) = (f32x16::splat(simd, f32::INFINITY), f32x16::splat(simd, 0.0));
        let mut high = -low;
        for [cx, cy, cz] in self.corners {
            let d = [-(positions[0] - cx), -(positions[1] - cy), -(positions[2] - cz)];
            let height = product(d, normals);
            (low, high) = (low.min(height), high.max(height));
            far = far.max(d[0].abs() + d[1].abs() + d[2].abs());
        }
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

/// The four triangles of a leaf in the frame of a scan.
pub(crate) struct LeafTriangles {
    corners: [[[f32; 4]; 3]; 3],
    slack: f32,
}

impl LeafTriangles {
    pub(crate) fn new(level: Level, block: &TriangleBlock, relative: &Relative) -> Self {
        let corners = dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || block.load(simd).map(
                #[inline(always)]
                |corner| relative.points_of_four(corner).map(|row| row.to_array()),
            ),
        ));
        Self { corners, slack: relative.slack() }
    }

    /// The triangle in a lane.
    pub(crate) fn get(&self, lane: usize) -> LaneTriangle {
        LaneTriangle::new(self.corners.map(|corner| corner.map(|row| row[lane])), self.slack)
    }

    /// The gaps of the triangles and a box along the axes of the box: lower bounds on their
    /// distances up to `3 slack`. Negative for triangles that overlap the box along each axis.
    pub(crate) fn gaps_to_box(&self, level: Level, bounds: &OrientedBox) -> [f32; LEAF_TRIANGLES] {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || {
                let OrientedBox { centre: [cx, cy, cz], half, axes, .. } = bounds;
                let mut gap = f32x4::splat(simd, f32::NEG_INFINITY);
                for k in 0..3 {
                    let [ax, ay, az] = axes[k];
                    let (mut low, mut high) =
                        (f32x4::splat(simd, f32::INFINITY), f32x4::splat(simd, f32::NEG_INFINITY));
                    for [x, y, z] in &self.corners {
                        let load = f32x4::load_array_ref;
                        let (x, y, z) = (load(simd, x) - *cx, load(simd, y) - *cy, load(simd, z) - *cz);
                        let along = x * ax + y * ay + z * az;
                        (low, high) = (low.min(along), high.max(along));
                    }
                    gap = gap.max(low.max(-high) - half[k]);
                }
                gap.to_array()
            },
        ))
    }
}

#[cfg(test)]
mod tests {
    use nearmiss_mesh::nearest_on_triangle;
    use nearmiss_testdata::arbitrary::{point_in, rng};
    use nearmiss_testdata::instructions::levels;
    use rand::RngExt;

    use super::*;

    #[test]
    fn distances_are_below_those_in_double_precision_and_near_them() {
        let rng = &mut rng(61);
        let (mut share, mut count) = (0.0, 0.0);
        for round in 0..3000_usize {
            let wide = [1.0, 30.0, 1e-3, 1e4][round % 4];
            let [p, along] = [point_in(rng, 1.0), point_in(rng, wide)];
            // From a right triangle to a needle without area.
            let thin = [1.0, 1e-2, 1e-4, 1e-6, 0.0][round % 5] * wide;
            let [q, r] = [1.0, rng.random_range(-1.0..1.0)].map(|t: f64| {
                let beside = point_in(rng, thin);
                [0, 1, 2].map(|k| p[k] + t * along[k] + beside[k])
            });
            let corners = [p, q, r].map(single);
            let slack = 1e-7;
            let triangle = LaneTriangle::new(corners, slack);
            let mut positions = [[0.0; 16]; 3];
            for lane in 0..16 {
                let place = single(point_in(rng, 2.0));
                (0..3).for_each(|k| positions[k][lane] = place[k]);
            }
            let found: Vec<_> =
                levels().into_iter().map(|level| triangle.distances_of(level, &positions)).collect();
            assert!(found.iter().all(|other| *other == found[0]), "every level: {found:?}");
            for lane in 0..16 {
                let place = [0, 1, 2].map(|k| f64::from(positions[k][lane]));
                let foot = nearest_on_triangle(&corners.map(|corner| corner.map(f64::from)), place);
                let exact = (0..3).map(|k| (place[k] - foot[k]).powi(2)).sum::<f64>().sqrt();
                let bound = f64::from(found[0][lane]);
                assert!(bound <= exact, "round {round}: {bound}, is {exact}, {corners:?}");
                if wide < 100.0 && exact > 0.1 {
                    (share, count) = (share + bound / exact, count + 1.0);
                }
            }
        }
        assert!(count > 10_000.0 && share / count > 0.999, "{share} of {count}");
    }

    #[test]
    fn triangles_out_of_range_bound_nothing() {
        let triangle = LaneTriangle::new([[1e20, 0.0, 0.0], [0.0; 3], [0.0, f32::INFINITY, 0.0]], 1.0);
        let found = triangle.distances_of(Level::new(), &[[5.0; 16]; 3]);
        assert!(found.iter().all(|&bound| bound == f32::NEG_INFINITY), "{found:?}");
    }
}
