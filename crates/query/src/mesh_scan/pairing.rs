//! A scan and a mesh as a [`Pairing`].

use fearless_simd::Level;
use nearmiss_geometry::Pose;
use nearmiss_hierarchy::{NodePair, Part, Relative, Tree};

use crate::leaf::point_gap::gap_of_leaf_and_box;
use crate::mesh_scan::mesh_scan_pair::MeshScanPairing;
use crate::pair::meter::Meter;
use crate::pair::pairing::{ItemPair, Pairing};

impl Pairing for MeshScanPairing<'_> {
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
        [self.scan.stored_to_world(), self.mesh.stored_to_world()]
    }

    #[inline(always)]
    fn both<'t>(&self) -> [&'t Tree<'t>; 2]
    where
        Self: 't,
    {
        [&self.a.tree, &self.b.tree]
    }

    fn band_of(&self, nodes: NodePair) -> f64 {
        self.band_of_node(nodes)
    }

    fn balls_apart(&self) -> f64 {
        self.gap
    }

    fn gap_of_enclosures(&self, pair: NodePair) -> f32 {
        let (a, b) = (self.a.tree.enclosure(self.part, pair.a), self.b.tree.bounds(pair.b));
        self.relative.gap(&a, &b)
    }

    #[inline]
    fn better_gap(&self, pair: NodePair, gap: f32) -> f32 {
        if self.part == Part::Surface && self.which_are_leaves(pair) == [true; 2] {
            return self.gap_of_two_leaves(pair).max(gap);
        }
        match self.part {
            Part::Obstacle => self.gap_by_points(pair).map_or(gap, |by_points| by_points.max(gap)),
            Part::Surface => gap,
        }
    }

    #[inline]
    fn gap_by_points(&self, pair: NodePair) -> Option<f32> {
        match self.which_are_leaves(pair) {
            [true, true] => Some(self.gap_of_two_leaves(pair)),
            [true, false] => Some(self.gap_of_leaf_boxes(pair)),
            _ => None,
        }
    }

    fn gap_of_leaf_boxes(&self, pair: NodePair) -> f32 {
        let bounds = self.relative.moved(&self.b.tree.bounds(pair.b));
        gap_of_leaf_and_box(self.level, self.a, pair.a, &bounds)
    }

    fn gap_of_leaves(&self, pair: NodePair, _: f32) -> f32 {
        self.gap_of_two_leaves(pair)
    }

    fn items(&self, items: [usize; 2]) -> ItemPair {
        self.item_pair(items)
    }

    fn nearest(&mut self, leaves: NodePair, best: ItemPair) -> ItemPair {
        self.nearest_items(leaves, best)
    }

    #[inline]
    fn count_leaves(&mut self, leaves: [usize; 2]) {
        self.count(leaves);
    }
}
