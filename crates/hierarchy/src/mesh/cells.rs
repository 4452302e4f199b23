//! The well-filled cells of each node of a mesh.

use nearmiss_geometry::NodeId;
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::fill;

use crate::bounds::boxes::OrientedBox;
use crate::bounds::cells::Grid;
use crate::mesh::block::{LEAF_TRIANGLES, TriangleBlock};
use crate::tree::topology::Topology;

/// Counts the well-filled cells of every node, in the order of their ids. O(n log n).
pub(crate) fn filled_cells(topology: &Topology, boxes: &[OrientedBox], blocks: &[TriangleBlock]) -> Vec<u8> {
    let mut counts = vec![0; topology.len()];
    fill(&mut counts, |id| {
        let mut grid = Grid::over(&boxes[id]);
        for i in topology.points(NodeId(id32(id))) {
            grid.add(&blocks[i / LEAF_TRIANGLES].get(i % LEAF_TRIANGLES));
        }
        grid.filled()
    });
    counts
}
