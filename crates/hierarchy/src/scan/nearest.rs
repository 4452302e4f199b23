//! The nearest point: from a neighbour list, or by a descent with four boxes at a time, nearest
//! first.

use std::ops::ControlFlow;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16};
use nearmiss_geometry::NodeId;
use nearmiss_index::PointBlock;
use nearmiss_lanes::id32;
use nearmiss_lanes::wide::{bits, lanes_of, product, seen_from};
use nearmiss_surface::Centre;

use crate::bounds::boxes::OrientedBox;
use crate::descent::PlaceVisitor;
use crate::point::gather::GROWN;
use crate::scan::build::PointHierarchy;

/// Returns the number in single precision, rounded up.
#[expect(clippy::cast_possible_truncation, reason = "rounded up")]
fn single_above(x: f64) -> f32 {
    (x as f32).next_up()
}

/// The nearest point found so far.
struct Nearest {
    place: [f64; 3],
    /// The position in single precision.
    rounded: [f32; 3],
    /// The squared distance and the index of the nearest point.
    best: (f64, usize),
    /// The distance in single precision that no nearer point exceeds.
    within: f32,
    /// The square of `within`.
    most: f32,
    /// Bound on the rounding error of a distance in single precision.
    lost: f64,
}

impl Nearest {
    /// Starts without a point. No coordinate of the scan exceeds `far`.
    fn new(place: [f64; 3], far: f64) -> Self {
        let rounded = Centre::new(place).rounded();
        let far = rounded.iter().fold(far, |far, c| far.max(f64::from(c.abs())));
        let infinite = f32::INFINITY;
        Self { place, rounded, best: (f64::INFINITY, 0), within: infinite, most: infinite, lost: 4e-6 * far }
    }

    #[inline]
    fn offer(&mut self, i: usize, p: [f32; 3]) {
        let distance_sq = (0..3).map(|k| (f64::from(p[k]) - self.place[k]).powi(2)).sum::<f64>();
        if (distance_sq, i) < self.best {
            self.best = (distance_sq, i);
            self.within = single_above(distance_sq.sqrt() + self.lost);
            self.most = (self.within * self.within).next_up();
        }
    }

    /// Offers the points of a block in the lanes `points`, given as bits. Single precision selects
    /// the candidates, all lanes at once.
    #[inline(always)]
    fn offer_block<S: Simd>(&mut self, simd: S, blocks: &[PointBlock], block: usize, points: u32) {
        let of_block = &blocks[block];
        let d = seen_from(simd, &of_block.position, self.rounded);
        let near: mask32x16<S> = product(d, d).simd_le(self.most);
        let mut left = bits(near) & points;
        while left != 0 {
            let lane = left.trailing_zeros() as usize % PointBlock::WIDTH;
            left &= left - 1;
            let [x, y, z] = &of_block.position;
            self.offer(block * PointBlock::WIDTH + lane, [x[lane], y[lane], z[lane]]);
        }
    }

    /// Returns a lower bound of the squared distance whose value in single precision is `sq`.
    fn least(&self, sq: f32) -> f64 {
        (f64::from(sq.sqrt()) - self.lost).max(0.0).powi(2)
    }
}

/// The search for a nearest or nearly nearest point.
struct Search<'a> {
    scan: &'a PointHierarchy,
    nearest: Nearest,
    /// The leaf that has been visited already.
    own_leaf: usize,
    /// The squared distance beyond which the result may be a quarter further away than the nearest
    /// point.
    reach_sq: f64,
    /// The number of visited nodes.
    looked_at: u32,
}

impl PlaceVisitor for Search<'_> {
    #[inline(always)]
    fn most_sq(&self) -> f32 {
        self.nearest.most
    }

    #[inline(always)]
    fn is_wanted(&mut self, _: NodeId, least: f32) -> bool {
        /// The square of the factor by which the result may be further than the nearest point,
        /// beyond the reach.
        const ROUGHLY: f64 = 1.25 * 1.25;
        // A point within reach is never missed: a result beyond the reach lets all nodes be visited
        // that may be within it.
        let (reach_sq, best) = (self.reach_sq, self.nearest.best.0);
        let is_rough = |least: f64| least > reach_sq && ROUGHLY * least > best;
        if least > self.nearest.most || (reach_sq < f64::INFINITY && is_rough(self.nearest.least(least))) {
            return false;
        }
        self.looked_at += 1;
        true
    }

    #[inline(always)]
    fn leaf<S: Simd>(&mut self, simd: S, number: usize) -> ControlFlow<()> {
        if number != self.own_leaf {
            self.scan.offer_leaf(simd, number, &mut self.nearest);
        }
        ControlFlow::Continue(())
    }
}

impl PointHierarchy {
    /// Like [`Self::nearest_point_near`] if that point is within `reach`. Otherwise returns a point
    /// at most a quarter further away, which visits far fewer nodes. Also returns the number of
    /// visited nodes.
    ///
    /// # Panics
    /// If there is no such point.
    #[must_use]
    pub fn nearest_point_within(&self, i: usize, x: [f64; 3], reach: f64) -> (u32, u32) {
        dispatch!(Level::new(), simd => simd.vectorize(
            #[inline(always)]
            || self.nearest_by(simd, i, x, reach),
        ))
    }

    #[inline(always)]
    fn nearest_by<S: Simd>(&self, simd: S, i: usize, x: [f64; 3], reach: f64) -> (u32, u32) {
        let nearest = self.nearest_of_leaf(simd, i, x);
        let place = nearest.rounded;
        let own_leaf = i / self.meta.leaf_size as usize;
        let mut search = Search { scan: self, nearest, own_leaf, reach_sq: reach * reach, looked_at: 1 };
        // The visitor never breaks.
        let _whole = self.tree().descend_to_by(simd, place, &mut search);
        (id32(search.nearest.best.1), search.looked_at)
    }

    /// Returns the point nearest to `x`, from the neighbour list of the stored point `i`; `None` if
    /// the list may not contain it.
    ///
    /// # Panics
    /// If there is no such point.
    pub(crate) fn nearest_listed(&self, i: usize, x: [f64; 3]) -> Option<u32> {
        dispatch!(Level::new(), simd => simd.vectorize(
            #[inline(always)]
            || self.nearest_listed_by(simd, i, x),
        ))
    }

    /// A list that is complete at a position contains the group of every point there. `groups`
    /// holds the balls around blocks, which contain their points.
    #[inline(always)]
    fn nearest_listed_by<S: Simd>(&self, simd: S, i: usize, x: [f64; 3]) -> Option<u32> {
        let mut nearest = self.nearest_of_leaf(simd, i, x);
        let listed = self.index().list(i / PointBlock::WIDTH, nearest.rounded, nearest.within)?;
        let (blocks, groups): (&[PointBlock], &[PointBlock]) = (&self.arrays.blocks, &self.arrays.groups);
        let last = lanes_of(blocks.len().saturating_sub(1), &(0..self.len()));
        for &group in listed {
            let balls = groups.get(group as usize)?;
            let d = seen_from(simd, &balls.position, nearest.rounded);
            let reach = f32x16::load_array_ref(simd, &balls.support_radius) + nearest.within;
            let near: mask32x16<S> = product(d, d).simd_le(reach * reach * GROWN);
            let first = group as usize * PointBlock::WIDTH;
            let mut left = bits(near) & lanes_of(group as usize, &(0..blocks.len()));
            while left != 0 {
                let block = first + left.trailing_zeros() as usize;
                left &= left - 1;
                let points = if block + 1 < blocks.len() { u32::MAX } else { last };
                nearest.offer_block(simd, blocks, block, points);
            }
        }
        Some(id32(nearest.best.1))
    }

    /// Returns the point nearest to `x` in the leaf of the stored point `i`.
    #[inline(always)]
    fn nearest_of_leaf<S: Simd>(&self, simd: S, i: usize, x: [f64; 3]) -> Nearest {
        let mut nearest = Nearest::new(x, self.bounds_radius());
        nearest.offer(i, PointBlock::position_in(&self.arrays.blocks, i));
        self.offer_leaf(simd, i / self.meta.leaf_size as usize, &mut nearest);
        nearest
    }

    /// Offers the points of a leaf.
    #[inline(always)]
    fn offer_leaf<S: Simd>(&self, simd: S, leaf: usize, nearest: &mut Nearest) {
        let points = self.topology().points_of_leaf(leaf);
        let blocks: &[PointBlock] = &self.arrays.blocks;
        for block in points.start / PointBlock::WIDTH..=(points.end - 1) / PointBlock::WIDTH {
            nearest.offer_block(simd, blocks, block, lanes_of(block, &points));
        }
    }

    /// Returns an upper bound of the stored coordinates.
    pub(crate) fn bounds_radius(&self) -> f64 {
        let bounds = self.meta.root.bounds;
        let OrientedBox { centre, .. } = bounds;
        f64::from(bounds.radius()) + f64::from(centre.iter().fold(0.0_f32, |far, c| far.max(c.abs())))
    }
}
