//! The point nearest to a place: four boxes at a time, the nearest of them first.

use nearmiss_surface::{Centre, PointBlock};

use super::{Child, Siblings, WIDTH};
use crate::boxes::OrientedBox;
use crate::build::PointHierarchy;
use crate::gather::TREE_STACK;
use crate::split::id32;

impl Siblings {
    /// The squared distances of a place from the four boxes.
    #[inline]
    fn distances_sq(&self, [x, y, z]: [f32; 3]) -> [f32; WIDTH] {
        let mut sums = [0.0; WIDTH];
        for k in 0..3 {
            for lane in 0..WIDTH {
                let [ax, ay, az] = [self.axes[k][0][lane], self.axes[k][1][lane], self.axes[k][2][lane]];
                let [cx, cy, cz] = [self.centre[0][lane], self.centre[1][lane], self.centre[2][lane]];
                let along = ax * (x - cx) + ay * (y - cy) + az * (z - cz);
                let beyond = (along.abs() - self.half[k][lane]).max(0.0);
                sums[lane] += beyond * beyond;
            }
        }
        sums
    }
}

/// The squared distances of a place from the points of a block.
#[inline]
fn squares(block: &PointBlock, [x, y, z]: [f32; 3]) -> [f32; PointBlock::WIDTH] {
    let mut squares = [0.0; PointBlock::WIDTH];
    let [px, py, pz] = &block.position;
    for (lane, square) in squares.iter_mut().enumerate() {
        let d = [px[lane] - x, py[lane] - y, pz[lane] - z];
        *square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    }
    squares
}

/// The number in single precision, or a little more.
#[expect(clippy::cast_possible_truncation, reason = "rounded up")]
fn single_above(x: f64) -> f32 {
    (x as f32).next_up()
}

impl PointHierarchy {
    /// As [`Self::nearest_point_near`] if that is within `reach`; else a point that is at most a quarter further away, which
    /// takes far fewer looks. With the number of nodes that were looked at.
    ///
    /// # Panics
    /// When there is no such point.
    #[must_use]
    pub fn nearest_point_within(&self, i: usize, x: [f64; 3], reach: f64) -> (u32, u32) {
        /// The square of how many times as far a point may be beyond reach.
        const ROUGHLY: f64 = 1.25 * 1.25;
        let reach_sq = reach * reach;
        let place = Centre::new(x).rounded();
        let distance_sq = |p: [f32; 3]| (0..3).map(|k| (f64::from(p[k]) - x[k]).powi(2)).sum::<f64>();
        let (wide, positions): (_, &[[f32; 3]]) = (&self.wide, &self.positions);
        // Boxes hold the points; how far off they are is told in single precision.
        let lost = place.iter().fold(self.bounds_radius(), |far, c| far.max(f64::from(c.abs()))) * 4e-6;
        let bound = |sq: f32| (f64::from(sq.sqrt()) - lost).max(0.0).powi(2);
        let mut best = (distance_sq(positions[i]), i);
        // Which points of a leaf may be nearer is told in single precision, sixteen at a time.
        let look = |leaf: usize, best: &mut (f64, usize)| {
            let points = wide.leaves.points(leaf);
            for block in points.start / PointBlock::WIDTH..=(points.end - 1) / PointBlock::WIDTH {
                let most = single_above((best.0.sqrt() + lost).powi(2));
                let squares = squares(&self.blocks[block], place);
                let first = block * PointBlock::WIDTH;
                for (i, &square) in (first..).zip(&squares) {
                    if square <= most && points.contains(&i) {
                        let own = (distance_sq(positions[i]), i);
                        *best = if own < *best { own } else { *best };
                    }
                }
            }
        };
        let own_leaf = wide.leaves.leaf_of(i);
        look(own_leaf, &mut best);
        let mut stack = [(0.0, wide.root()); STACK];
        let (mut top, mut looked_at) = (1, 1);
        while top > 0 {
            top -= 1;
            let (least, child) = stack[top];
            // A point within reach is never passed over: one that is further away lets all nodes be looked at that come so near.
            if least > best.0 || (least > reach_sq && ROUGHLY * least > best.0) {
                continue;
            }
            looked_at += 1;
            if child.is_leaf() {
                if child.index() != own_leaf {
                    look(child.index(), &mut best);
                }
                continue;
            }
            let siblings = &wide.nodes[child.index()];
            let (bottom, distances) = (top, siblings.distances_sq(place));
            for (&child, sq) in siblings.children.iter().zip(distances).filter(|(c, _)| **c != Child::NONE) {
                let own = bound(sq);
                if own > best.0 {
                    continue;
                }
                // The nearest on top.
                let mut at = top;
                while at > bottom && stack[at - 1].0 < own {
                    stack[at] = stack[at - 1];
                    at -= 1;
                }
                stack[at] = (own, child);
                top += 1;
            }
        }
        (id32(best.1), looked_at)
    }

    /// No stored coordinate is greater.
    fn bounds_radius(&self) -> f64 {
        let OrientedBox { centre, .. } = self.boxes[0];
        f64::from(self.boxes[0].radius()) + f64::from(centre.iter().fold(0.0_f32, |far, c| far.max(c.abs())))
    }
}

/// Of each level three children wait while the fourth is looked at.
const STACK: usize = 3 * TREE_STACK.div_ceil(2) + WIDTH;
