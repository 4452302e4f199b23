//! The descent of one tree towards a position: the loop of all proximity queries.

use std::ops::ControlFlow;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x4, mask32x4};
use nearmiss_geometry::NodeId;

use crate::tree::topology::{FAN, TREE_STACK};
use crate::tree::wide::{Siblings, Tree, lanes_of};

/// The callbacks of a descent towards a position. Distances are squared, in single precision.
pub trait PlaceVisitor {
    /// `true` if leaves are visited in order; otherwise siblings are visited nearest first.
    const IN_ORDER: bool = false;

    /// Returns the squared distance beyond which boxes are skipped.
    fn most_sq(&self) -> f32;

    /// Returns the same limit for each child of `node`.
    #[inline(always)]
    fn most_sq_of<S: Simd>(&self, simd: S, node: NodeId) -> f32x4<S> {
        let _ = node;
        f32x4::splat(simd, self.most_sq())
    }

    /// Returns the squared distances of the children of `node` from the position, or lower bounds of
    /// the squared distances from something larger. Infinite for a child that is skipped.
    #[inline(always)]
    fn distances_sq<S: Simd>(&self, simd: S, node: NodeId, siblings: &Siblings, place: [f32; 3]) -> f32x4<S> {
        let _ = node;
        siblings.distances_sq(simd, place)
    }

    /// Returns `true` if a node, whose box is at this squared distance, is to be visited. Called
    /// immediately before the visit.
    #[inline(always)]
    fn is_wanted(&mut self, node: NodeId, least_sq: f32) -> bool {
        let _ = node;
        least_sq <= self.most_sq()
    }

    /// Called with the number of a leaf that is near, before other nodes are visited: for a leaf that is
    /// not in the cache, a good time to load it.
    #[inline(always)]
    fn foresee(&self, number: usize) {
        let _ = number;
    }

    /// Visits a leaf, by its number, whose box is near. May end the descent.
    fn leaf<S: Simd>(&mut self, simd: S, number: usize) -> ControlFlow<()>;
}

impl Tree<'_> {
    /// Visits the leaves whose boxes are near a position, until `visitor` ends the descent.
    pub fn descend_to<V: PlaceVisitor>(
        &self,
        level: Level,
        place: [f32; 3],
        visitor: &mut V,
    ) -> ControlFlow<()> {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.descend_to_by(simd, place, visitor),
        ))
    }

    /// Does the same as [`Self::descend_to`] with the instruction set of the caller.
    #[inline(always)]
    pub(crate) fn descend_to_by<S: Simd, V: PlaceVisitor>(
        &self,
        simd: S,
        place: [f32; 3],
        visitor: &mut V,
    ) -> ControlFlow<()> {
        let topology = self.topology;
        let mut stack = [(0.0, NodeId::ROOT); TREE_STACK];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (least, node) = stack[top];
            if !visitor.is_wanted(node, least) {
                continue;
            }
            if topology.is_leaf(node) {
                visitor.leaf(simd, topology.leaf_number(node))?;
                continue;
            }
            let (siblings, children) = (&self.siblings[node.index()], topology.children(node));
            let (bottom, distances) = (top, visitor.distances_sq(simd, node, siblings, place));
            let near: mask32x4<S> = distances.simd_le(visitor.most_sq_of(simd, node));
            let near = near.to_bitmask() & u64::from(lanes_of(children));
            if V::IN_ORDER {
                // First on top.
                for lane in (0..children.len()).rev() {
                    stack[top] = (0.0, children.lanes()[lane]);
                    top += usize::from(near >> lane & 1 != 0);
                }
                continue;
            }
            let (mut left, distances) = (near, distances.to_array());
            while left != 0 {
                let lane = left.trailing_zeros() as usize;
                left &= left - 1;
                let (own, child) = (distances[lane % FAN], children.lanes()[lane % FAN]);
                if topology.is_leaf(child) {
                    visitor.foresee(topology.leaf_number(child));
                }
                // Nearest on top.
                let mut at = top;
                while at > bottom && stack[at - 1].0 < own {
                    stack[at] = stack[at - 1];
                    at -= 1;
                }
                stack[at] = (own, child);
                top += 1;
            }
        }
        ControlFlow::Continue(())
    }
}
