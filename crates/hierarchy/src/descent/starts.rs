//! The nodes at which the descent of one tree starts.

use nearmiss_geometry::NodeId;

/// The maximum number of nodes at which a descent starts.
pub(crate) const MOST_STARTS: usize = 32;

/// A node at which descents start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Start {
    pub(crate) node: NodeId,
    /// A lower bound on the distance of the node.
    pub(crate) distance: f32,
}

/// The nodes at which a descent starts: the root, or those that a [`NodeGrid`](crate::NodeGrid) lists.
#[derive(Debug, Clone, Copy)]
pub struct Starts<'a> {
    /// At most [`MOST_STARTS`], the furthest first.
    pub(crate) nodes: &'a [Start],
    /// By how much the distances of the nodes may exceed those that the visitor compares.
    pub(crate) beyond: f32,
}

impl Starts<'_> {
    /// The root.
    pub const ROOT: Self = Self { nodes: &[Start { node: NodeId::ROOT, distance: 0.0 }], beyond: 0.0 };

    /// No node.
    pub const NONE: Self = Self { nodes: &[], beyond: 0.0 };

    /// Returns `true` if there are no nodes.
    #[inline]
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Writes the nodes, each with a lower bound on its squared distance, to the front of `stack`.
    /// Returns their number.
    #[inline(always)]
    pub(crate) fn put(&self, stack: &mut [(f32, NodeId)]) -> usize {
        for (place, start) in stack.iter_mut().zip(self.nodes) {
            let least = (start.distance - self.beyond).max(0.0);
            *place = (least * least, start.node);
        }
        self.nodes.len()
    }
}
