//! The descent of a scan's tree towards a shape.

use std::ops::ControlFlow;

use fearless_simd::{Level, Simd, f32x4};
use nearmiss_geometry::NodeId;
use nearmiss_hierarchy::{Clearance, ClearanceGrid, PlaceVisitor, Starts, Tree};

use crate::solid::core::Solid;
use crate::solid::elements::Elements;
use crate::solid::lanes::LaneBox;

/// A shape near a scan, and the distance up to which the scan is of interest.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Near<'s, 'a> {
    pub(crate) elements: &'s Elements<'a>,
    pub(crate) solid: &'s Solid<'s>,
    pub(crate) lane_box: LaneBox<'s>,
    /// `true` if nodes are pruned by their enclosures, `false` if by their boxes.
    grown: bool,
    /// The distance from the core beyond which nothing is of interest, and its square.
    pub(crate) most: f32,
    pub(crate) most_sq: f32,
    /// The squared distance of the node that is visited.
    pub(crate) node_sq: f32,
}

impl<'s, 'a> Near<'s, 'a> {
    /// `corners` is memory for those of the shape.
    pub(crate) fn new(
        elements: &'s Elements<'a>,
        solid: &'s Solid<'s>,
        grown: bool,
        corners: &'s mut Vec<[f32; 3]>,
    ) -> Self {
        let lane_box = LaneBox::new(solid, elements.far, solid.lane_core(corners));
        let (most, most_sq) = (f32::INFINITY, f32::INFINITY);
        Self { elements, solid, lane_box, grown, most, most_sq, node_sq: 0.0 }
    }

    /// Limits the search to this distance from the shape, in the stored frame.
    #[inline]
    #[expect(clippy::cast_possible_truncation, reason = "rounded up")]
    pub(crate) fn limit(&mut self, distance: f64) {
        if !self.lane_box.is_near {
            return;
        }
        let from_core = ((distance + self.solid.radius) as f32).next_up();
        self.most = from_core + self.lane_box.slack;
        let of_boxes = self.most + (self.elements.beyond_boxes() as f32).next_up();
        self.most_sq = (of_boxes * of_boxes).next_up();
    }

    /// Visits the leaves within this distance of the shape, until `visitor` ends the search. `at` is what the
    /// grid told about its centre.
    #[inline]
    pub(crate) fn search<V: PlaceVisitor>(
        &self,
        level: Level,
        at: Option<(&ClearanceGrid, Clearance<'_>)>,
        within: f64,
        visitor: &mut V,
    ) -> ControlFlow<()> {
        let (solid, most) = (self.solid, within + self.solid.radius);
        // Leaves are listed about a place: about a longer core there would be others, and a worse proof.
        let listed = at.filter(|_| solid.is_point());
        let listed =
            listed.and_then(|(grid, at)| grid.visit_near(level, (&at, solid.centre.into()), most, visitor));
        listed.unwrap_or_else(|| self.descend(level, &self.elements.starts(solid, within), visitor))
    }

    /// Visits the leaves near the shape below some nodes, until `visitor` ends the descent.
    pub(crate) fn descend<V: PlaceVisitor>(
        &self,
        level: Level,
        starts: &Starts<'_>,
        visitor: &mut V,
    ) -> ControlFlow<()> {
        self.elements.arrays.tree.descend_from(level, starts, self.lane_box.centre, visitor)
    }

    /// Lower bounds on the squared distances of the core from the children of a node.
    #[inline(always)]
    pub(crate) fn distances_sq<S: Simd>(&self, simd: S, tree: &Tree<'_>, node: NodeId) -> f32x4<S> {
        let nodes = tree.bounds_of_children(simd, self.elements.part(), node);
        self.lane_box.of_nodes(simd, &nodes, self.grown)
    }

    /// A lower bound on the distance of the shape from the enclosure of the node that is visited, in
    /// the stored frame.
    pub(crate) fn node_gap(&self) -> f64 {
        f64::from(self.node_sq.sqrt() - self.lane_box.slack) - self.solid.radius
    }

    /// A distance from the shape for one from the core in single precision.
    #[inline]
    pub(crate) fn gap_of_shape(&self, gap: f32) -> f64 {
        if self.lane_box.is_near { f64::from(gap) - self.solid.radius } else { f64::NEG_INFINITY }
    }
}
