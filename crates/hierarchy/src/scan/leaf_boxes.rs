//! Boxes around the leaves of a scan, for rays and shapes.

use std::ops::ControlFlow;

use fearless_simd::Level;
use nearmiss_geometry::NodeId;
use nearmiss_index::{BoxBody, BoxGrid, BoxRay, BoxStarts, BoxTree, CutBoxVisitor};

use crate::bounds::part::Part;
use crate::scan::arrays::ScanArrays;

/// The least edge of a cell, in sampling radii.
const EDGE: f64 = 4.0;

/// The maximum number of cells for each point.
const CELLS_A_POINT: f64 = 1.0;

/// A tree over the enclosures of the leaves' parts of the obstacle, and a grid that tells which of them are
/// near a place. Boxes are visited by the number of the leaf.
#[derive(Debug)]
pub struct LeafBoxes {
    boxes: BoxTree,
    cells: BoxGrid,
}

impl LeafBoxes {
    /// Builds the tree and the grid of a scan. `None` if an enclosure is unbounded. O(n log n) for n leaves.
    #[must_use]
    pub fn new(scan: &ScanArrays<'_>, level: Level) -> Option<Self> {
        let (tree, leaves) = (&scan.tree, scan.tree.topology.leaves());
        let root = tree.enclosure(Part::Obstacle, NodeId::ROOT).upright();
        if !root.iter().flatten().all(|c| c.is_finite()) {
            return None;
        }
        let boxes = BoxTree::new(leaves, |number| {
            let leaf = tree.topology.leaf(number);
            tree.enclosure(Part::Obstacle, leaf).cut(&tree.bounds(leaf))
        });
        #[expect(clippy::cast_precision_loss, reason = "a count")]
        let most = CELLS_A_POINT * scan.radii.len() as f64;
        let cells = boxes.cells(level, EDGE * f64::from(scan.sampling_radius), most)?;
        Some(Self { boxes, cells })
    }

    /// Visits the leaves whose enclosures a ray passes, those of a group that it enters first before the
    /// others, until `visitor` ends the search. Does not allocate.
    #[inline]
    pub fn visit_along<V: CutBoxVisitor>(
        &self,
        level: Level,
        ray: &BoxRay,
        visitor: &mut V,
    ) -> ControlFlow<()> {
        self.boxes.visit_along(level, ray, visitor)
    }

    /// Returns where a search for all leaves within `core` + `reach` of `place` starts, if the body is within
    /// `core` of it. `None` if that exceeds about four sampling radii, or if too many leaves are there: then
    /// the search starts at the root. O(1).
    #[inline]
    #[must_use]
    pub fn near(&self, place: [f64; 3], core: f64, reach: f64) -> Option<BoxStarts<'_>> {
        self.cells.near(place, core, reach)
    }

    /// Visits the leaves near a body, those of a group that are nearest before the others, until `visitor`
    /// ends the search. The inner parts of boxes are those around the discs and balls. Does not allocate.
    ///
    /// Distances are lower bounds up to rounding, which is below 8e-6 of the greatest coordinate of the scan
    /// and the body.
    #[inline]
    pub fn visit_near<V: CutBoxVisitor>(
        &self,
        level: Level,
        from: (&BoxBody, Option<&BoxStarts<'_>>),
        visitor: &mut V,
    ) -> ControlFlow<()> {
        self.boxes.visit_near(level, from, visitor)
    }
}
