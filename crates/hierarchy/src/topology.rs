//! Which nodes there are and which points lie under them. Ids only: nothing here knows what a point is.
//!
//! Nodes stand in preorder: a left child directly follows its parent. Every leaf but the last is full, so the
//! number of nodes under a node follows from the number of its points alone, and a parallel build knows in
//! advance where each part belongs.

use bytemuck::{Pod, Zeroable};
use nearmiss_geometry::NodeId;

/// Greatest number of points that a leaf may be built with; queries reserve room for so many.
pub const MOST_LEAF_POINTS: usize = 64;

/// A node: a contiguous run of points in leaf order, and two children unless it is a leaf.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Node {
    /// First point.
    pub first: u32,
    /// Number of points, at least one.
    pub count: u32,
    /// Id of the right child; 0 for a leaf. The left child has the id after this node's.
    pub right: u32,
}

impl Node {
    /// Whether there are no children.
    #[inline]
    #[must_use]
    pub const fn is_leaf(&self) -> bool {
        self.right == 0
    }

    /// The children of this node, whose id is `id`; the node must not be a leaf.
    #[inline]
    #[must_use]
    pub const fn children(&self, id: NodeId) -> [NodeId; 2] {
        [NodeId(id.0 + 1), NodeId(self.right)]
    }

    /// The points under the node.
    #[inline]
    #[must_use]
    pub const fn points(&self) -> std::ops::Range<usize> {
        self.first as usize..self.first as usize + self.count as usize
    }
}

/// How many nodes a tree of `points` points has, with leaves of at most `leaf_size`.
pub(crate) const fn node_count(points: usize, leaf_size: usize) -> usize {
    2 * points.div_ceil(leaf_size) - 1
}

/// How many of `points` points go to the left child: half the leaves, rounded up, all of them full.
pub(crate) const fn left_count(points: usize, leaf_size: usize) -> usize {
    points.div_ceil(leaf_size).div_ceil(2) * leaf_size
}

/// Room for a descent that keeps at most one sibling a level: trees of 2³² points have 31 levels at most.
pub(crate) const TREE_STACK: usize = 64;
