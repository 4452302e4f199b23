//! Boxes and enclosures of the children of a node, in lanes.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x4, u32x4};

use super::{Child, WIDTH, WideTree};
use crate::four_nodes::FourNodes;
use crate::growth::Growth;
use crate::slices::{Part, Slices};

/// What the enclosures of up to four children reach further than their boxes, as [`Growth::pairs`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(C, align(16))]
pub(super) struct Growths([[u32; WIDTH]; 3]);

impl Growths {
    pub(super) fn set(&mut self, lane: usize, growth: &Growth) {
        for (row, pair) in self.0.iter_mut().zip(growth.pairs()) {
            row[lane] = pair;
        }
    }
}

impl WideTree {
    /// What takes the place of a node: its children, the first few of four; or itself alone if it is to stay `whole`, as leaves do.
    ///
    /// # Panics
    /// When there is no such node.
    #[inline]
    #[must_use]
    pub fn children(&self, node: Child, whole: bool) -> ([Child; WIDTH], usize) {
        if whole || node.is_leaf() {
            return ([node; WIDTH], 1);
        }
        let siblings = &self.nodes[node.index()];
        (siblings.children, siblings.lanes().count_ones() as usize)
    }
}

impl Slices<'_> {
    /// Boxes and enclosures of this part of [`WideTree::children`], in the same order; what there is in other
    /// lanes says nothing.
    ///
    /// # Panics
    /// When there is no such node.
    #[inline(always)]
    #[must_use]
    pub fn family<S: Simd>(&self, simd: S, part: Part, node: Child, whole: bool) -> FourNodes<S> {
        if whole || node.is_leaf() {
            let id = self.wide.id(node).index();
            return FourNodes::new(simd, [&self.boxes[id]; WIDTH], [&self.growths_of(part)[id]; WIDTH]);
        }
        let siblings = &self.wide.nodes[node.index()];
        let Growths(growths) = &self.wide.growths[part as usize][node.index()];
        let rows = |[x, y, z]: &[[f32; WIDTH]; 3]| -> [f32x4<S>; 3] {
            [f32x4::load_array_ref(simd, x), f32x4::load_array_ref(simd, y), f32x4::load_array_ref(simd, z)]
        };
        let [u, v, w] = &siblings.axes;
        let [first, second, third] = growths;
        let pairs = [
            u32x4::load_array_ref(simd, first),
            u32x4::load_array_ref(simd, second),
            u32x4::load_array_ref(simd, third),
        ];
        let (low, high) = FourNodes::growth(pairs);
        let (centre, half) = (rows(&siblings.centre), rows(&siblings.half));
        FourNodes { centre, half, axes: [rows(u), rows(v), rows(w)], low, high }
    }
}
