//! The two nearest points of two leaves. For each point of a that may be near, sixteen points of b
//! are compared in single precision. The nearest candidates are measured in double precision, in
//! the world, with the same result as brute force.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16};
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{NodePair, Part};
use nearmiss_index::PointBlock;
use nearmiss_lanes::wide::{bits, blocks_of, lanes_of, load, squared};

use crate::pair::pairing::ItemPair;
use crate::pair::scan_pair::ScanPair;

const WIDTH: usize = PointBlock::WIDTH;

impl ScanPair<'_> {
    /// Two points and their distance in the world, for obstacles minus the radii of their balls.
    pub(crate) fn point_pair(&self, points: [usize; 2]) -> ItemPair {
        let [p, q] = [0, 1].map(|k| Vector3::from(self.views[k].point(points[k])));
        let balls = if self.is_of_balls(points) { self.balls(points).iter().sum() } else { 0.0 };
        ItemPair { distance: (p - q).norm() - balls, items: points }
    }
}

/// Returns `true` if either leaf contains points represented by balls.
#[inline(always)]
fn has_balls(pair: &ScanPair<'_>, [a, b]: [usize; 2]) -> bool {
    pair.part == Part::Obstacle && (pair.a.leaves.has_balls(a) || pair.b.leaves.has_balls(b))
}

/// The nearest of `best` and all point pairs of two leaves; among equals the first found.
pub(crate) fn nearest(level: Level, pair: &ScanPair<'_>, leaves: NodePair, best: ItemPair) -> ItemPair {
    dispatch!(level, simd => simd.vectorize(
        #[inline(always)]
        || nearest_by(simd, pair, leaves, best),
    ))
}

#[inline(always)]
fn nearest_by<S: Simd>(simd: S, pair: &ScanPair<'_>, leaves: NodePair, mut best: ItemPair) -> ItemPair {
    let [leaf_a, leaf_b] = pair.numbers(leaves);
    let (points_a, points_b) = (pair.a.leaves.points(leaf_a), pair.b.leaves.points(leaf_b));
    let bounds = &pair.b.tree.bounds(leaves.b);
    let zero = f32x16::simd_from(simd, 0.0);
    let mut reach = reach_of(pair, best.distance);
    let has_balls = has_balls(pair, [leaf_a, leaf_b]);
    for block_a in blocks_of(&points_a) {
        let own = load(simd, &pair.a.blocks[block_a].position);
        let centres = pair.relative.points_back(&own);
        let places = [centres[0].to_array(), centres[1].to_array(), centres[2].to_array()];
        // The distance of each point from the box of b.
        let d = [centres[0] - bounds.centre[0], centres[1] - bounds.centre[1], centres[2] - bounds.centre[2]];
        let off = in_terms_of(&bounds.axes, &d);
        let beyond = [
            (off[0].abs() - bounds.half[0]).max(zero),
            (off[1].abs() - bounds.half[1]).max(zero),
            (off[2].abs() - bounds.half[2]).max(zero),
        ];
        let off_sq = squared(beyond);
        let balls_a = if has_balls { pair.a.obstacle_balls(block_a) } else { [0.0; WIDTH] };
        let balls_a = f32x16::load_array_ref(simd, &balls_a) * pair.relative.scale_back();
        for block_b in blocks_of(&points_b) {
            let mut left = lanes_of(block_a, &points_a);
            let mut of_b = None;
            loop {
                let most = balls_a + reach;
                let near: mask32x16<S> = off_sq.simd_le(most * most);
                left &= bits(near);
                if left == 0 {
                    break;
                }
                let lane = left.trailing_zeros() as usize;
                left &= left - 1;
                let (positions, balls_b) = *of_b.get_or_insert_with(
                    #[inline(always)]
                    || {
                        let balls = if has_balls { pair.b.obstacle_balls(block_b) } else { [0.0; WIDTH] };
                        (load(simd, &pair.b.blocks[block_b].position), f32x16::load_array_ref(simd, &balls))
                    },
                );
                let [x, y, z] = positions;
                let d_sq = squared([x - places[0][lane], y - places[1][lane], z - places[2][lane]]);
                let both = balls_b + balls_a.to_array()[lane];
                let mut left_b = lanes_of(block_b, &points_b);
                loop {
                    let most = both + reach;
                    let near: mask32x16<S> = d_sq.simd_le(most * most);
                    left_b &= bits(near);
                    if left_b == 0 {
                        break;
                    }
                    let other = least(&d_sq.to_array(), left_b);
                    left_b &= !(1 << other);
                    let points = [block_a * WIDTH + lane, block_b * WIDTH + other];
                    let own = pair.point_pair(points);
                    if own.distance < best.distance {
                        best = own;
                        reach = reach_of(pair, best.distance);
                    }
                }
            }
        }
    }
    best
}

/// The components of vectors along three axes.
#[inline(always)]
fn in_terms_of<S: Simd>([u, v, w]: &[[f32; 3]; 3], [x, y, z]: &[f32x16<S>; 3]) -> [f32x16<S>; 3] {
    let (x, y, z) = (*x, *y, *z);
    [x * u[0] + y * u[1] + z * u[2], x * v[0] + y * v[1] + z * v[2], x * w[0] + y * w[1] + z * w[2]]
}

/// An upper bound, in b's stored frame, of the computed distance of points that are within
/// `distance` of each other. Allows for rounding; does not include the balls of the points.
#[inline(always)]
fn reach_of(pair: &ScanPair<'_>, distance: f64) -> f32 {
    let stored = pair.stored(distance.max(0.0)) + 3.0 * pair.relative.slack();
    stored * pair.relative.scale_back() * (1.0 + 2e-6)
}

/// The lane with the least value among `lanes`, which must not be empty; the first among equals.
#[inline(always)]
fn least(values: &[f32; WIDTH], lanes: u32) -> usize {
    let mut least = lanes.trailing_zeros() as usize;
    for (lane, value) in values.iter().enumerate() {
        if lanes >> lane & 1 != 0 && *value < values[least] {
            least = lane;
        }
    }
    least
}
