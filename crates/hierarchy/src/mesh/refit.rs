//! Boxes about triangles that have moved: every node keeps its triangles and its axes, and gets new
//! extents, in place.
//!
//! Extents are those of the triangles. Boxes about the boxes of children would take O(n) instead of
//! O(n log n) and less than half the time, but made queries of a galloping horse five times slower.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x4};
use nearmiss_geometry::NodeId;
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::change_each;

use crate::bounds::boxes::OrientedBox;
use crate::mesh::block::TriangleBlock;
use crate::tree::topology::Topology;
use crate::tree::wide::{Root, Siblings};

/// The number of nodes that a thread takes at once. The first ones are the largest.
const AT_ONCE: usize = 4;

/// Replaces the boxes of all nodes by the smallest boxes along the same axes about the triangles in
/// `blocks`. O(n log n).
pub(crate) fn refit(
    topology: &Topology,
    blocks: &[TriangleBlock],
    siblings: &mut [Siblings],
    root: &mut Root,
) {
    let level = Level::new();
    change_each(siblings, AT_ONCE, |id, own| {
        let children = topology.children(NodeId(id32(id)));
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || for (lane, child) in children.iter().enumerate() {
                let bounds = about(simd, &blocks[topology.leaves_under(child)], &own.get(lane, 0.0));
                own.set(lane, &bounds);
            },
        ));
    });
    root.bounds = dispatch!(level, simd => simd.vectorize(
        #[inline(always)]
        || about(simd, blocks, &root.bounds),
    ));
}

/// Returns the smallest box along the axes of `bounds` about triangles.
#[inline(always)]
fn about<S: Simd>(simd: S, blocks: &[TriangleBlock], bounds: &OrientedBox) -> OrientedBox {
    let (most, none) = (f32x4::splat(simd, f32::INFINITY), f32x4::splat(simd, f32::NEG_INFINITY));
    let mut extents = [[most; 3], [none; 3]];
    for block in blocks {
        block.extents(simd, &bounds.axes, &mut extents);
    }
    let [low, high] = extents;
    let (low, high) = (low.map(|row| row.reduce_min()), high.map(|row| row.reduce_max()));
    OrientedBox::spanned(bounds.axes, low, high, 0.0)
}
