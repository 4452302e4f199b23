//! Points near a shape: existence within a radius, and the nearest. Boxes are tested sixteen at a
//! time down to blocks, then points sixteen at a time.
//!
//! Single precision with slack decides the clear cases; the others are measured again in double
//! precision. The results are therefore those of [`Skeleton::distance_sq`] for every point, with
//! any instruction set.

use std::ops::ControlFlow;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16};
use nearmiss_lanes::wide::{Bits, WIDTH, bits, load};

use super::skeleton::{Block, Lanes, Place, Skeleton, Stretch, single};
use super::walk::{NearWalker, Stack, Walker};
use super::{BlockTree, Boxes};

/// Squares below this may have lost digits to underflow.
const LEAST_SURE: f32 = 1e-30;

/// Bound on the relative rounding error of a length in single precision.
const RELATIVE: f64 = 4e-6;

impl BlockTree<'_> {
    /// Returns `true` if a point is within `radius` of a skeleton, that is, if its
    /// [distance](Skeleton::distance_sq) in double precision is at most `radius`.
    ///
    /// Reads a few cache lines if nothing is near; does not allocate.
    #[inline]
    #[must_use]
    pub fn any_within(&self, level: Level, skeleton: &Skeleton, radius: f64) -> bool {
        match *skeleton {
            Skeleton::Point(centre) => self.any(level, Place(single(centre)), skeleton, radius),
            Skeleton::Segment(ends) => self.any(level, Stretch::new(ends), skeleton, radius),
            Skeleton::Box { centre, half, axes } => {
                self.any(level, Block::new(centre, half, axes), skeleton, radius)
            }
        }
    }

    #[inline(always)]
    fn any(&self, level: Level, lanes: impl Lanes, skeleton: &Skeleton, radius: f64) -> bool {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.any_by(simd, lanes, skeleton, radius)
        ))
    }

    /// Like [`Self::any_within`], for a ball around `centre` and the blocks `near` it from
    /// [`BlockGrid::near`](crate::BlockGrid::near). Tests these few blocks instead of descending from the
    /// root; with `None` it descends.
    ///
    /// # Panics
    /// If `near` contains an invalid block.
    #[inline]
    #[must_use]
    pub fn any_in_ball(&self, level: Level, near: Option<&[u32]>, centre: [f64; 3], radius: f64) -> bool {
        let skeleton = Skeleton::Point(centre);
        let Some(blocks) = near else {
            return self.any_within(level, &skeleton, radius);
        };
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || {
                let (limits, lanes) = (limits(&skeleton, radius), Place(single(centre)));
                for &block in blocks {
                    if self.is_within(simd, lanes, block as usize, limits, (&skeleton, radius)) {
                        return true;
                    }
                }
                false
            },
        ))
    }

    #[inline(always)]
    fn any_by<S: Simd>(&self, simd: S, lanes: impl Lanes, skeleton: &Skeleton, radius: f64) -> bool {
        let mut any = Any { tree: self, lanes, limits: limits(skeleton, radius), ball: (skeleton, radius) };
        self.groups().walk(simd, &mut any).is_break()
    }

    /// Returns `true` if a point of a block is within `radius`. Points are certainly within if
    /// their squared distance in single precision is at most `sure`, and certainly not if it
    /// exceeds `most`.
    #[inline(always)]
    fn is_within<S: Simd>(
        &self,
        simd: S,
        lanes: impl Lanes,
        block: usize,
        (sure, most): (f32, f32),
        (skeleton, radius): (&Skeleton, f64),
    ) -> bool {
        let distances = lanes.of_points(simd, load(simd, &self.blocks[block].position));
        let near: mask32x16<S> = distances.simd_le(most);
        let near = bits(near) & self.present(block);
        if near == 0 {
            return false;
        }
        let surely: mask32x16<S> = distances.simd_le(sure);
        bits(surely) & near != 0
            || Bits(near).any(|lane| skeleton.distance_sq(self.place(block, lane)) <= radius * radius)
    }

    /// Returns the point nearest to a skeleton and the square of its
    /// [distance](Skeleton::distance_sq) in double precision, or `None` if that exceeds `reach`. Of
    /// equally near points it returns the first. Does not allocate.
    #[inline]
    #[must_use]
    pub fn nearest_to(&self, level: Level, skeleton: &Skeleton, reach: f64) -> Option<(usize, f64)> {
        match *skeleton {
            Skeleton::Point(centre) => self.nearest_of(level, Place(single(centre)), skeleton, reach),
            Skeleton::Segment(ends) => self.nearest_of(level, Stretch::new(ends), skeleton, reach),
            Skeleton::Box { centre, half, axes } => {
                self.nearest_of(level, Block::new(centre, half, axes), skeleton, reach)
            }
        }
    }

    #[inline(always)]
    fn nearest_of(
        &self,
        level: Level,
        lanes: impl Lanes,
        skeleton: &Skeleton,
        reach: f64,
    ) -> Option<(usize, f64)> {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.nearest_to_by(simd, lanes, skeleton, reach)
        ))
    }

    #[inline(always)]
    fn nearest_to_by<S: Simd>(
        &self,
        simd: S,
        lanes: impl Lanes,
        skeleton: &Skeleton,
        reach: f64,
    ) -> Option<(usize, f64)> {
        let best = (reach * reach, usize::MAX);
        let mut search = NearestTo { tree: self, lanes, skeleton, best, most: 0.0 };
        search.most = search.limit();
        let groups = self.groups();
        // The walker never breaks.
        let _whole = groups.walk_near(simd, groups.root(), &mut Stack::new(), &mut search);
        let (distance_sq, point) = search.best;
        (point < usize::MAX).then_some((point, distance_sq))
    }

    /// Returns the lanes of a block that have points, as bits.
    #[inline(always)]
    pub(super) fn present(&self, block: usize) -> u32 {
        (1 << self.count(block)) - 1
    }

    #[inline(always)]
    fn place(&self, block: usize, lane: usize) -> [f64; 3] {
        let [x, y, z] = &self.blocks[block].position;
        [f64::from(x[lane]), f64::from(y[lane]), f64::from(z[lane])]
    }
}

/// The search for any point within a radius of a skeleton.
struct Any<'a, L> {
    tree: &'a BlockTree<'a>,
    lanes: L,
    limits: (f32, f32),
    ball: (&'a Skeleton, f64),
}

impl<S: Simd, L: Lanes> Walker<S> for Any<'_, L> {
    #[inline(always)]
    fn wanted(&mut self, simd: S, level: usize, group: usize) -> u32 {
        let boxes = &self.tree.levels[level][group];
        let near: mask32x16<S> = self.lanes.of_boxes(simd, boxes).simd_le(self.limits.1);
        bits(near)
    }

    #[inline(always)]
    fn block(&mut self, simd: S, id: usize) -> ControlFlow<()> {
        let is_within = self.tree.is_within(simd, self.lanes, id, self.limits, self.ball);
        if is_within { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// The search for the point nearest to a skeleton.
struct NearestTo<'a, L> {
    tree: &'a BlockTree<'a>,
    lanes: L,
    skeleton: &'a Skeleton,
    /// The squared distance of the nearest point so far, and its index.
    best: (f64, usize),
    /// Upper bound, in single precision, of the squared distance of any nearer point.
    most: f32,
}

impl<L> NearestTo<'_, L> {
    #[inline(always)]
    fn limit(&self) -> f32 {
        square(self.best.0.sqrt() * (1.0 + RELATIVE) + self.skeleton.slack())
    }
}

impl<S: Simd, L: Lanes> NearWalker<S> for NearestTo<'_, L> {
    #[inline(always)]
    fn distances_sq(&self, simd: S, _: (usize, usize), boxes: &Boxes) -> f32x16<S> {
        self.lanes.of_boxes(simd, boxes)
    }

    #[inline(always)]
    fn most_sq(&self) -> f32 {
        self.most
    }

    #[inline(always)]
    fn block(&mut self, simd: S, id: usize, _: f32) -> ControlFlow<()> {
        let tree = self.tree;
        let distances = self.lanes.of_points(simd, load(simd, &tree.blocks[id].position));
        let near: mask32x16<S> = distances.simd_le(self.most);
        for lane in Bits(bits(near) & tree.present(id)) {
            let own = (self.skeleton.distance_sq(tree.place(id, lane)), id * WIDTH + lane);
            if own < self.best {
                self.best = own;
                self.most = self.limit();
            }
        }
        ControlFlow::Continue(())
    }
}

/// Returns two squared distances in single precision. A point is certainly within `radius` up to
/// the first, and certainly not beyond the second.
#[inline(always)]
fn limits(skeleton: &Skeleton, radius: f64) -> (f32, f32) {
    let slack = skeleton.slack() + RELATIVE * radius;
    let (sure, most) = (square((radius - slack).max(0.0)), square(radius + slack));
    // Nothing is certain if squares leave the range of single precision.
    (if (LEAST_SURE..=f32::MAX).contains(&sure) { sure } else { -1.0 }, most)
}

#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "slack covers the rounding")]
fn square(length: f64) -> f32 {
    (length * length) as f32
}

#[cfg(test)]
mod tests {
    use nearmiss_testdata::arbitrary::{self, CloudKind, point_in, rotation, unit_vector};
    use nearmiss_testdata::instructions::levels;

    use super::*;
    use crate::block::PointBlock;
    use crate::tree::BlockBoxes;

    /// Finds the nearest point by brute force.
    fn nearest(points: &[[f32; 3]], skeleton: &Skeleton) -> (usize, f64) {
        let all = points.iter().map(|p| skeleton.distance_sq(p.map(f64::from))).enumerate();
        all.min_by(|p, q| p.1.total_cmp(&q.1)).unwrap()
    }

    #[test]
    fn every_level_tells_exactly_what_is_within() {
        let rng = &mut arbitrary::rng(93);
        let (mut within, mut without, mut by_cells) = (0, 0, 0);
        for (n, kind) in (0_u64..).zip(CloudKind::ALL.iter().cycle().take(42)) {
            let count = [1, 16, 17, 300, 5000][(n % 5) as usize];
            let mut points: Vec<[f32; 3]> =
                arbitrary::cloud(*kind, count, n).into_iter().map(single).collect();
            // Points that follow each other are mostly close.
            points.sort_unstable_by(|p, q| p[0].total_cmp(&q[0]));
            let size = points.iter().flatten().fold(0.0, |far: f64, c| far.max(f64::from(c.abs())));
            let blocks: Vec<PointBlock> = PointBlock::without_support(&points).collect();
            let boxes = BlockBoxes::new(&blocks, points.len());
            let tree = boxes.over(&blocks);
            let cells = tree.cells(Level::new());
            for round in 0..40_usize {
                let about = points[(7919 * round) % points.len()].map(f64::from);
                let d = point_in(rng, size * [1.5, 0.1, 1e-3, 1e-7][round % 4]);
                let centre = [0, 1, 2].map(|k| about[k] + d[k]);
                let along = unit_vector(rng).map(|x| 0.3 * size * x);
                let turn = rotation(rng);
                let axis = |k: usize| turn.rotation().column(k).into_owned().into();
                let skeleton = match round % 3 {
                    0 => Skeleton::Point(centre),
                    1 => Skeleton::Segment([centre, [0, 1, 2].map(|k| centre[k] + along[k])]),
                    _ => Skeleton::Box {
                        centre,
                        half: [0.05, 0.1, 0.0].map(|h| h * size),
                        axes: [axis(0), axis(1), axis(2)],
                    },
                };
                let expected = nearest(&points, &skeleton);
                let distance = expected.1.sqrt();
                for level in levels() {
                    assert_eq!(
                        tree.nearest_to(level, &skeleton, f64::INFINITY),
                        Some(expected),
                        "{skeleton:?}"
                    );
                    // The distance itself, and its neighbours in double precision.
                    for radius in [
                        0.0,
                        0.5 * distance,
                        distance.next_down(),
                        distance,
                        distance.next_up(),
                        3.0 * distance,
                    ] {
                        let radius = radius.max(0.0);
                        let is_within = expected.1 <= radius * radius;
                        let found = tree.any_within(level, &skeleton, radius);
                        assert_eq!(found, is_within, "{kind:?} {n}, {skeleton:?}, {radius} for {distance}");
                        if is_within {
                            within += 1
                        } else {
                            without += 1
                        }
                        if let Skeleton::Point(centre) = skeleton {
                            let near = cells.near(centre, radius);
                            let found = tree.any_in_ball(level, near, centre, radius);
                            assert_eq!(found, is_within, "{kind:?} {n}, {near:?}, {radius} for {distance}");
                            by_cells += usize::from(near.is_some_and(|blocks| !blocks.is_empty()));
                        }
                    }
                }
            }
        }
        assert!(within > 5000 && without > 5000, "{within} within, {without} not");
        assert!(by_cells > 2000, "{by_cells} by cells");
    }
}
