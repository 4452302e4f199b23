//! Lower bounds on the distance of obstacles, from the points of a leaf.
//!
//! The part of a point in the obstacle is in a ball about the point and, if it is on a sheet, in a slab
//! about its tangent plane ([`ObstacleParts`]). So a leaf's part of the obstacle is in the union of these
//! cut balls. They give a much better bound than the box of the leaf if that is mostly empty, as at a
//! silhouette in a depth frame or between strays, and a better one wherever two sheets face each other.

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16};
use nearmiss_geometry::NodeId;
use nearmiss_hierarchy::{NodePair, ObstacleParts, OrientedBox, Part, Relative, ScanArrays};
use nearmiss_lanes::wide::{Vectors, along, bits, blocks_of, lanes_of, load, product, squared};

use crate::pair::pairing::Pairing;
use crate::pair::scan_pair::ScanPair;

/// An upper bound on the error of the square of a sine: normals are unit up to rounding, also turned ones.
const SINE_SQ: f32 = 1e-4;

/// The part of a height that is left if its normal is not longer than a unit vector, up to rounding.
const HEIGHT: f32 = 1.0 - 1e-5;

/// Balls in lanes.
#[derive(Clone, Copy)]
struct Balls<S: Simd> {
    centres: Vectors<S>,
    radii: f32x16<S>,
    /// The lanes in use, as a bit mask.
    lanes: u32,
}

/// The cut balls about the points of a leaf that contain its part of the obstacle, in lanes, in one of the
/// two stored frames.
#[derive(Clone, Copy)]
struct CutBalls<S: Simd> {
    balls: Balls<S>,
    normals: Vectors<S>,
    /// Half the thicknesses of the slabs; infinite for whole balls.
    slabs: f32x16<S>,
    /// The radii of the circles in which the faces of the slabs meet the balls.
    faces: f32x16<S>,
}

impl<S: Simd> Balls<S> {
    /// The balls about the points of a leaf that contain its part of the obstacle.
    #[inline(always)]
    fn of(simd: S, scan: &ScanArrays<'_>, leaf: &Range<usize>, block: usize) -> Self {
        let radii = f32x16::load_array_ref(simd, &scan.obstacle_reaches(block));
        Self { centres: load(simd, &scan.blocks[block].position), radii, lanes: lanes_of(block, leaf) }
    }

    /// Moves balls of a into b's frame.
    #[inline(always)]
    fn moved_back(self, relative: &Relative) -> Self {
        let centres = relative.points_back(&self.centres);
        Self { centres, radii: self.radii * relative.scale_back(), ..self }
    }

    /// Moves balls of b into a's frame.
    #[inline(always)]
    fn moved(self, relative: &Relative) -> Self {
        let centres = relative.points(&self.centres);
        Self { centres, radii: self.radii * relative.scale(), ..self }
    }

    /// The least distance of any ball from the box.
    #[inline(always)]
    fn gap_to_box(&self, simd: S, bounds: &OrientedBox) -> f32 {
        self.least(simd, self.gaps_to_box(simd, bounds))
    }

    /// The distance of each ball from the box.
    #[inline(always)]
    fn gaps_to_box(&self, simd: S, bounds: &OrientedBox) -> f32x16<S> {
        let d = self.seen_from(bounds.centre);
        let mut beyond_sq = f32x16::splat(simd, 0.0);
        for k in 0..3 {
            let beyond = (along(d, bounds.axes[k]).abs() - bounds.half[k]).max(0.0);
            beyond_sq += beyond * beyond;
        }
        beyond_sq.sqrt() - self.radii
    }

    #[inline(always)]
    fn seen_from(&self, [x, y, z]: [f32; 3]) -> Vectors<S> {
        [self.centres[0] - x, self.centres[1] - y, self.centres[2] - z]
    }

    #[inline(always)]
    fn least(&self, simd: S, of: f32x16<S>) -> f32 {
        let there = mask32x16::from_bitmask(simd, u64::from(self.lanes));
        there.select(of, f32x16::splat(simd, f32::INFINITY)).reduce_min()
    }
}

impl<S: Simd> CutBalls<S> {
    #[inline(always)]
    fn of(simd: S, scan: &ScanArrays<'_>, leaf: &Range<usize>, block: usize) -> Self {
        let ObstacleParts { normals, reaches, slabs } = scan.obstacle_parts(block);
        let (radii, slabs) = (f32x16::load_array_ref(simd, &reaches), f32x16::load_array_ref(simd, &slabs));
        let centres = load(simd, &scan.blocks[block].position);
        let faces = (radii * radii - slabs * slabs).max(0.0).sqrt();
        let balls = Balls { centres, radii, lanes: lanes_of(block, leaf) };
        Self { balls, normals: load(simd, &normals), slabs, faces }
    }

    /// Moves cut balls of b into a's frame.
    #[inline(always)]
    fn moved(self, relative: &Relative) -> Self {
        let (normals, scale) = (relative.directions(&self.normals), relative.scale());
        let balls = self.balls.moved(relative);
        Self { balls, normals, slabs: self.slabs * scale, faces: self.faces * scale }
    }

    /// The least distance of any cut ball from any of `others`, in the same frame; at most `most`.
    #[inline(always)]
    fn gap_to_others(&self, simd: S, others: &Self, most: f32) -> f32 {
        let [x, y, z] = stored(&others.balls.centres);
        let [nx, ny, nz] = stored(&others.normals);
        let radii = others.balls.radii.to_array();
        let (slabs, faces) = (others.slabs.to_array(), others.faces.to_array());
        let there = mask32x16::from_bitmask(simd, u64::from(self.balls.lanes));
        let (mut least, mut left) = (most, others.balls.lanes);
        while left != 0 {
            let lane = left.trailing_zeros() as usize;
            left &= left - 1;
            let d = self.balls.seen_from([x[lane], y[lane], z[lane]]);
            let away = squared(d).sqrt();
            let of_balls = away - self.balls.radii - radii[lane];
            // Whole balls are a bound as well. Not `<`, which would be false for NaN.
            let is_beyond: mask32x16<S> = of_balls.simd_ge(least);
            if bits(there & !is_beyond) == 0 {
                continue;
            }
            let normal = [nx[lane], ny[lane], nz[lane]];
            let other = [
                f32x16::splat(simd, radii[lane]),
                f32x16::splat(simd, slabs[lane]),
                f32x16::splat(simd, faces[lane]),
            ];
            let own = [self.balls.radii, self.slabs, self.faces];
            // Along the way between the centres, and along the normal of either.
            let per_length = 1.0 / away.max(f32::MIN_POSITIVE);
            let (of_own, of_other) = (product(d, self.normals).abs(), along(d, normal).abs());
            let by_way = away - extent(of_own * per_length, own) - extent(of_other * per_length, other);
            let cosine = along(self.normals, normal).abs();
            let by_own = of_own * HEIGHT - self.slabs - extent(cosine, other);
            let by_other = of_other * HEIGHT - slabs[lane] - extent(cosine, own);
            let own = self.balls.least(simd, by_way.max(by_own).max(by_other));
            least = if own >= least { least } else { own };
        }
        least
    }
}

#[inline(always)]
fn stored<S: Simd>([x, y, z]: &Vectors<S>) -> [[f32; 16]; 3] {
    [x.to_array(), y.to_array(), z.to_array()]
}

/// The extents of cut balls, with these radii, slabs and faces, from their centres in a direction, given the
/// absolute cosine of the direction and their normals.
///
/// The furthest place is that of the ball if the slab holds it, and on the rim of a face otherwise.
#[inline(always)]
fn extent<S: Simd>(cosine: f32x16<S>, [radii, slabs, faces]: [f32x16<S>; 3]) -> f32x16<S> {
    let sine = ((1.0 - cosine * cosine).max(0.0) + SINE_SQ).sqrt();
    let is_cut: mask32x16<S> = (cosine * radii).simd_gt(slabs);
    is_cut.select((slabs * cosine + faces * sine).min(radii), radii)
}

/// A lower bound on the distance of a leaf's part of the obstacle from a box in the scan's stored
/// frame, from the points of the leaf.
pub(crate) fn gap_of_leaf_and_box(
    level: Level,
    scan: &ScanArrays<'_>,
    leaf: NodeId,
    bounds: &OrientedBox,
) -> f32 {
    let points = &scan.tree.topology().points(leaf);
    dispatch!(level, simd => simd.vectorize(
        #[inline(always)]
        || {
            let mut least = f32::INFINITY;
            for block in blocks_of(points) {
                least = least.min(Balls::of(simd, scan, points, block).gap_to_box(simd, bounds));
            }
            least
        },
    ))
}

/// The lanes of a block of points, with a ball about each, that come within `most` of a box in the
/// same frame.
pub(crate) fn near_box(
    level: Level,
    (positions, balls, lanes): (&[[f32; 16]; 3], &[f32; 16], u32),
    bounds: &OrientedBox,
    most: f32,
) -> u32 {
    dispatch!(level, simd => simd.vectorize(
        #[inline(always)]
        || {
            let radii = f32x16::load_array_ref(simd, balls);
            let balls = Balls { centres: load(simd, positions), radii, lanes };
            // Not `<=`, which would be false for NaN.
            let beyond: mask32x16<_> = balls.gaps_to_box(simd, bounds).simd_gt(most);
            lanes & !bits(beyond)
        },
    ))
}

impl ScanPair<'_> {
    /// The gap of the parts of two nodes: the gap of their enclosures or, for obstacles, the gap of
    /// their points if that is greater.
    pub(crate) fn gap_of_parts(&self, pair: NodePair) -> f32 {
        self.better_gap(pair, self.gap_of_enclosures(pair))
    }

    /// The greater of `gap`, the gap of the enclosures of two nodes, and the gap that their points
    /// show.
    #[inline]
    pub(crate) fn better_gap(&self, pair: NodePair, gap: f32) -> f32 {
        match self.part {
            Part::Obstacle => self.gap_by_points(pair).map_or(gap, |by_points| by_points.max(gap)),
            Part::Surface => gap,
        }
    }

    /// A lower bound on the distance of the obstacles of two nodes, from the points of a loose leaf
    /// or of two leaves. `None` if boxes give the same.
    #[inline]
    pub(crate) fn gap_by_points(&self, pair: NodePair) -> Option<f32> {
        let [a, b] = self.which_are_leaves(pair);
        if a && b {
            return Some(self.gap_of_leaves(pair, f32::INFINITY));
        }
        let is_loose = |scan: &ScanArrays<'_>, leaf: NodeId| {
            scan.leaves.is_loose(scan.tree.topology().leaf_number(leaf))
        };
        let [loose_a, loose_b] = [a && is_loose(self.a, pair.a), b && is_loose(self.b, pair.b)];
        if !(loose_a || loose_b) {
            return None;
        }
        Some(self.gap_of_loose_leaf(pair, loose_a))
    }

    /// A separate function, so that the test for loose leaves takes no call.
    #[inline(never)]
    fn gap_of_loose_leaf(&self, pair: NodePair, of_a: bool) -> f32 {
        let level = self.level;
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.gap_of_points(simd, pair, of_a),
        ))
    }

    /// The same for a leaf and an inner node of obstacles; `None` for other pairs.
    #[inline]
    pub(crate) fn gap_by_leaf(&self, pair: NodePair) -> Option<f32> {
        let [a, b] = self.which_are_leaves(pair);
        if a == b || self.part == Part::Surface { None } else { self.gap_by_points(pair) }
    }

    /// The same for two leaves, from the points of each and the enclosure of the other.
    pub(crate) fn gap_of_leaf_boxes(&self, pair: NodePair) -> f32 {
        let level = self.level;
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.gap_of_points(simd, pair, true).max(self.gap_of_points(simd, pair, false)),
        ))
    }

    /// The same from the points of a leaf, of a if `of_a` and of b otherwise, and the enclosure of
    /// the other node.
    #[inline(always)]
    fn gap_of_points<S: Simd>(&self, simd: S, pair: NodePair, of_a: bool) -> f32 {
        let mut least = f32::INFINITY;
        if of_a {
            let leaf = &self.a.tree.topology().points(pair.a);
            let bounds = self.b.tree.enclosure(Part::Obstacle, pair.b);
            for block in blocks_of(leaf) {
                let balls = Balls::of(simd, self.a, leaf, block).moved_back(&self.relative);
                least = least.min(balls.gap_to_box(simd, &bounds));
            }
            return least * self.relative.scale();
        }
        let leaf = &self.b.tree.topology().points(pair.b);
        let bounds = self.a.tree.enclosure(Part::Obstacle, pair.a);
        for block in blocks_of(leaf) {
            let balls = Balls::of(simd, self.b, leaf, block).moved(&self.relative);
            least = least.min(balls.gap_to_box(simd, &bounds));
        }
        least
    }

    /// The same for two leaves, from the points of both; at most `most`.
    pub(crate) fn gap_of_leaves(&self, pair: NodePair, most: f32) -> f32 {
        let level = self.level;
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.gap_of_leaves_by(simd, pair, most),
        ))
    }

    #[inline(always)]
    fn gap_of_leaves_by<S: Simd>(&self, simd: S, pair: NodePair, most: f32) -> f32 {
        let (leaf_a, leaf_b) =
            (&self.a.tree.topology().points(pair.a), &self.b.tree.topology().points(pair.b));
        let mut least = most;
        for block_b in blocks_of(leaf_b) {
            let of_b = CutBalls::of(simd, self.b, leaf_b, block_b).moved(&self.relative);
            for block_a in blocks_of(leaf_a) {
                let of_a = CutBalls::of(simd, self.a, leaf_a, block_a);
                least = of_a.gap_to_others(simd, &of_b, least);
            }
        }
        least
    }
}

#[cfg(test)]
mod tests;
