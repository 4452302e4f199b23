//! Two scans as a [`Pairing`].

use fearless_simd::Level;
use nearmiss_geometry::Pose;
use nearmiss_hierarchy::{NodePair, Part, Relative, Tree};

use crate::leaf::nearest_points::nearest;
use crate::pair::meter::Meter;
use crate::pair::pairing::{ItemPair, Pairing};
use crate::pair::placed::Placed;
use crate::pair::scan_pair::{ScanPair, balls_apart};

impl Pairing for ScanPair<'_> {
    #[inline(always)]
    fn meter(&mut self) -> &mut Meter {
        &mut self.meter
    }

    #[inline(always)]
    fn level(&self) -> Level {
        self.level
    }

    #[inline(always)]
    fn part(&self) -> Part {
        self.part
    }

    #[inline(always)]
    fn relative(&self) -> &Relative {
        &self.relative
    }

    fn placed(&self) -> [&Pose; 2] {
        self.views.map(Placed::stored_to_world)
    }

    #[inline(always)]
    fn both<'t>(&self) -> [&'t Tree<'t>; 2]
    where
        Self: 't,
    {
        [&self.a.tree, &self.b.tree]
    }

    fn band_of(&self, nodes: NodePair) -> f64 {
        Self::band_of(self, nodes)
    }

    fn balls_apart(&self) -> f64 {
        balls_apart(self.views, self.part)
    }

    fn gap_of_enclosures(&self, pair: NodePair) -> f32 {
        Self::gap_of_enclosures(self, pair)
    }

    #[inline(always)]
    fn better_gap(&self, pair: NodePair, gap: f32) -> f32 {
        Self::better_gap(self, pair, gap)
    }

    #[inline(always)]
    fn gap_by_points(&self, pair: NodePair) -> Option<f32> {
        Self::gap_by_points(self, pair)
    }

    fn gap_of_leaf_boxes(&self, pair: NodePair) -> f32 {
        Self::gap_of_leaf_boxes(self, pair)
    }

    fn gap_of_leaves(&self, pair: NodePair, most: f32) -> f32 {
        Self::gap_of_leaves(self, pair, most)
    }

    fn items(&self, items: [usize; 2]) -> ItemPair {
        self.point_pair(items)
    }

    #[inline(always)]
    fn nearest(&mut self, leaves: NodePair, best: ItemPair) -> ItemPair {
        nearest(self.level, self, leaves, best)
    }

    #[inline(always)]
    fn count_leaves(&mut self, [a, b]: [usize; 2]) {
        let (a, b) = (self.a.leaves.points(a).len(), self.b.leaves.points(b).len());
        self.meter.leaf_pair(a, b);
    }
}
