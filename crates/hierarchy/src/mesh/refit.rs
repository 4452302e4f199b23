//! Boxes about triangles that have moved: every node keeps its triangles and its axes, and gets new
//! extents, from the leaves up. O(n), in place.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x4};
use nearmiss_geometry::NodeId;
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::change_each;

use crate::bounds::boxes::OrientedBox;
use crate::mesh::block::TriangleBlock;
use crate::tree::topology::{FAN, Topology};
use crate::tree::wide::{Root, Siblings, lanes_of, rows};

/// The number of nodes that a thread takes at once.
const AT_ONCE: usize = 256;

/// The number of levels of the inner nodes over 2³² triangles.
const MOST_LEVELS: usize = 18;

/// Replaces the boxes of all nodes by boxes along the same axes about `blocks`.
///
/// The box of a leaf is the smallest about its triangles; that of another node is the smallest about
/// the boxes of its children.
pub(crate) fn refit(
    topology: &Topology,
    blocks: &[TriangleBlock],
    siblings: &mut [Siblings],
    root: &mut Root,
) {
    let level = Level::new();
    // Nodes are numbered level by level.
    let (mut starts, mut depth) = ([0; MOST_LEVELS + 1], 0);
    while starts[depth] < topology.inner() {
        let children = topology.children(NodeId(id32(starts[depth])));
        let next = children.iter().next().map_or(0, NodeId::index);
        depth += 1;
        starts[depth] = next.min(topology.inner());
    }
    for k in (0..depth).rev() {
        let (first, end) = (starts[k], starts[k + 1]);
        let (upper, below) = siblings.split_at_mut(end);
        let below = Below { topology, blocks, siblings: below, first: end };
        change_each(&mut upper[first..], AT_ONCE, |i, own| {
            let children = topology.children(NodeId(id32(first + i)));
            dispatch!(level, simd => simd.vectorize(
                #[inline(always)]
                || for (lane, child) in children.iter().enumerate() {
                    let bounds = below.about(simd, child, &own.get(lane));
                    own.set(lane, &bounds);
                },
            ));
        });
    }
    let below = Below { topology, blocks, siblings, first: 0 };
    root.bounds = dispatch!(level, simd => below.about(simd, NodeId::ROOT, &root.bounds));
}

/// The boxes and triangles below a level of nodes.
struct Below<'a> {
    topology: &'a Topology,
    blocks: &'a [TriangleBlock],
    /// The boxes of the children of the nodes from `first` on.
    siblings: &'a [Siblings],
    first: usize,
}

impl Below<'_> {
    /// Returns the box along the axes of `bounds` about what is below a node.
    #[inline(always)]
    fn about<S: Simd>(&self, simd: S, id: NodeId, bounds: &OrientedBox) -> OrientedBox {
        let (most, none) = (f32x4::splat(simd, f32::INFINITY), f32x4::splat(simd, f32::NEG_INFINITY));
        let mut extents = [[most; 3], [none; 3]];
        if self.topology.is_leaf(id) {
            self.blocks[self.topology.leaf_number(id)].extents(simd, &bounds.axes, &mut extents);
        } else {
            let of_children = &self.siblings[id.index() - self.first];
            let lanes = lanes_of(self.topology.children(id));
            of_children.extents(simd, lanes, &bounds.axes, &mut extents);
        }
        let [low, high] = extents;
        let (low, high) = (low.map(|row| row.reduce_min()), high.map(|row| row.reduce_max()));
        OrientedBox::spanned(bounds.axes, low, high, 0.0)
    }
}

impl Siblings {
    /// Widens intervals along `axes` by the boxes in these lanes.
    #[inline(always)]
    fn extents<S: Simd>(
        &self,
        simd: S,
        lanes: u32,
        axes: &[[f32; 3]; 3],
        [low, high]: &mut [[f32x4<S>; 3]; 2],
    ) {
        let mut unused = [0.0_f32; FAN];
        for (lane, far) in unused.iter_mut().enumerate() {
            *far = if lanes >> lane & 1 == 1 { 0.0 } else { f32::INFINITY };
        }
        let unused = f32x4::load_array(simd, unused);
        let centre = rows(simd, &self.centre);
        for k in 0..3 {
            let [ax, ay, az] = axes[k];
            let middle = centre[0] * ax + centre[1] * ay + centre[2] * az;
            let mut spread = f32x4::splat(simd, 0.0);
            for j in 0..3 {
                let [x, y, z] = rows(simd, &self.axes[j]);
                let cosine = (x * ax + y * ay + z * az).abs();
                spread += f32x4::load_array_ref(simd, &self.half[j]) * cosine;
            }
            // A lane that is not used is empty: from infinity to minus infinity.
            low[k] = low[k].min(middle - spread + unused);
            high[k] = high[k].max(middle + spread - unused);
        }
    }
}
