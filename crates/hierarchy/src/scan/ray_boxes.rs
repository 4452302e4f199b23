//! Boxes around the leaves of a scan, for rays.

use nearmiss_geometry::NodeId;
use nearmiss_index::BoxTree;

use crate::bounds::part::Part;
use crate::scan::arrays::ScanArrays;

/// Returns a tree over the enclosures of the leaves' parts of the obstacle, by the number of the leaf. `None`
/// if an enclosure is unbounded. O(n log n) for n leaves.
#[must_use]
pub fn ray_boxes(scan: &ScanArrays<'_>) -> Option<BoxTree> {
    let (tree, leaves) = (&scan.tree, scan.tree.topology.leaves());
    let root = tree.enclosure(Part::Obstacle, NodeId::ROOT).upright();
    let is_bounded = root.iter().flatten().all(|c| c.is_finite());
    let enclosure = |number| tree.enclosure(Part::Obstacle, tree.topology.leaf(number));
    is_bounded.then(|| BoxTree::new(leaves, |number| enclosure(number).for_rays()))
}
