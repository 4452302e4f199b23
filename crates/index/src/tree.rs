//! A tree of boxes over blocks of points: who is near the points of a block, all sixteen at once.
//!
//! Sixteen boxes stand side by side, level over level, until one group of them is left; the order of the
//! points is the tree. It serves an order in which near points are mostly near, as that of a hierarchy's
//! leaves; in any other it is as right and slow.
//!
//! Distances are what single precision makes of `(x−x')² + (y−y')² + (z−z')²`, each operation rounded, in
//! this order, underflow included. Rounding keeps order, so the distance of a box, computed alike from its
//! nearest corner, face or edge, exceeds no distance to a point in it, and what is found depends on nothing
//! but the points.

mod cells;
mod cones;
mod heard;
mod near;
mod nearest;
mod skeleton;
mod walk;

pub use cells::Cells;
pub use cones::Cones;
pub use heard::Heard;
pub use nearest::{Nearest, Neighbour};
pub use skeleton::Skeleton;

use std::convert::Infallible;

use bytemuck::{Pod, Zeroable};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16};
use nearmiss_lanes::parallel::fill;
use nearmiss_lanes::wide::{WIDTH, squared};
use nearmiss_store::{Room, WorkError, Workspace};

use crate::block::PointBlock;

/// 2³² points fill so many levels of groups.
const MOST_LEVELS: usize = 8;

/// Boxes side by side, with the greatest horizon in each.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C, align(64))]
struct Boxes {
    min: [[f32; WIDTH]; 3],
    max: [[f32; WIDTH]; 3],
    horizon: [f32; WIDTH],
}

impl Boxes {
    /// Boxes without a point, which contain any others' union with them no less.
    const EMPTY: Self = Self {
        min: [[f32::INFINITY; WIDTH]; 3],
        max: [[f32::NEG_INFINITY; WIDTH]; 3],
        horizon: [0.0; WIDTH],
    };

    /// The boxes of a group, of `count` in all.
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
        self.horizon[lane] = bounds.horizon;
    }

    #[inline(always)]
    fn get(&self, lane: usize) -> Bounds {
        Bounds {
            min: [self.min[0][lane], self.min[1][lane], self.min[2][lane]],
            max: [self.max[0][lane], self.max[1][lane], self.max[2][lane]],
            horizon: self.horizon[lane],
        }
    }

    /// Squared distances of all from one box; infinite where there is none.
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

/// One box.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    min: [f32; 3],
    max: [f32; 3],
    horizon: f32,
}

impl Bounds {
    /// That of the first `count` points of a block.
    fn of_block(block: &PointBlock, count: usize) -> Self {
        let of = |k: usize| &block.position[k][..count];
        Self::of(of, of, &block.horizon[..count])
    }

    /// That of all boxes of a group.
    fn of_group(group: &Boxes) -> Self {
        Self::of(|k| &group.min[k], |k| &group.max[k], &group.horizon)
    }

    fn of<'a>(min: impl Fn(usize) -> &'a [f32], max: impl Fn(usize) -> &'a [f32], horizons: &[f32]) -> Self {
        Self {
            min: [0, 1, 2].map(|k| min(k).iter().copied().fold(f32::INFINITY, f32::min)),
            max: [0, 1, 2].map(|k| max(k).iter().copied().fold(f32::NEG_INFINITY, f32::max)),
            horizon: horizons.iter().copied().fold(0.0, f32::max),
        }
    }

    /// Squared distances of points from this box.
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

/// The boxes of a tree over points in blocks, which they do not hold: a 16th of their memory and a little
/// more.
#[derive(Debug)]
pub struct BlockBoxes {
    /// How many points there are.
    points: usize,
    /// The box of block `i` stands in lane `i` % 16 of group `i` / 16 of the first level, that of such a
    /// group likewise in the next. The last has one group.
    levels: Vec<Room<Boxes>>,
}

impl BlockBoxes {
    /// The boxes over the first `points` points of `blocks`, with the horizons that they have there. O(n).
    ///
    /// # Panics
    /// When there are fewer, or a block more than hold them, or 2³² − 1 points.
    #[must_use]
    pub fn new(blocks: &[PointBlock], points: usize) -> Self {
        Self::with(blocks, points, |groups| Ok::<_, Infallible>(vec![Boxes::EMPTY; groups].into()))
            .unwrap_or_else(|never| match never {})
    }

    /// The same in a workspace.
    ///
    /// # Errors
    /// When that has no room.
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
        assert_eq!(blocks.len(), points.div_ceil(WIDTH), "{points} points fill other blocks");
        assert!(points < u32::MAX as usize, "{points} points have no ids");
        let mut level = room(blocks.len().div_ceil(WIDTH))?;
        fill(&mut level, |group| {
            let of = |block: usize| Bounds::of_block(&blocks[block], (points - block * WIDTH).min(WIDTH));
            Boxes::of(group, blocks.len(), of)
        });
        let mut levels = vec![level];
        while let Some(below) = levels.last().filter(|level| level.len() > 1) {
            let mut above = room(below.len().div_ceil(WIDTH))?;
            let below: &[Boxes] = below;
            fill(&mut above, |group| Boxes::of(group, below.len(), |i| Bounds::of_group(&below[i])));
            levels.push(above);
        }
        Ok(Self { points, levels })
    }

    /// The tree over `blocks`, of which these are the boxes.
    ///
    /// # Panics
    /// When they are more or fewer.
    #[inline]
    #[must_use]
    pub fn over<'a>(&'a self, blocks: &'a [PointBlock]) -> BlockTree<'a> {
        assert_eq!(blocks.len(), self.points.div_ceil(WIDTH), "{} points fill other blocks", self.points);
        BlockTree { blocks, points: self.points, levels: &self.levels }
    }

    /// How many points there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.points
    }

    /// Whether there are no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.points == 0
    }
}

/// A tree of boxes over points in blocks, from [`BlockBoxes::over`]. See [`Self::nearest`] and
/// [`Self::heard`].
#[derive(Debug, Clone, Copy)]
pub struct BlockTree<'a> {
    blocks: &'a [PointBlock],
    /// How many points there are.
    points: usize,
    levels: &'a [Room<Boxes>],
}

impl<'a> BlockTree<'a> {
    /// How many points there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.points
    }

    /// Whether there are no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.points == 0
    }

    /// The blocks.
    #[must_use]
    pub fn blocks(&self) -> &'a [PointBlock] {
        self.blocks
    }

    /// How many points a block has.
    #[inline(always)]
    fn count(&self, block: usize) -> usize {
        (self.points - block * WIDTH).min(WIDTH)
    }

    /// The box of node `id` of a level: of a block in level 0, of a group of the level below in others.
    #[inline(always)]
    fn bounds(&self, level: usize, id: usize) -> Bounds {
        self.levels[level][id / WIDTH].get(id % WIDTH)
    }

    /// How many nodes there are in a level.
    #[inline(always)]
    fn nodes(&self, level: usize) -> usize {
        if level == 0 { self.blocks.len() } else { self.levels[level - 1].len() }
    }
}
