//! Boxes around the triangles of all nodes.

use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch, f32x4};
use nearmiss_geometry::NodeId;
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::change_each;

use crate::bounds::boxes::OrientedBox;
use crate::mesh::block::TriangleBlock;
use crate::tree::cut::UPRIGHT;
use crate::tree::topology::Topology;

/// The number of nodes that a thread takes at once.
const AT_ONCE: usize = 16;

/// Replaces the box of each node by the smallest one along its axes that contains the node's
/// triangles, or by the one along the axes of the stored frame if that has the smaller surface.
/// Buildings and machines are drawn along these axes, and the second moments of a cube or square
/// distinguish no axes. O(n log n).
pub(crate) fn boxes_of_triangles(topology: &Topology, boxes: &mut [OrientedBox], blocks: &[TriangleBlock]) {
    let level = Level::new();
    change_each(boxes, AT_ONCE, |id, bounds| {
        let blocks = &blocks[topology.leaves_under(NodeId(id32(id)))];
        let [own, upright] = [bounds.axes, UPRIGHT].map(|axes| around(level, blocks, axes));
        let surface = |OrientedBox { half: [x, y, z], .. }: &OrientedBox| x * y + y * z + z * x;
        *bounds = if surface(&upright) < surface(&own) { upright } else { own };
    });
}

/// Returns the smallest box along `axes` around the triangles of some leaves.
fn around(level: Level, blocks: &[TriangleBlock], axes: [[f32; 3]; 3]) -> OrientedBox {
    let [low, high] = dispatch!(level, simd => simd.vectorize(
        #[inline(always)]
        || {
            let (most, none) =
                (f32x4::splat(simd, f32::INFINITY), f32x4::splat(simd, f32::NEG_INFINITY));
            let mut extents = [[most; 3], [none; 3]];
            for block in blocks {
                block.extents(simd, &axes, &mut extents);
            }
            let [low, high] = extents;
            [low.map(|row| row.reduce_min()), high.map(|row| row.reduce_max())]
        },
    ));
    OrientedBox::spanned(axes, low, high, 0.0)
}
