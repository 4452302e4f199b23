//! The operations on two things under a relative pose that proofs and searches by distance share.

use fearless_simd::Level;
use nearmiss_geometry::Pose;
use nearmiss_hierarchy::{NodePair, Part, Relative, Tree};

use crate::pair::bounds::Bounds;
use crate::pair::meter::Meter;
use crate::pair::relative_pose::RelativePose;

/// Two items of the leaves of a pair, such as points or triangles, and their distance in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ItemPair {
    /// For points of obstacles, minus the radii of their balls.
    pub(crate) distance: f64,
    /// The numbers of the items of a and b, in leaf order.
    pub(crate) items: [usize; 2],
}

/// Two things under a relative pose, as proofs and searches by distance see them. Gaps are lower
/// bounds of distances in a's stored frame, up to [`Self::slack`].
pub(crate) trait Pairing {
    /// The cost of the search.
    fn meter(&mut self) -> &mut Meter;

    /// The SIMD instructions to use.
    fn level(&self) -> Level;

    /// The part of each scan that the enclosures contain.
    fn part(&self) -> Part;

    /// The relative pose in single precision.
    fn relative(&self) -> &Relative;

    /// The poses of both stored frames in the world.
    fn placed(&self) -> [&Pose; 2];

    /// Both trees.
    fn both<'t>(&self) -> [&'t Tree<'t>; 2]
    where
        Self: 't;

    /// The band at the nearest points of two nodes, in the world.
    fn band_of(&self, nodes: NodePair) -> f64;

    /// A lower bound of the distance in the world: the gap of the bounding balls.
    fn balls_apart(&self) -> f64;

    /// The gap of the enclosures of two nodes.
    fn gap_of_enclosures(&self, pair: NodePair) -> f32;

    /// The greater of `gap`, the gap of the enclosures of two nodes, and the gap that their points
    /// or triangles show.
    fn better_gap(&self, pair: NodePair, gap: f32) -> f32;

    /// A lower bound on the distance of the obstacles of two nodes, at least one of which is a leaf,
    /// from its points or triangles. `None` if boxes give the same.
    fn gap_by_points(&self, pair: NodePair) -> Option<f32>;

    /// The same for two leaves, from the points or triangles of each and the box of the other.
    fn gap_of_leaf_boxes(&self, pair: NodePair) -> f32;

    /// The same for two leaves, from the points or triangles of both; `most` is enough.
    fn gap_of_leaves(&self, pair: NodePair, most: f32) -> f32;

    /// The items with these numbers.
    fn items(&self, items: [usize; 2]) -> ItemPair;

    /// The nearest of `best` and all pairs of items of two leaves.
    fn nearest(&mut self, leaves: NodePair, best: ItemPair) -> ItemPair;

    /// Counts two leaves, given by leaf numbers, whose items are compared next.
    fn count_leaves(&mut self, leaves: [usize; 2]);

    /// The rounding error of a gap.
    #[inline(always)]
    fn slack(&self) -> f32 {
        self.relative().slack()
    }

    /// The length in the world of one unit of a's stored frame.
    fn to_world(&self) -> f64 {
        self.placed()[0].scale()
    }

    /// Prepares `pose`, b's pose in a's stored frame, for bounds of distances.
    fn relative_pose(&self, pose: &Pose) -> RelativePose {
        RelativePose::new(self.both().map(Tree::root_box), self.placed(), pose)
    }

    /// Both trees, for a descent by distance.
    #[inline(always)]
    fn bounds<'t>(&self, relative_pose: &'t RelativePose) -> Bounds<'t>
    where
        Self: 't,
    {
        Bounds { trees: self.both(), relative_pose, part: self.part() }
    }

    /// Returns which of the two nodes are leaves.
    #[inline(always)]
    fn which_are_leaves(&self, pair: NodePair) -> [bool; 2] {
        let [a, b] = self.both().map(Tree::topology);
        [a.is_leaf(pair.a), b.is_leaf(pair.b)]
    }

    /// Returns `true` if both nodes exist and are leaves.
    fn are_leaves(&self, pair: NodePair) -> bool {
        let [a, b] = self.both().map(Tree::topology);
        a.has(pair.a) && b.has(pair.b) && self.which_are_leaves(pair) == [true; 2]
    }
}
