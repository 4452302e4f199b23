//! The order by the probability of a collision, from the numbers of well-filled cells (Klein &
//! Zachmann, slides on average-case collision detection, 2003).
//!
//! The same estimate as for two meshes, with points instead of polygons. The slides count cells when
//! an object is prepared. Here a node's cells are counted when a search first compares it, and kept
//! in the scratch: a scan then needs no stored array for a method that the default search does not
//! use. Counting is no work of a query.

use nearmiss_geometry::NodeId;
use nearmiss_hierarchy::ScanArrays;

/// The cells of a scan's nodes that were counted so far.
#[derive(Debug, Clone, Default)]
pub(crate) struct CountedCells {
    /// The hash of the scan.
    identity: u64,
    /// By node; 0 if not counted yet.
    counts: Vec<u8>,
}

impl CountedCells {
    /// Starts with a scan, and keeps what is known about it.
    pub(crate) fn start(&mut self, scan: &ScanArrays<'_>) {
        let (identity, nodes) = (scan.outline.identity, scan.tree.topology().len());
        if self.identity != identity || self.counts.len() != nodes {
            self.identity = identity;
            self.counts.clear();
            self.counts.resize(nodes, 0);
        }
    }

    /// Returns the number of well-filled cells of a node.
    pub(crate) fn get(&mut self, scan: &ScanArrays<'_>, node: NodeId) -> f32 {
        let Some(count) = self.counts.get_mut(node.index()) else { return 1.0 };
        if *count == 0 {
            *count = scan.filled_cells(node);
        }
        f32::from(*count)
    }
}
