//! The two traversals of a tree: in the order of the leaves, and nearest first.

use std::ops::ControlFlow;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, mask32x16};
use nearmiss_lanes::id32;
use nearmiss_lanes::wide::{Bits, WIDTH, bits};

use nearmiss_store::Room;

use super::{BlockTree, Boxes, MOST_LEVELS};

/// The callbacks of a traversal in the order of the points.
pub(super) trait Walker<S: Simd> {
    /// Returns the boxes of a group to descend into, as bits. Unused lanes are ignored.
    fn wanted(&mut self, simd: S, level: usize, group: usize) -> u32;

    /// Visits a block. May end the traversal.
    fn block(&mut self, simd: S, id: usize) -> ControlFlow<()>;
}

/// The callbacks of a traversal that takes the nearest boxes first.
pub(super) trait NearWalker<S: Simd> {
    /// Returns the squared distances of the boxes of a group, by its level and number.
    fn distances_sq(&self, simd: S, group: (usize, usize), boxes: &Boxes) -> f32x16<S>;

    /// Returns the squared distance beyond which boxes are skipped.
    fn most_sq(&self) -> f32;

    /// Returns `true` if node `id` of a level is to be visited. Called immediately before the
    /// visit.
    fn is_wanted(&mut self, simd: S, level: usize, id: usize) -> bool {
        let _ = (simd, level, id);
        true
    }

    /// Told of a block that is visited later, unless the search ends before.
    #[inline(always)]
    fn foresee(&self, id: usize) {
        let _ = id;
    }

    /// Visits a block, which is at least at this squared distance. May end the traversal.
    fn block(&mut self, simd: S, id: usize, least_sq: f32) -> ControlFlow<()>;
}

/// The callbacks of a search among the boxes of a [`BoxTree`](super::BoxTree).
pub trait CutBoxVisitor {
    /// Returns the squared distance beyond which boxes are skipped.
    fn most_sq(&self) -> f32;

    /// Told of a box that is visited later, unless the search ends before: the time to load what it is about.
    fn foresee(&self, number: usize);

    /// Visits a box, by its number, which is at least at this squared distance. May end the search.
    fn visit<S: Simd>(&mut self, simd: S, number: usize, least_sq: f32) -> ControlFlow<()>;
}

/// A node to be visited.
#[derive(Debug, Clone, Copy)]
struct Open {
    distance_sq: f32,
    level: u32,
    id: u32,
}

/// The nodes still to be visited by a traversal that takes the nearest first.
#[derive(Debug)]
pub(super) struct Stack([Open; MOST_LEVELS * WIDTH]);

impl Stack {
    #[inline(always)]
    pub(super) const fn new() -> Self {
        Self([Open { distance_sq: 0.0, level: 0, id: 0 }; MOST_LEVELS * WIDTH])
    }

    /// Puts groups of the first level on the stack, each with a lower bound on its squared distance.
    #[inline(always)]
    pub(super) fn put(&mut self, groups: impl Iterator<Item = (f32, u32)>) -> usize {
        let mut top = 0;
        for ((distance_sq, id), open) in groups.zip(&mut self.0) {
            *open = Open { distance_sq, level: 1, id };
            top += 1;
        }
        top
    }
}

/// The groups of boxes of a tree.
#[derive(Debug, Clone, Copy)]
pub(super) struct Groups<'a> {
    /// The number of boxes of the first level.
    pub(super) count: usize,
    /// Each level holds the boxes of the groups below. The last one has one group.
    pub(super) levels: &'a [Room<Boxes>],
}

impl<'a> BlockTree<'a> {
    /// Returns the groups of boxes.
    #[inline(always)]
    pub(super) fn groups(&self) -> Groups<'a> {
        Groups { count: self.blocks.len(), levels: self.levels }
    }
}

impl Groups<'_> {
    /// Visits the wanted blocks in order, until the walker ends the traversal.
    #[inline(always)]
    pub(super) fn walk<S: Simd>(&self, simd: S, walker: &mut impl Walker<S>) -> ControlFlow<()> {
        // A group of each level, and its boxes still to be visited.
        let mut open = [(0_usize, 0_u32); MOST_LEVELS];
        let top = self.levels.len();
        let (mut level, mut id) = (top, 0);
        loop {
            if level > 0 {
                level -= 1;
                open[level] = (id, walker.wanted(simd, level, id) & self.filled(level, id));
            } else {
                walker.block(simd, id)?;
            }
            while open[level].1 == 0 {
                level += 1;
                if level == top {
                    return ControlFlow::Continue(());
                }
            }
            let (group, near) = &mut open[level];
            id = *group * WIDTH + near.trailing_zeros() as usize;
            *near &= *near - 1;
        }
    }

    /// The group of the highest level, and all of its lanes.
    #[inline(always)]
    pub(super) fn root(&self) -> (usize, usize, u32) {
        (self.levels.len() - 1, 0, u32::MAX)
    }

    /// Visits the blocks below the given lanes of a group of a level, siblings nearest first.
    #[inline(always)]
    pub(super) fn walk_near<S: Simd>(
        &self,
        simd: S,
        group: (usize, usize, u32),
        stack: &mut Stack,
        walker: &mut impl NearWalker<S>,
    ) -> ControlFlow<()> {
        self.walk_on(simd, Some(group), (stack, 0), walker)
    }

    /// Does the same below a group and below the first `top` nodes of the stack, of which the last comes
    /// first.
    #[inline(always)]
    pub(super) fn walk_on<S: Simd>(
        &self,
        simd: S,
        mut next: Option<(usize, usize, u32)>,
        (Stack(stack), mut top): (&mut Stack, usize),
        walker: &mut impl NearWalker<S>,
    ) -> ControlFlow<()> {
        loop {
            if let Some((level, group, lanes)) = next.take() {
                let distances = walker.distances_sq(simd, (level, group), &self.levels[level][group]);
                let near: mask32x16<S> = distances.simd_le(walker.most_sq());
                let distances = distances.to_array();
                let first = top;
                for lane in Bits(bits(near) & lanes & self.filled(level, group)) {
                    let distance_sq = distances[lane];
                    if level == 0 {
                        walker.foresee(group * WIDTH + lane);
                    }
                    // Insertion sort, nearest on top: there are at most sixteen.
                    let mut place = top;
                    while place > first && stack[place - 1].distance_sq < distance_sq {
                        stack[place] = stack[place - 1];
                        place -= 1;
                    }
                    stack[place] = Open { distance_sq, level: id32(level), id: id32(group * WIDTH + lane) };
                    top += 1;
                }
            }
            if top == 0 {
                return ControlFlow::Continue(());
            }
            top -= 1;
            let Open { distance_sq, level, id } = stack[top];
            let (level, id) = (level as usize, id as usize);
            if distance_sq > walker.most_sq() || !walker.is_wanted(simd, level, id) {
                continue;
            }
            if level == 0 {
                walker.block(simd, id, distance_sq)?;
            } else {
                next = Some((level - 1, id, u32::MAX));
            }
        }
    }

    /// Returns the lanes of a group that have boxes, as bits.
    #[inline(always)]
    fn filled(&self, level: usize, group: usize) -> u32 {
        (1 << (self.nodes(level) - group * WIDTH).min(WIDTH)) - 1
    }

    /// Returns the number of boxes of a level.
    #[inline(always)]
    pub(super) fn nodes(&self, level: usize) -> usize {
        if level == 0 { self.count } else { self.levels[level - 1].len() }
    }
}
