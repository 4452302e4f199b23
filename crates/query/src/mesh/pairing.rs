//! Two meshes as a [`Pairing`].

use std::ops::ControlFlow;

use fearless_simd::Level;
use nearmiss_geometry::Pose;
use nearmiss_hierarchy::{NodePair, Part, Relative, Tree};
use nearmiss_mesh::triangle_distance;

use crate::mesh::mesh_pair::{EXACT, MeshPairing};
use crate::mesh::triangle_pairs::least_distances;
use crate::pair::meter::Meter;
use crate::pair::pairing::{ItemPair, Pairing};

impl MeshPairing<'_> {
    /// The numbers of two leaves.
    fn numbers(&self, pair: NodePair) -> [usize; 2] {
        [self.a.tree.topology().leaf_number(pair.a), self.b.tree.topology().leaf_number(pair.b)]
    }

    /// The distance of two triangles in a's stored frame.
    fn apart(&self, triangles: [usize; 2]) -> f64 {
        let [a, b] = self.corners(triangles);
        self.to_stored(triangle_distance(&a, &b).distance)
    }

    /// The least distance of the triangles of two leaves that is less than `most`, in a's stored frame, and
    /// these triangles.
    fn nearest_of_leaves(&self, pair: NodePair, most: f64) -> Option<(f64, [usize; 2])> {
        let leaves = self.numbers(pair);
        let blocks = [&self.a.blocks[leaves[0]], &self.b.blocks[leaves[1]]];
        let bounds = least_distances(self.level, blocks, &self.relative);
        let mut best = None;
        let _all = Self::by_bound(leaves, (&bounds, self.lanes(leaves)), |bound, triangles| {
            let most = best.map_or(most, |(least, _)| least);
            if f64::from(bound) * (1.0 - 1e-9) >= most {
                return ControlFlow::Break(());
            }
            let distance = self.apart(triangles);
            if distance < most {
                best = Some((distance, triangles));
            }
            ControlFlow::Continue(())
        });
        best
    }

    /// The least distance of the triangles of two leaves, rounded down.
    fn gap_of_two_leaves(&self, pair: NodePair) -> f32 {
        let least = self.nearest_of_leaves(pair, f64::INFINITY).map_or(0.0, |(least, _)| least);
        #[expect(clippy::cast_possible_truncation, reason = "rounded down")]
        let least = (least * (1.0 - 1e-6)) as f32;
        least
    }
}

/// The surface is all that a mesh has. Its enclosures are its boxes.
impl Pairing for MeshPairing<'_> {
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
        Part::Surface
    }

    #[inline(always)]
    fn relative(&self) -> &Relative {
        &self.relative
    }

    fn placed(&self) -> [&Pose; 2] {
        [self.meshes[0].stored_to_world(), self.meshes[1].stored_to_world()]
    }

    #[inline(always)]
    fn both<'t>(&self) -> [&'t Tree<'t>; 2]
    where
        Self: 't,
    {
        [&self.a.tree, &self.b.tree]
    }

    fn band_of(&self, _: NodePair) -> f64 {
        self.band()
    }

    fn balls_apart(&self) -> f64 {
        self.gap
    }

    fn gap_of_enclosures(&self, pair: NodePair) -> f32 {
        self.relative.gap(&self.a.tree.bounds(pair.a), &self.b.tree.bounds(pair.b))
    }

    fn better_gap(&self, pair: NodePair, gap: f32) -> f32 {
        self.gap_by_points(pair).map_or(gap, |by_triangles| by_triangles.max(gap))
    }

    fn gap_by_points(&self, pair: NodePair) -> Option<f32> {
        (self.which_are_leaves(pair) == [true; 2]).then(|| self.gap_of_two_leaves(pair))
    }

    fn gap_of_leaf_boxes(&self, pair: NodePair) -> f32 {
        self.gap_of_enclosures(pair)
    }

    fn gap_of_leaves(&self, pair: NodePair, _: f32) -> f32 {
        self.gap_of_two_leaves(pair)
    }

    fn items(&self, items: [usize; 2]) -> ItemPair {
        ItemPair { distance: self.apart(items) * self.to_world(), items }
    }

    fn nearest(&mut self, leaves: NodePair, best: ItemPair) -> ItemPair {
        let found = self.nearest_of_leaves(leaves, best.distance / self.to_world());
        found.map_or(best, |(distance, items)| ItemPair { distance: distance * self.to_world(), items })
    }

    #[inline]
    fn count_leaves(&mut self, _: [usize; 2]) {
        self.meter.spent.leaf_pairs += 1;
        self.meter.leaf_work(EXACT);
    }
}
