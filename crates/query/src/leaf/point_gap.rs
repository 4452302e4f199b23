//! Lower bounds on the distance of obstacles, from the points of a leaf.
//!
//! No part of the obstacle is further from its nearest point than that point's reach
//! ([`ScanArrays::obstacle_reach`]). So balls of these radii about the points of a leaf contain its
//! part of the obstacle. If a leaf spans a gap, such as a silhouette in a depth frame, or contains
//! strays, its box is mostly empty and these balls give a much better bound.

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16};
use nearmiss_geometry::NodeId;
use nearmiss_hierarchy::{NodePair, OrientedBox, Part, Relative, ScanArrays};
use nearmiss_lanes::wide::{bits, blocks_of, lanes_of, load};

use crate::pair::pairing::Pairing;
use crate::pair::scan_pair::ScanPair;

/// Points of a leaf in lanes, in one of the two stored frames, with the reach of the obstacle about
/// each.
#[derive(Clone, Copy)]
struct Balls<S: Simd> {
    centres: [f32x16<S>; 3],
    reaches: f32x16<S>,
    /// The lanes that belong to the leaf, as a bit mask.
    lanes: u32,
}

impl<S: Simd> Balls<S> {
    #[inline(always)]
    fn of(simd: S, scan: &ScanArrays<'_>, leaf: &Range<usize>, block: usize) -> Self {
        let lanes = lanes_of(block, leaf);
        let reaches = f32x16::load_array_ref(simd, &scan.obstacle_reaches(block));
        Self { centres: load(simd, &scan.blocks[block].position), reaches, lanes }
    }

    /// The balls of a, moved into b's frame.
    #[inline(always)]
    fn moved_back(self, relative: &Relative) -> Self {
        let centres = relative.points_back(&self.centres);
        Self { centres, reaches: self.reaches * relative.scale_back(), ..self }
    }

    /// The balls of b, moved into a's frame.
    #[inline(always)]
    fn moved(self, relative: &Relative) -> Self {
        let centres = relative.points(&self.centres);
        Self { centres, reaches: self.reaches * relative.scale(), ..self }
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
            let [x, y, z] = bounds.axes[k];
            let beyond = ((d[0] * x + d[1] * y + d[2] * z).abs() - bounds.half[k]).max(0.0);
            beyond_sq += beyond * beyond;
        }
        beyond_sq.sqrt() - self.reaches
    }

    /// The least distance of any ball from any of `others`, in the same frame.
    #[inline(always)]
    fn gap_to_balls(&self, simd: S, others: &Self) -> f32 {
        let [x, y, z] = [0, 1, 2].map(|k| others.centres[k].to_array());
        let reaches = others.reaches.to_array();
        let mut nearest = f32x16::splat(simd, f32::INFINITY);
        let mut left = others.lanes;
        while left != 0 {
            let lane = left.trailing_zeros() as usize;
            left &= left - 1;
            let d = self.seen_from([x[lane], y[lane], z[lane]]);
            let away = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
            nearest = nearest.min(away - reaches[lane]);
        }
        self.least(simd, nearest - self.reaches)
    }

    #[inline(always)]
    fn seen_from(&self, [x, y, z]: [f32; 3]) -> [f32x16<S>; 3] {
        [self.centres[0] - x, self.centres[1] - y, self.centres[2] - z]
    }

    #[inline(always)]
    fn least(&self, simd: S, of: f32x16<S>) -> f32 {
        let there = mask32x16::from_bitmask(simd, u64::from(self.lanes));
        there.select(of, f32x16::splat(simd, f32::INFINITY)).reduce_min()
    }
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
            let reaches = f32x16::load_array_ref(simd, balls);
            let balls = Balls { centres: load(simd, positions), reaches, lanes };
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
            return Some(self.gap_of_leaves(pair));
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

    /// The same for two leaves, from the points of both.
    pub(crate) fn gap_of_leaves(&self, pair: NodePair) -> f32 {
        let level = self.level;
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.gap_of_leaves_by(simd, pair),
        ))
    }

    #[inline(always)]
    fn gap_of_leaves_by<S: Simd>(&self, simd: S, pair: NodePair) -> f32 {
        let (leaf_a, leaf_b) =
            (&self.a.tree.topology().points(pair.a), &self.b.tree.topology().points(pair.b));
        let mut least = f32::INFINITY;
        for block_b in blocks_of(leaf_b) {
            let of_b = Balls::of(simd, self.b, leaf_b, block_b).moved(&self.relative);
            for block_a in blocks_of(leaf_a) {
                let of_a = Balls::of(simd, self.a, leaf_a, block_a);
                least = least.min(of_a.gap_to_balls(simd, &of_b));
            }
        }
        least
    }
}
