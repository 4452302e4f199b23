//! A scan and a mesh as a [`Pairing`].

use fearless_simd::Level;
use nearmiss_geometry::{NodeId, Pose};
use nearmiss_hierarchy::{NodePair, Part, ScanArrays};

use crate::leaf::point_gap::gap_of_leaf_and_box;
use crate::mesh_scan::mesh_scan_pair::MeshScanPairing;
use crate::pair::bounds::Bounds;
use crate::pair::meter::Meter;
use crate::pair::pairing::{ItemPair, Pairing};
use crate::pair::relative_pose::RelativePose;

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
    fn slack(&self) -> f32 {
        self.relative.slack()
    }

    fn to_world(&self) -> f64 {
        self.scan.stored_to_world().scale()
    }

    fn relative_pose(&self, pose: &Pose) -> RelativePose {
        let roots = [self.a.tree.root_box(), self.b.tree.root_box()];
        RelativePose::new(roots, [self.scan.stored_to_world(), self.mesh.stored_to_world()], pose)
    }

    #[inline(always)]
    fn bounds<'t>(&self, relative_pose: &'t RelativePose) -> Bounds<'t>
    where
        Self: 't,
    {
        Bounds { trees: [&self.a.tree, &self.b.tree], relative_pose, part: self.part }
    }

    #[inline(always)]
    fn which_are_leaves(&self, pair: NodePair) -> [bool; 2] {
        [self.a.tree.topology().is_leaf(pair.a), self.b.tree.topology().is_leaf(pair.b)]
    }

    fn are_leaves(&self, pair: NodePair) -> bool {
        let [a, b] = [self.a.tree.topology(), self.b.tree.topology()];
        a.has(pair.a) && b.has(pair.b) && self.which_are_leaves(pair) == [true; 2]
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
        let is_loose = |scan: &ScanArrays<'_>, leaf: NodeId| {
            scan.leaves.is_loose(scan.tree.topology().leaf_number(leaf))
        };
        match self.which_are_leaves(pair) {
            [true, true] => Some(self.gap_of_two_leaves(pair)),
            [true, false] if is_loose(self.a, pair.a) => Some(self.gap_of_leaf_boxes(pair)),
            _ => None,
        }
    }

    fn gap_of_leaf_boxes(&self, pair: NodePair) -> f32 {
        let bounds = self.relative.moved(&self.b.tree.bounds(pair.b));
        gap_of_leaf_and_box(self.level, self.a, pair.a, &bounds)
    }

    fn gap_of_leaves(&self, pair: NodePair) -> f32 {
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
