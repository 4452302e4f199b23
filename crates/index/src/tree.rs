//! A tree of boxes over blocks of points, for proximity queries of all sixteen points of a block at
//! once.
//!
//! Sixteen boxes form a group, and each level bounds the groups of the level below, up to a single
//! group. The order of the points determines the tree. Queries are fast if points that follow each
//! other are mostly close, as in the leaves of a hierarchy; any other order gives the same results
//! more slowly.
//!
//! Distances are `(x−x')² + (y−y')² + (z−z')²` in single precision, with each operation rounded, in
//! this order, underflow included. Rounding is monotonic, so the distance of a box, computed alike
//! from its nearest corner, face or edge, never exceeds the distance of a point in it. The results
//! therefore depend on the points alone.

mod around;
mod bodies;
mod cells;
mod cones;
mod cut;
mod near;
mod nearest;
mod overlaps;
mod rays;
mod skeleton;
mod starts;
mod walk;

pub use bodies::BoxBody;
pub use cells::BlockGrid;
pub use cones::Cones;
pub use cut::{BoxTree, CutBox, Slab};
pub use nearest::{Nearest, Neighbour};
pub use overlaps::Overlaps;
pub use rays::BoxRay;
pub use skeleton::Skeleton;
pub use starts::{BoxGrid, BoxStarts};
pub use walk::CutBoxVisitor;

use std::convert::Infallible;
use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16};
use nearmiss_lanes::parallel::change_each;
use nearmiss_lanes::wide::{WIDTH, greatest_of_each, lanes_of, least_of_each, squared};
use nearmiss_store::{Room, WorkError, Workspace};

use crate::block::PointBlock;

/// The number of levels of groups over 2³² points.
const MOST_LEVELS: usize = 8;

/// Sixteen boxes side by side, with the greatest support radius in each.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C, align(64))]
struct Boxes {
    min: [[f32; WIDTH]; 3],
    max: [[f32; WIDTH]; 3],
    support_radius: [f32; WIDTH],
}

impl Boxes {
    /// Empty boxes, neutral in unions.
    const EMPTY: Self = Self {
        min: [[f32::INFINITY; WIDTH]; 3],
        max: [[f32::NEG_INFINITY; WIDTH]; 3],
        support_radius: [0.0; WIDTH],
    };

    /// Returns the boxes of up to sixteen blocks, the last of which has `last` points.
    #[inline(always)]
    fn of_blocks<S: Simd>(simd: S, blocks: &[PointBlock], last: usize) -> Self {
        let [most, none, zero] = neutral(simd);
        let mut used = [mask32x16::from_bitmask(simd, 0); WIDTH];
        for (i, used) in used.iter_mut().enumerate().take(blocks.len()) {
            let count = if i + 1 < blocks.len() { WIDTH } else { last };
            *used = mask32x16::from_bitmask(simd, u64::from(lanes_of(0, &(0..count))));
        }
        let mut boxes = Self::EMPTY;
        for k in 0..3 {
            let (mut low, mut high) = ([most; WIDTH], [none; WIDTH]);
            for (i, block) in blocks.iter().enumerate().take(WIDTH) {
                let row = f32x16::load_array_ref(simd, &block.position[k]);
                low[i] = simd.select_f32x16(used[i], row, most);
                high[i] = simd.select_f32x16(used[i], row, none);
            }
            (boxes.min[k], boxes.max[k]) = (least_of_each(low), greatest_of_each(high));
        }
        let mut radii = [zero; WIDTH];
        for (i, block) in blocks.iter().enumerate().take(WIDTH) {
            radii[i] = simd.select_f32x16(used[i], f32x16::load_array_ref(simd, &block.support_radius), zero);
        }
        boxes.support_radius = greatest_of_each(radii);
        boxes
    }

    /// Returns the boxes around up to sixteen groups of boxes.
    #[inline(always)]
    fn of_groups<S: Simd>(simd: S, groups: &[Self]) -> Self {
        let [most, none, zero] = neutral(simd);
        let mut boxes = Self::EMPTY;
        for k in 0..3 {
            let (mut low, mut high) = ([most; WIDTH], [none; WIDTH]);
            for (i, group) in groups.iter().enumerate().take(WIDTH) {
                low[i] = f32x16::load_array_ref(simd, &group.min[k]);
                high[i] = f32x16::load_array_ref(simd, &group.max[k]);
            }
            (boxes.min[k], boxes.max[k]) = (least_of_each(low), greatest_of_each(high));
        }
        let mut radii = [zero; WIDTH];
        for (i, group) in groups.iter().enumerate().take(WIDTH) {
            radii[i] = f32x16::load_array_ref(simd, &group.support_radius);
        }
        boxes.support_radius = greatest_of_each(radii);
        boxes
    }

    #[inline(always)]
    fn get(&self, lane: usize) -> Bounds {
        Bounds {
            min: [self.min[0][lane], self.min[1][lane], self.min[2][lane]],
            max: [self.max[0][lane], self.max[1][lane], self.max[2][lane]],
            support_radius: self.support_radius[lane],
        }
    }

    /// Returns the squared distance of each box from `from`; infinite in unused lanes.
    #[inline(always)]
    fn distances_sq<S: Simd>(&self, simd: S, from: &Bounds) -> f32x16<S> {
        let mut apart = [f32x16::simd_from(simd, 0.0); 3];
        for k in 0..3 {
            let above = f32x16::load_array_ref(simd, &self.min[k]) - from.max[k];
            let below = f32x16::simd_from(simd, from.min[k]) - f32x16::load_array_ref(simd, &self.max[k]);
            apart[k] = above.max(below).max(apart[k]);
        }
        squared(apart)
    }
}

/// One box, with the greatest support radius in it.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    min: [f32; 3],
    max: [f32; 3],
    support_radius: f32,
}

impl Bounds {
    /// Returns the squared distances of points from this box.
    #[inline(always)]
    fn distances_sq<S: Simd>(&self, simd: S, points: &[f32x16<S>; 3]) -> f32x16<S> {
        let mut apart = [f32x16::simd_from(simd, 0.0); 3];
        for k in 0..3 {
            let above = f32x16::simd_from(simd, self.min[k]) - points[k];
            let below = points[k] - self.max[k];
            apart[k] = above.max(below).max(apart[k]);
        }
        squared(apart)
    }
}

/// Returns what is neutral in minima, in maxima, and in maxima of lengths.
#[inline(always)]
fn neutral<S: Simd>(simd: S) -> [f32x16<S>; 3] {
    [f32x16::splat(simd, f32::INFINITY), f32x16::splat(simd, f32::NEG_INFINITY), f32x16::splat(simd, 0.0)]
}

/// The boxes of a tree over blocks of points. They do not hold the points, and take slightly more
/// than a sixteenth of their memory.
#[derive(Debug)]
pub struct BlockBoxes {
    /// The number of points.
    points: usize,
    /// The box of block `i` is in lane `i` % 16 of group `i` / 16 of the first level. Each further
    /// level holds the boxes of the groups below in the same way. The last level has one group.
    levels: Vec<Room<Boxes>>,
}

impl Default for BlockBoxes {
    /// The boxes of no points.
    fn default() -> Self {
        Self::new(&[], 0)
    }
}

impl Clone for BlockBoxes {
    /// A copy in memory.
    fn clone(&self) -> Self {
        Self { points: self.points, levels: self.levels.iter().map(|level| level.to_vec().into()).collect() }
    }
}

impl BlockBoxes {
    /// Computes the boxes over the first `points` points of `blocks`, with the support radii of the
    /// points. O(n).
    ///
    /// # Panics
    /// If `points` points do not fill exactly these blocks (the last one possibly in part), or if
    /// there are 2³² − 1 points or more.
    #[must_use]
    pub fn new(blocks: &[PointBlock], points: usize) -> Self {
        Self::with(blocks, points, |groups| Ok::<_, Infallible>(vec![Boxes::EMPTY; groups].into()))
            .unwrap_or_else(|never| match never {})
    }

    /// Like [`Self::new`], in a workspace.
    ///
    /// # Errors
    /// If the workspace cannot provide the memory.
    ///
    /// # Panics
    /// As [`Self::new`].
    pub fn new_in(work: &Workspace, blocks: &[PointBlock], points: usize) -> Result<Self, WorkError> {
        Self::with(blocks, points, |groups| work.room(groups))
    }

    /// Computes the boxes anew from other `blocks`, as [`Self::new`] does, in the same memory if they are as
    /// many as before.
    ///
    /// # Panics
    /// As [`Self::new`].
    pub fn renew(&mut self, blocks: &[PointBlock], points: usize) {
        if points == self.points {
            self.fill(blocks);
        } else {
            *self = Self::new(blocks, points);
        }
    }

    fn with<E>(
        blocks: &[PointBlock],
        points: usize,
        room: impl Fn(usize) -> Result<Room<Boxes>, E>,
    ) -> Result<Self, E> {
        assert!(points < u32::MAX as usize, "expected fewer than 2^32 - 1 points, got {points}");
        let mut boxes = Self { points, levels: levels(blocks.len(), room)? };
        boxes.fill(blocks);
        Ok(boxes)
    }

    /// Computes all boxes from `blocks`.
    fn fill(&mut self, blocks: &[PointBlock]) {
        let points = self.points;
        assert_eq!(blocks.len(), points.div_ceil(WIDTH), "expected the blocks of {points} points");
        let (level, last) = (Level::new(), points - blocks.len().saturating_sub(1) * WIDTH);
        let (first, above) = self.levels.split_at_mut(1);
        change_each(&mut first[0], WIDTH, |group, boxes| {
            let part = part(group, blocks.len());
            let last = if part.end == blocks.len() { last } else { WIDTH };
            let blocks = &blocks[part];
            *boxes = dispatch!(level, simd => simd.vectorize(
                #[inline(always)]
                || Boxes::of_blocks(simd, blocks, last),
            ));
        });
        fill_above(level, &first[0], above);
    }

    /// Returns the tree over `blocks`, which must be the blocks that the boxes were computed from.
    ///
    /// # Panics
    /// If the number of blocks differs.
    #[inline]
    #[must_use]
    pub fn over<'a>(&'a self, blocks: &'a [PointBlock]) -> BlockTree<'a> {
        assert_eq!(
            blocks.len(),
            self.points.div_ceil(WIDTH),
            "expected the blocks of {} points",
            self.points
        );
        BlockTree { blocks, points: self.points, levels: &self.levels }
    }

    /// Returns the number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.points
    }

    /// Returns `true` if there are no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.points == 0
    }
}

/// Returns the boxes below a group.
fn part(group: usize, count: usize) -> Range<usize> {
    group * WIDTH..count.min(group * WIDTH + WIDTH)
}

/// Returns memory for the groups of all levels over `count` boxes. There is at least one level.
fn levels<E>(count: usize, room: impl Fn(usize) -> Result<Room<Boxes>, E>) -> Result<Vec<Room<Boxes>>, E> {
    let mut levels = vec![room(count.div_ceil(WIDTH))?];
    while let Some(below) = levels.last().filter(|level| level.len() > 1) {
        levels.push(room(below.len().div_ceil(WIDTH))?);
    }
    Ok(levels)
}

/// Computes the boxes of the levels `above` the first one.
fn fill_above(level: Level, first: &Room<Boxes>, above: &mut [Room<Boxes>]) {
    let mut below = first;
    for above in above {
        let groups: &[Boxes] = below;
        change_each(above, WIDTH, |group, boxes| {
            let groups = &groups[part(group, groups.len())];
            *boxes = dispatch!(level, simd => simd.vectorize(
                #[inline(always)]
                || Boxes::of_groups(simd, groups),
            ));
        });
        below = above;
    }
}

/// A tree of boxes over blocks of points, from [`BlockBoxes::over`]. See [`Self::nearest`] and
/// [`Self::overlapping`].
#[derive(Debug, Clone, Copy)]
pub struct BlockTree<'a> {
    blocks: &'a [PointBlock],
    /// The number of points.
    points: usize,
    levels: &'a [Room<Boxes>],
}

impl<'a> BlockTree<'a> {
    /// Returns the number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.points
    }

    /// Returns `true` if there are no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.points == 0
    }

    /// Returns the blocks.
    #[must_use]
    pub fn blocks(&self) -> &'a [PointBlock] {
        self.blocks
    }

    /// Returns the number of points in a block.
    #[inline(always)]
    fn count(&self, block: usize) -> usize {
        (self.points - block * WIDTH).min(WIDTH)
    }

    /// Returns the box of node `id` of a level: of a block in level 0, of a group of the level
    /// below in other levels.
    #[inline(always)]
    fn bounds(&self, level: usize, id: usize) -> Bounds {
        self.levels[level][id / WIDTH].get(id % WIDTH)
    }
}

#[cfg(test)]
mod tests {
    use nearmiss_testdata::arbitrary::{point_in, rng};

    use super::*;

    /// The boxes of all levels hold what is below them, whatever they held before.
    #[test]
    fn boxes_are_those_of_loops() {
        let rng = &mut rng(1907);
        let mut renewed = BlockBoxes::default();
        for count in [0, 1, 15, 16, 17, 255, 256, 257, 5000, 5000, 4101, 4101] {
            #[expect(clippy::cast_possible_truncation, reason = "stored in single precision")]
            let points: Vec<[f32; 3]> = (0..count).map(|_| point_in(rng, 3.0).map(|x| x as f32)).collect();
            let mut blocks: Vec<PointBlock> = PointBlock::without_support(&points).collect();
            for (i, block) in blocks.iter_mut().enumerate() {
                block.support_radius[i % WIDTH] = 0.25 + 0.5 * block.position[0][i % WIDTH].abs();
            }
            renewed.renew(&blocks, count);
            for boxes in [&renewed, &renewed.clone(), &BlockBoxes::new(&blocks, count)] {
                let tree = boxes.over(&blocks);
                let (mut width, mut level) = (WIDTH, 0);
                while level < tree.levels.len() {
                    for id in 0..tree.groups().nodes(level) {
                        let range = id * width..count.min((id + 1) * width);
                        let bounds = tree.bounds(level, id);
                        for k in 0..3 {
                            let along = || points[range.clone()].iter().map(|p| p[k]);
                            assert_eq!(bounds.min[k], along().fold(f32::INFINITY, f32::min));
                            assert_eq!(bounds.max[k], along().fold(f32::NEG_INFINITY, f32::max));
                        }
                        let radii = range.map(|i| blocks[i / WIDTH].support_radius[i % WIDTH]);
                        assert_eq!(bounds.support_radius, radii.fold(0.0, f32::max));
                    }
                    (width, level) = (width * WIDTH, level + 1);
                }
            }
        }
    }
}
