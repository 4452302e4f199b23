//! The nodes at which the descent of one tree starts.

use nearmiss_geometry::NodeId;
use nearmiss_lanes::vector::{dot, sub};

/// The maximum number of nodes at which a descent starts.
pub(crate) const MOST_STARTS: usize = 32;

/// A node at which descents start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Start {
    pub(crate) node: NodeId,
    /// A lower bound on the distance of the node.
    pub(crate) distance: f32,
}

/// A ball and a slab about the enclosure of a node, which tell without its box that it is far away.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Plate {
    pub(crate) centre: [f32; 3],
    pub(crate) radius: f32,
    /// The unit normal of the slab, and half its thickness.
    pub(crate) normal: [f32; 3],
    pub(crate) half: f32,
}

impl Plate {
    /// A lower bound on the distance of a position, up to rounding.
    #[inline(always)]
    fn distance(&self, place: [f32; 3]) -> f32 {
        let d = sub(place, self.centre);
        (dot(d, d).sqrt() - self.radius).max(dot(self.normal, d).abs() - self.half)
    }
}

/// The nodes at which a descent starts: the root, or those that a [`NodeGrid`](crate::NodeGrid) lists.
#[derive(Debug, Clone, Copy)]
pub struct Starts<'a> {
    /// At most [`MOST_STARTS`], the furthest first.
    pub(crate) nodes: &'a [Start],
    /// By how much the distances of the nodes may exceed those that the visitor compares.
    pub(crate) beyond: f32,
    /// The plates of the nodes, from that of the first lowest inner node on.
    pub(crate) plates: (&'a [Plate], u32),
    /// Nodes further from this place are left out.
    pub(crate) place: [f32; 3],
    pub(crate) most: f32,
}

impl Starts<'_> {
    /// The root.
    pub const ROOT: Self = Self { nodes: &[Start { node: NodeId::ROOT, distance: 0.0 }], ..Self::NONE };

    /// No node.
    pub const NONE: Self =
        Self { nodes: &[], beyond: 0.0, plates: (&[], 0), place: [0.0; 3], most: f32::INFINITY };

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
        let (plates, first) = self.plates;
        let mut top = 0;
        for start in self.nodes {
            let plate = plates.get(start.node.0.wrapping_sub(first) as usize);
            let is_far = plate.is_some_and(|plate| plate.distance(self.place) > self.most);
            let least = (start.distance - self.beyond).max(0.0);
            stack[top] = (least * least, start.node);
            top += usize::from(!is_far);
        }
        top
    }
}
