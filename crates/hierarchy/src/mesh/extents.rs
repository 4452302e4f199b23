//! Boxes around the triangles of all nodes.

use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch, f32x4};
use nearmiss_geometry::NodeId;
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::change_each;

use crate::bounds::boxes::OrientedBox;
use crate::mesh::block::TriangleBlock;
use crate::tree::topology::Topology;

/// The number of nodes that a thread takes at once.
const AT_ONCE: usize = 16;

/// Replaces the box of each node by the smallest one along its axes that contains the node's
/// triangles. O(n log n).
pub(crate) fn boxes_of_triangles(topology: &Topology, boxes: &mut [OrientedBox], blocks: &[TriangleBlock]) {
    let level = Level::new();
    change_each(boxes, AT_ONCE, |id, bounds| {
        let leaves = topology.leaves_under(NodeId(id32(id)));
        let [low, high] = dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || {
                let (most, none) =
                    (f32x4::splat(simd, f32::INFINITY), f32x4::splat(simd, f32::NEG_INFINITY));
                let mut extents = [[most; 3], [none; 3]];
                for block in &blocks[leaves.clone()] {
                    block.extents(simd, &bounds.axes, &mut extents);
                }
                let [low, high] = extents;
                [low.map(|row| row.reduce_min()), high.map(|row| row.reduce_max())]
            },
        ));
        *bounds = OrientedBox::spanned(bounds.axes, low, high, 0.0);
    });
}
