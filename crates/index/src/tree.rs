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

mod cells;
mod cones;
mod near;
mod nearest;
mod overlaps;
mod skeleton;
mod walk;

pub use cells::BlockGrid;
pub use cones::Cones;
pub use nearest::{Nearest, Neighbour};
pub use overlaps::Overlaps;
pub use skeleton::Skeleton;

use std::convert::Infallible;

use bytemuck::{Pod, Zeroable};
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16};
use nearmiss_lanes::parallel::change_each;
use nearmiss_lanes::wide::{WIDTH, greatest, lanes_of, least, squared};
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

    /// Returns the boxes of a group. `count` is the number of boxes of the level.
    #[inline(always)]
    fn of(group: usize, count: usize, bounds: impl Fn(usize) -> Bounds) -> Self {
        let mut boxes = Self::EMPTY;
        for (lane, i) in (group * WIDTH..count.min(group * WIDTH + WIDTH)).enumerate() {
            boxes.set(lane, &bounds(i));
        }
        boxes
    }

    fn set(&mut self, lane: usize, bounds: &Bounds) {
        for k in 0..3 {
            self.min[k][lane] = bounds.min[k];
            self.max[k][lane] = bounds.max[k];
        }
        self.support_radius[lane] = bounds.support_radius;
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
    /// Returns the box of the first `count` points of a block; of all if there are fewer.
    #[inline(always)]
    fn of_block<S: Simd>(simd: S, block: &PointBlock, count: usize) -> Self {
        let used = lanes_of(0, &(0..count));
        Self::of(simd, used, (&block.position, &block.position), &block.support_radius)
    }

    /// Returns the box of all boxes of a group.
    #[inline(always)]
    fn of_group<S: Simd>(simd: S, group: &Boxes) -> Self {
        Self::of(simd, lanes_of(0, &(0..WIDTH)), (&group.min, &group.max), &group.support_radius)
    }

    /// Returns the box of the boxes in the lanes `used`.
    #[inline(always)]
    fn of<S: Simd>(
        simd: S,
        used: u32,
        (min, max): (&[[f32; WIDTH]; 3], &[[f32; WIDTH]; 3]),
        support_radii: &[f32; WIDTH],
    ) -> Self {
        let used = mask32x16::from_bitmask(simd, u64::from(used));
        let (most, none) = (f32x16::splat(simd, f32::INFINITY), f32x16::splat(simd, f32::NEG_INFINITY));
        let mut bounds = Self { min: [0.0; 3], max: [0.0; 3], support_radius: 0.0 };
        for k in 0..3 {
            let (min, max) = (f32x16::load_array_ref(simd, &min[k]), f32x16::load_array_ref(simd, &max[k]));
            bounds.min[k] = least(simd.select_f32x16(used, min, most), f32::INFINITY);
            bounds.max[k] = greatest(simd.select_f32x16(used, max, none), f32::NEG_INFINITY);
        }
        let radii = f32x16::load_array_ref(simd, support_radii);
        bounds.support_radius = greatest(simd.select_f32x16(used, radii, f32x16::splat(simd, 0.0)), 0.0);
        bounds
    }

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

    fn with<E>(
        blocks: &[PointBlock],
        points: usize,
        room: impl Fn(usize) -> Result<Room<Boxes>, E>,
    ) -> Result<Self, E> {
        assert_eq!(blocks.len(), points.div_ceil(WIDTH), "expected the blocks of {points} points");
        assert!(points < u32::MAX as usize, "expected fewer than 2^32 - 1 points, got {points}");
        let level = Level::new();
        let mut first = room(blocks.len().div_ceil(WIDTH))?;
        change_each(&mut first, WIDTH, |group, boxes| {
            *boxes = dispatch!(level, simd => simd.vectorize(
                #[inline(always)]
                || Boxes::of(group, blocks.len(), |i| Bounds::of_block(simd, &blocks[i], points - i * WIDTH)),
            ));
        });
        let mut levels = vec![first];
        while let Some(below) = levels.last().filter(|level| level.len() > 1) {
            let mut above = room(below.len().div_ceil(WIDTH))?;
            let below: &[Boxes] = below;
            change_each(&mut above, WIDTH, |group, boxes| {
                *boxes = dispatch!(level, simd => simd.vectorize(
                    #[inline(always)]
                    || Boxes::of(group, below.len(), |i| Bounds::of_group(simd, &below[i])),
                ));
            });
            levels.push(above);
        }
        Ok(Self { points, levels })
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

    /// Returns the number of nodes of a level.
    #[inline(always)]
    fn nodes(&self, level: usize) -> usize {
        if level == 0 { self.blocks.len() } else { self.levels[level - 1].len() }
    }
}
