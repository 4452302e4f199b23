//! The point nearest to a place: from a neighbour list, or four boxes at a time, the nearest of them first.

use std::ops::{ControlFlow, Range};

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

/// The number in single precision, or a little more.
#[expect(clippy::cast_possible_truncation, reason = "rounded up")]
fn single_above(x: f64) -> f32 {
    (x as f32).next_up()
}

/// The nearest point so far to a place.
struct Nearest {
    place: [f64; 3],
    /// The place in single precision.
    rounded: [f32; 3],
    /// Its squared distance, and its number.
    best: (f64, usize),
    /// What is nearer has no greater distance in single precision.
    within: f32,
    /// The square of that.
    most: f32,
    /// What single precision may lose of a distance.
    lost: f64,
}

impl Nearest {
    /// Of no point yet. No coordinate of the scan is greater than `far`.
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

    /// No less than this is the squared distance that came out as `sq` in single precision.
    fn least(&self, sq: f32) -> f64 {
        (f64::from(sq.sqrt()) - self.lost).max(0.0).powi(2)
    }
}

/// The search for a point that is nearest, or nearly so.
struct Search<'a> {
    scan: &'a PointHierarchy,
    nearest: Nearest,
    /// The leaf that was looked at before.
    own_leaf: usize,
    /// The square of the distance beyond which a point may be a quarter further away than the nearest.
    reach_sq: f64,
    /// How many nodes were looked at.
    looked_at: u32,
}

impl PlaceVisitor for Search<'_> {
    #[inline(always)]
    fn most_sq(&self) -> f32 {
        self.nearest.most
    }

    #[inline(always)]
    fn is_wanted(&mut self, _: NodeId, least: f32) -> bool {
        /// The square of how many times as far a point may be beyond reach.
        const ROUGHLY: f64 = 1.25 * 1.25;
        // A point within reach is never passed over: one that is further away lets all nodes be looked at
        // that come so near.
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
    /// As [`Self::nearest_point_near`] if that is within `reach`; else a point that is at most a quarter
    /// further away, which takes far fewer looks. With the number of nodes that were looked at.
    ///
    /// # Panics
    /// When there is no such point.
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
        // Nothing ends it.
        let _whole = self.tree().descend_to_by(simd, place, &mut search);
        (id32(search.nearest.best.1), search.looked_at)
    }

    /// The point nearest to `x`, from the neighbour list of the stored point `i`; `None` where that may lack
    /// it.
    ///
    /// # Panics
    /// When there is no such point.
    pub(crate) fn nearest_listed(&self, i: usize, x: [f64; 3]) -> Option<u32> {
        dispatch!(Level::new(), simd => simd.vectorize(
            #[inline(always)]
            || self.nearest_listed_by(simd, i, x),
        ))
    }

    /// A list that is complete at a place names the group of every point there, and `groups` hold the balls
    /// about blocks that contain their points.
    #[inline(always)]
    fn nearest_listed_by<S: Simd>(&self, simd: S, i: usize, x: [f64; 3]) -> Option<u32> {
        let mut nearest = self.nearest_of_leaf(simd, i, x);
        let listed = self.index().list(i / PointBlock::WIDTH, nearest.rounded, nearest.within)?;
        let points = 0..self.len();
        for &group in listed {
            let balls = self.arrays.groups.get(group as usize)?;
            let d = seen_from(simd, &balls.position, nearest.rounded);
            let reach = f32x16::load_array_ref(simd, &balls.horizon) + nearest.within;
            let near: mask32x16<S> = product(d, d).simd_le(reach * reach * GROWN);
            let first = group as usize * PointBlock::WIDTH;
            let mut left = bits(near) & lanes_of(group as usize, &(0..self.arrays.blocks.len()));
            while left != 0 {
                let block = first + left.trailing_zeros() as usize;
                left &= left - 1;
                self.offer_block(simd, block, &points, &mut nearest);
            }
        }
        Some(id32(nearest.best.1))
    }

    /// The nearest point to `x` in the leaf of the stored point `i`.
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
        for block in points.start / PointBlock::WIDTH..=(points.end - 1) / PointBlock::WIDTH {
            self.offer_block(simd, block, &points, nearest);
        }
    }

    /// Offers those of `points` that stand in a block. Which may be nearer is told in single precision, all
    /// at once.
    #[inline(always)]
    fn offer_block<S: Simd>(&self, simd: S, block: usize, points: &Range<usize>, nearest: &mut Nearest) {
        let d = seen_from(simd, &self.arrays.blocks[block].position, nearest.rounded);
        let near: mask32x16<S> = product(d, d).simd_le(nearest.most);
        let mut left = bits(near) & lanes_of(block, points);
        while left != 0 {
            let i = block * PointBlock::WIDTH + left.trailing_zeros() as usize;
            left &= left - 1;
            nearest.offer(i, PointBlock::position_in(&self.arrays.blocks, i));
        }
    }

    /// No stored coordinate is greater.
    fn bounds_radius(&self) -> f64 {
        let bounds = self.meta.root.bounds;
        let OrientedBox { centre, .. } = bounds;
        f64::from(bounds.radius()) + f64::from(centre.iter().fold(0.0_f32, |far, c| far.max(c.abs())))
    }
}
