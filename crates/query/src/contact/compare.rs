//! Comparison of the points of two leaves: sixteen at a time, then the crossing pairs one by one.

use std::ops::ControlFlow;

use nearmiss_hierarchy::{LeafBlock, Leaves, Part};

use crate::ask::answer::Reason;
use crate::contact::search::Surfaces;
use crate::leaf::surfel_pair::{Discs, LeafPair, Near};

impl Surfaces<'_> {
    /// Compares the points of two leaves, given by their leaf numbers.
    pub(crate) fn compare_leaves(&mut self, [leaf_a, leaf_b]: [usize; 2], by_discs: bool) -> ControlFlow<()> {
        let (a, b) = (self.pair.a, self.pair.b);
        let (of_a, of_b) = (a.leaves, b.leaves);
        if self.pair.part == Part::Obstacle && (of_a.has_balls(leaf_a) || of_b.has_balls(leaf_b)) {
            let tries = self.tries;
            self.compare_balls([leaf_a, leaf_b])?;
            let are_dense = of_a.points(leaf_a).start < a.dense && of_b.points(leaf_b).start < b.dense;
            if self.tries > tries || !are_dense {
                return ControlFlow::Continue(());
            }
        }
        let is_sparse = |leaves: Leaves<'_>, leaf| self.pair.part == Part::Surface && leaves.is_sparse(leaf);
        let sparse = [is_sparse(of_a, leaf_a), is_sparse(of_b, leaf_b)];
        if !by_discs && sparse == [false; 2] {
            return ControlFlow::Continue(());
        }
        for (block_a, first_a, count_a) in of_a.blocks(leaf_a) {
            for (block_b, first_b, count_b) in of_b.blocks(leaf_b) {
                let test = LeafPair {
                    a: Discs { block: block_a, count: count_a },
                    b: Discs { block: block_b, count: count_b },
                    balls: sparse[0].then(|| self.balls(first_a, count_a)),
                    reach: self.reach,
                    relative: &self.pair.relative.clone(),
                };
                let tries = self.tries;
                self.compare_blocks(&test, [first_a, first_b], sparse, by_discs)?;
                if self.tries > tries {
                    // Other crossings of the same leaves would fail to verify, too.
                    return ControlFlow::Continue(());
                }
            }
        }
        ControlFlow::Continue(())
    }

    /// The radii of the balls about `count` points of a.
    fn balls(&self, first: usize, count: usize) -> [f32; LeafBlock::WIDTH] {
        let mut balls = [0.0; LeafBlock::WIDTH];
        for (i, ball) in (first..first + count).zip(&mut balls) {
            *ball = self.pair.a.ball(i);
        }
        balls
    }

    /// Compares the points of one block of a's leaf with those of one block of b's.
    #[inline]
    fn compare_blocks(
        &mut self,
        test: &LeafPair<'_>,
        [first_a, first_b]: [usize; 2],
        [sparse_a, sparse_b]: [bool; 2],
        by_discs: bool,
    ) -> ControlFlow<()> {
        let of_b = first_b..first_b + test.b.count;
        // If only crossings count, points without any are skipped.
        let each = sparse_a || sparse_b || self.margin > 0.0;
        let mut lanes = u32::MAX;
        while let Some(Near { lane, crossings }) = test.next(self.pair.level, lanes, each) {
            lanes = u32::MAX << 1 << lane;
            let i = first_a + lane;
            let ball = if sparse_a { self.pair.a.ball(i) } else { 0.0 };
            let is_open = self.doubt == Some(Reason::Undersampled);
            if (ball > 0.0 || sparse_b)
                && !is_open
                && self.comes_near_sparse(&self.pair.disc_a(i), ball, of_b.clone())
            {
                self.doubt = Some(Reason::Undersampled);
            }
            if by_discs {
                let tries = self.tries;
                self.discs_cross(i, crossings, first_b)?;
                if self.tries > tries {
                    return ControlFlow::Continue(());
                }
                if self.margin > 0.0 {
                    self.near_discs(i, of_b.clone())?;
                    if self.tries > tries {
                        return ControlFlow::Continue(());
                    }
                }
            }
        }
        ControlFlow::Continue(())
    }

    /// Handles crossings of the disc of point `i` with the discs of b that have a bit in
    /// `crossings`, where bit 0 stands for point `first`.
    #[inline]
    fn discs_cross(&mut self, i: usize, mut crossings: u32, first: usize) -> ControlFlow<()> {
        while crossings != 0 {
            let j = first + crossings.trailing_zeros() as usize;
            crossings &= crossings - 1;
            if !self.pair.are_near(i, j) || self.pair.is_of_balls([i, j]) {
                continue;
            }
            match self.pair.doubt_about(i, j) {
                Some(reason) => _ = self.doubt.get_or_insert(reason),
                None => return self.crossed(i, j),
            }
        }
        ControlFlow::Continue(())
    }
}
