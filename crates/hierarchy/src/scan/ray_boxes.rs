//! Boxes around the leaves of a scan, for rays.

use nearmiss_geometry::NodeId;
use nearmiss_index::BoxTree;
use nearmiss_lanes::parallel::map;

use crate::bounds::boxes::OrientedBox;
use crate::scan::arrays::ScanArrays;

/// Boxes around the leaves' parts of the obstacle, for rays.
#[derive(Debug)]
pub struct RayBoxes {
    /// Upright boxes, cut by a slab.
    pub tree: BoxTree,
    /// The enclosures, by the number of the leaf.
    pub enclosures: Vec<OrientedBox>,
}

impl RayBoxes {
    /// Bounds the leaves of a scan. `None` if an enclosure is unbounded. O(n log n) for n leaves.
    #[must_use]
    pub fn new(scan: &ScanArrays<'_>) -> Option<Self> {
        let topology = scan.tree.topology;
        let root = scan.obstacle_enclosure(NodeId::ROOT.index()).upright();
        if !root.iter().flatten().all(|c| c.is_finite()) {
            return None;
        }
        let enclosure = |number: usize| scan.obstacle_enclosure(topology.leaf(number).index());
        let enclosures = map(topology.leaves(), enclosure);
        let tree = BoxTree::new(enclosures.len(), |number| enclosures[number].for_rays());
        Some(Self { tree, enclosures })
    }
}
