//! Boxes and enclosures of the children and grandchildren of a node, in lanes.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x4, f32x16, u32x4};

use crate::four_nodes::{FourNodes, NodeBounds};
use crate::part::Part;
use crate::slices::Slices;
use crate::wide::{Child, Growths, WIDTH};

impl Slices<'_> {
    /// Box and enclosure of this part of a node.
    ///
    /// # Panics
    /// When there is no such node.
    #[inline(always)]
    #[must_use]
    pub fn bounds_of(&self, part: Part, node: Child) -> NodeBounds<f32> {
        let id = self.wide.id(node).index();
        NodeBounds::of(&self.boxes[id], &self.growths_of(part)[id])
    }

    /// Those of [`crate::WideTree::children`], in the same order; what there is in other lanes says nothing.
    ///
    /// # Panics
    /// When there is no such node, or it is a leaf.
    #[inline(always)]
    #[must_use]
    pub fn bounds_of_children<S: Simd>(&self, simd: S, part: Part, node: Child) -> FourNodes<S> {
        self.siblings(simd, part, node.index())
    }

    /// Those of [`crate::WideTree::grandchildren`], in the same order; what there is in other lanes says
    /// nothing.
    ///
    /// # Panics
    /// When there is no such node, or it is a leaf.
    #[inline(always)]
    #[must_use]
    pub fn bounds_of_grandchildren<S: Simd>(
        &self,
        simd: S,
        part: Part,
        node: Child,
    ) -> NodeBounds<f32x16<S>> {
        let [a, b, c, d] = self.wide.groups(node);
        let a = self.siblings(simd, part, a.0);
        let b = self.siblings(simd, part, b.0);
        let c = self.siblings(simd, part, c.0);
        let d = self.siblings(simd, part, d.0);
        NodeBounds {
            centre: combined([a.centre, b.centre, c.centre, d.centre]),
            half: combined([a.half, b.half, c.half, d.half]),
            axes: [
                combined([a.axes[0], b.axes[0], c.axes[0], d.axes[0]]),
                combined([a.axes[1], b.axes[1], c.axes[1], d.axes[1]]),
                combined([a.axes[2], b.axes[2], c.axes[2], d.axes[2]]),
            ],
            low: combined([a.low, b.low, c.low, d.low]),
            high: combined([a.high, b.high, c.high, d.high]),
        }
    }

    #[inline(always)]
    fn siblings<S: Simd>(&self, simd: S, part: Part, node: usize) -> FourNodes<S> {
        let siblings = &self.wide.nodes[node];
        let Growths(growths) = &self.wide.growths[part as usize][node];
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

/// The lanes of four after each other.
#[inline(always)]
fn combined<S: Simd>([a, b, c, d]: [[f32x4<S>; 3]; WIDTH]) -> [f32x16<S>; 3] {
    [
        a[0].combine(b[0]).combine(c[0].combine(d[0])),
        a[1].combine(b[1]).combine(c[1].combine(d[1])),
        a[2].combine(b[2]).combine(c[2].combine(d[2])),
    ]
}
