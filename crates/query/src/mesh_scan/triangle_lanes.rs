//! The four triangles of a leaf compared with sixteen points at a time, in single precision.
//!
//! Distances are lower bounds, rounding included: a filter by them loses nothing, and a gap that
//! they show is proven.

mod prepared;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x4, f32x16, mask32x16};
use nearmiss_hierarchy::{
    LEAF_TRIANGLES, LeafBlock, ObstacleParts, OrientedBox, Relative, THICKNESS, TriangleBlock,
};
use nearmiss_lanes::wide::{along, bits, load, product};

use crate::mesh_scan::triangle_lanes::prepared::{Prepared, STEPS, step_of};

/// The positions and the balls of the points of a block, and the lanes in use.
type Reaching<'a> = (&'a [[f32; 16]; 3], &'a [f32; 16], u32);

/// The positions of the points of a block, what contains the obstacle near them, and the lanes in use.
type ReachingParts<'a> = (&'a [[f32; 16]; 3], &'a ObstacleParts, u32);

/// The triangles of a leaf and their relative pose.
#[derive(Clone, Copy)]
pub(crate) struct LeafTriangles<'a> {
    pub(crate) level: Level,
    pub(crate) block: &'a TriangleBlock,
    pub(crate) relative: &'a Relative,
}

/// The box of a block's leaf.
#[inline(always)]
fn box_of(block: &LeafBlock) -> OrientedBox {
    OrientedBox { centre: block.centre, half: block.half, axes: block.axes, reach: 0.0 }
}

/// Returns the gaps of triangles and a box along the axes of the box: lower bounds on their
/// distances up to three times the error of a coordinate. Negative if they overlap along each axis.
#[inline(always)]
fn gaps_to_box<S: Simd>(simd: S, corners: &[[f32x4<S>; 3]; 3], bounds: &OrientedBox) -> f32x4<S> {
    let [cx, cy, cz] = bounds.centre;
    let mut gap = f32x4::splat(simd, f32::NEG_INFINITY);
    for k in 0..3 {
        let [ax, ay, az] = bounds.axes[k];
        let mut low = f32x4::splat(simd, f32::INFINITY);
        let mut high = -low;
        for [x, y, z] in corners {
            let along = (*x - cx) * ax + (*y - cy) * ay + (*z - cz) * az;
            (low, high) = (low.min(along), high.max(along));
        }
        gap = gap.max(low.max(-high) - bounds.half[k]);
    }
    gap
}

impl LeafTriangles<'_> {
    /// The corners in the scan's stored frame.
    #[inline(always)]
    fn corners<S: Simd>(&self, simd: S) -> [[f32x4<S>; 3]; 3] {
        let [p, q, r] = self.block.load(simd);
        let relative = self.relative;
        [relative.points_of_four(p), relative.points_of_four(q), relative.points_of_four(r)]
    }

    /// The lanes of discs of a block that may be within their thickness or within `reach` of each
    /// triangle, as bit masks.
    #[inline]
    pub(crate) fn discs_near(&self, block: &LeafBlock, reach: f32) -> [u32; LEAF_TRIANGLES] {
        dispatch!(self.level, simd => simd.vectorize(
            #[inline(always)]
            || self.discs_near_by(simd, block, reach),
        ))
    }

    #[inline(always)]
    fn discs_near_by<S: Simd>(&self, simd: S, block: &LeafBlock, reach: f32) -> [u32; LEAF_TRIANGLES] {
        let (corners, slack) = (self.corners(simd), self.relative.slack());
        // The box contains the discs with their thickness.
        let beyond =
            gaps_to_box(simd, &corners, &box_of(block)).simd_gt(f32x4::splat(simd, reach + 3.0 * slack));
        let beyond = beyond.to_bitmask();
        let mut near = [0; LEAF_TRIANGLES];
        if beyond == 0xf {
            return near;
        }
        let prepared = Prepared::new(simd, corners, slack);
        for lane in 0..LEAF_TRIANGLES {
            if beyond >> lane & 1 == 0 {
                near[lane] = prepared.get(lane).discs_near(simd, block, reach);
            }
        }
        near
    }

    /// The lanes of balls within `reach` of each triangle, as bit masks. Lanes with a radius of 0
    /// hold no ball.
    pub(crate) fn balls_near(
        &self,
        positions: &[[f32; 16]; 3],
        balls: &[f32; 16],
        bounds: &OrientedBox,
        reach: f32,
    ) -> [u32; LEAF_TRIANGLES] {
        dispatch!(self.level, simd => simd.vectorize(
            #[inline(always)]
            || self.balls_near_by(simd, (positions, balls), bounds, reach),
        ))
    }

    #[inline(always)]
    fn balls_near_by<S: Simd>(
        &self,
        simd: S,
        (positions, balls): (&[[f32; 16]; 3], &[f32; 16]),
        bounds: &OrientedBox,
        reach: f32,
    ) -> [u32; LEAF_TRIANGLES] {
        let (corners, slack) = (self.corners(simd), self.relative.slack());
        let beyond = gaps_to_box(simd, &corners, bounds).simd_gt(f32x4::splat(simd, reach + 3.0 * slack));
        let beyond = beyond.to_bitmask();
        let mut near = [0; LEAF_TRIANGLES];
        if beyond == 0xf {
            return near;
        }
        let prepared = Prepared::new(simd, corners, slack);
        let (positions, balls) = (load(simd, positions), f32x16::load_array_ref(simd, balls));
        let are_balls: mask32x16<S> = balls.simd_gt(0.0);
        for lane in 0..LEAF_TRIANGLES {
            if beyond >> lane & 1 == 0 {
                let gaps = prepared.get(lane).distances(simd, &positions) - balls;
                // Not `<=`, which would be false for NaN.
                let beyond: mask32x16<S> = gaps.simd_gt(reach);
                near[lane] = !bits(beyond) & bits(are_balls);
            }
        }
        near
    }

    /// The least gap of the triangles in `lanes` and an enclosure of points: for each triangle its
    /// gap along the axes of the enclosure or, if that is greater, its least distance from the part of a
    /// point.
    pub(crate) fn least_gap(
        &self,
        lanes: u32,
        enclosure: &OrientedBox,
        points: Option<ReachingParts<'_>>,
    ) -> f32 {
        dispatch!(self.level, simd => simd.vectorize(
            #[inline(always)]
            || self.least_gap_by(simd, lanes, enclosure, points),
        ))
    }

    #[inline(always)]
    fn least_gap_by<S: Simd>(
        &self,
        simd: S,
        lanes: u32,
        enclosure: &OrientedBox,
        points: Option<ReachingParts<'_>>,
    ) -> f32 {
        let (corners, slack) = (self.corners(simd), self.relative.slack());
        let gaps = gaps_to_box(simd, &corners, enclosure) - 2.0 * slack;
        let mut gaps = gaps.to_array();
        if let Some((positions, parts, used)) = points {
            let prepared = Prepared::new(simd, corners, slack);
            let positions = load(simd, positions);
            let there = mask32x16::from_bitmask(simd, u64::from(used));
            for lane in 0..LEAF_TRIANGLES {
                let own = prepared.get(lane).gaps_to_parts(simd, &positions, parts);
                let least = there.select(own, f32x16::splat(simd, f32::INFINITY)).reduce_min();
                gaps[lane] = if least > gaps[lane] { least } else { gaps[lane] };
            }
        }
        let mut least = f32::INFINITY;
        for lane in 0..LEAF_TRIANGLES {
            if lanes >> lane & 1 != 0 && (gaps[lane] < least || gaps[lane].is_nan()) {
                least = gaps[lane];
            }
        }
        least
    }

    /// Lower bounds on the distances of points from each triangle, less their balls, and the lanes of
    /// those that are at most `most`. `points` has positions, balls and the lanes in use. `None` if
    /// no triangle is within `most` of the box of the points.
    pub(crate) fn point_gaps(
        &self,
        points: Reaching<'_>,
        bounds: &OrientedBox,
        most: f32,
    ) -> Option<([[f32; 16]; LEAF_TRIANGLES], [u32; LEAF_TRIANGLES])> {
        dispatch!(self.level, simd => simd.vectorize(
            #[inline(always)]
            || self.point_gaps_by(simd, points, bounds, most),
        ))
    }

    #[inline(always)]
    fn point_gaps_by<S: Simd>(
        &self,
        simd: S,
        (positions, balls, used): Reaching<'_>,
        bounds: &OrientedBox,
        most: f32,
    ) -> Option<([[f32; 16]; LEAF_TRIANGLES], [u32; LEAF_TRIANGLES])> {
        let (corners, slack) = (self.corners(simd), self.relative.slack());
        let beyond = gaps_to_box(simd, &corners, bounds).simd_gt(f32x4::splat(simd, most + 3.0 * slack));
        let beyond = beyond.to_bitmask();
        if beyond == 0xf {
            return None;
        }
        let prepared = Prepared::new(simd, corners, slack);
        let (positions, balls) = (load(simd, positions), f32x16::load_array_ref(simd, balls));
        let (mut all, mut near) = ([[f32::INFINITY; 16]; LEAF_TRIANGLES], [0; LEAF_TRIANGLES]);
        for lane in 0..LEAF_TRIANGLES {
            if beyond >> lane & 1 == 0 {
                let gaps = prepared.get(lane).distances(simd, &positions) - balls;
                // Not `<=`, which would be false for NaN.
                let beyond: mask32x16<S> = gaps.simd_gt(most);
                (all[lane], near[lane]) = (gaps.to_array(), used & !bits(beyond));
            }
        }
        Some((all, near))
    }
}

/// Returns `true` if a disc of a block, with its thickness or within `reach`, may come into a box.
/// All are in the scan's stored frame, and the box is off by at most `slack` in each coordinate.
pub(crate) fn discs_reach_box(
    level: Level,
    (block, count): (&LeafBlock, usize),
    bounds: &OrientedBox,
    (reach, slack): (f32, f32),
) -> bool {
    dispatch!(level, simd => simd.vectorize(
        #[inline(always)]
        || discs_reach_box_by(simd, (block, count), bounds, (reach, slack)),
    ))
}

#[inline(always)]
fn discs_reach_box_by<S: Simd>(
    simd: S,
    (block, count): (&LeafBlock, usize),
    bounds: &OrientedBox,
    (reach, slack): (f32, f32),
) -> bool {
    let (positions, normals, discs) = (block.positions(simd), block.normals(simd), block.discs(simd));
    let [cx, cy, cz] = bounds.centre;
    let d = [positions[0] - cx, positions[1] - cy, positions[2] - cz];
    let thick = (discs * THICKNESS).max(reach) + (step_of(block) + 4.0 * slack);
    let mut beyond_sq = f32x16::splat(simd, 0.0);
    let mut most = thick + (d[0].abs() + d[1].abs() + d[2].abs()) * (1.3 / STEPS);
    for k in 0..3 {
        let beyond = (along(d, bounds.axes[k]).abs() - bounds.half[k]).max(0.0);
        beyond_sq += beyond * beyond;
        most += along(normals, bounds.axes[k]).abs() * (bounds.half[k] * (1.0 + 4.0 / STEPS));
    }
    let within = discs + thick;
    let beside: mask32x16<S> = product(d, normals).abs().simd_gt(most) | beyond_sq.simd_gt(within * within);
    !bits(beside) & ((1 << count) - 1) != 0
}

#[cfg(test)]
mod tests;
