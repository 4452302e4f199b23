//! The leaves of a scan near a shape.

use std::ops::ControlFlow;

use fearless_simd::{Level, Simd, dispatch, f32x4};
use nearmiss_geometry::NodeId;
use nearmiss_hierarchy::{Clearance, ClearanceGrid, PlaceVisitor, Siblings, Tree};
use nearmiss_index::{BoxBody, CutBoxVisitor};

use crate::solid::core::Solid;
use crate::solid::elements::Elements;
use crate::solid::lanes::LaneBox;
use crate::solid::probe::is_far;

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
        Self { elements, solid, lane_box, grown, most, most_sq }
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

    /// Visits the leaves within this distance of the shape, until the search ends itself. `at` is what the
    /// grid told about its centre.
    #[inline]
    pub(crate) fn search_at(
        &self,
        level: Level,
        at: Option<(&ClearanceGrid, Clearance<'_>)>,
        within: f64,
        search: &mut impl LeafSearch<'s, 'a>,
    ) -> ControlFlow<()> {
        let (solid, most) = (self.solid, within + self.solid.radius);
        // Leaves are listed about a place: about a longer core there would be others, and a worse proof.
        let listed = at.filter(|_| solid.is_point());
        let listed = listed.and_then(|(grid, at)| {
            grid.visit_near(level, (&at, solid.centre.into()), most, &mut Leaves::of(search))
        });
        listed.unwrap_or_else(|| self.search(level, within, search))
    }

    /// Visits the leaves within this distance of the shape, until the search ends itself.
    pub(crate) fn search(
        &self,
        level: Level,
        within: f64,
        search: &mut impl LeafSearch<'s, 'a>,
    ) -> ControlFlow<()> {
        let (elements, solid, lanes) = (self.elements, self.solid, &self.lane_box);
        let visitor = &mut Leaves::of(search);
        let Some(leaves) = elements.leaves.filter(|_| lanes.is_near) else {
            return elements.arrays.tree.descend_to(level, lanes.centre, visitor);
        };
        let reach = within + solid.radius + elements.beyond_boxes();
        let starts = leaves.near(solid.centre.into(), solid.half.norm(), reach);
        let is_empty = match &starts {
            Some(starts) => starts.is_empty(),
            None => is_far(elements, solid, (within, self.grown)),
        };
        if is_empty {
            return ControlFlow::Continue(());
        }
        let body = BoxBody::new(lanes.centre, lanes.axes, lanes.half, !self.grown);
        leaves.visit_near(level, (&body, starts.as_ref()), visitor)
    }

    /// Visits a single leaf, by its number.
    pub(crate) fn visit_leaf(
        level: Level,
        leaf: usize,
        search: &mut impl LeafSearch<'s, 'a>,
    ) -> ControlFlow<()> {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || search.leaf(simd, leaf, 0.0),
        ))
    }

    /// Lower bounds on the squared distances of the core from the children of a node.
    #[inline(always)]
    pub(crate) fn distances_sq<S: Simd>(&self, simd: S, tree: &Tree<'_>, node: NodeId) -> f32x4<S> {
        let nodes = tree.bounds_of_children(simd, self.elements.part(), node);
        self.lane_box.of_nodes(simd, &nodes, self.grown)
    }

    /// A lower bound on the distance of the shape, in the stored frame, from an enclosure at this squared
    /// distance from its core.
    pub(crate) fn node_gap(&self, least_sq: f32) -> f64 {
        f64::from(least_sq.sqrt() - self.lane_box.slack) - self.solid.radius
    }

    /// A distance from the shape for one from the core in single precision.
    #[inline]
    pub(crate) fn gap_of_shape(&self, gap: f32) -> f64 {
        if self.lane_box.is_near { f64::from(gap) - self.solid.radius } else { f64::NEG_INFINITY }
    }
}

/// A search among the leaves near a shape.
pub(crate) trait LeafSearch<'s, 'a> {
    /// The shape, and how near leaves have to be.
    fn near(&self) -> &Near<'s, 'a>;

    /// Visits a leaf, by its number, whose box or enclosure is at least at this squared distance from the
    /// core. May end the search.
    fn leaf<S: Simd>(&mut self, simd: S, number: usize, least_sq: f32) -> ControlFlow<()>;
}

/// The callbacks of a search, for each structure that finds leaves.
struct Leaves<'v, V> {
    search: &'v mut V,
    /// The squared distance of the node that is visited.
    least_sq: f32,
}

impl<'v, V> Leaves<'v, V> {
    fn of(search: &'v mut V) -> Self {
        Self { search, least_sq: 0.0 }
    }
}

impl<'s, 'a: 's, V: LeafSearch<'s, 'a>> PlaceVisitor for Leaves<'_, V> {
    #[inline(always)]
    fn most_sq(&self) -> f32 {
        self.search.near().most_sq
    }

    #[inline(always)]
    fn distances_sq<S: Simd>(&self, simd: S, node: NodeId, _: &Siblings, _: [f32; 3]) -> f32x4<S> {
        let near = self.search.near();
        near.distances_sq(simd, &near.elements.arrays.tree, node)
    }

    #[inline(always)]
    fn is_wanted(&mut self, _: NodeId, least_sq: f32) -> bool {
        self.least_sq = least_sq;
        least_sq <= self.search.near().most_sq
    }

    #[inline(always)]
    fn foresee(&self, number: usize) {
        self.search.near().elements.arrays.prefetch_leaf(number);
    }

    #[inline(always)]
    fn leaf<S: Simd>(&mut self, simd: S, number: usize) -> ControlFlow<()> {
        self.search.leaf(simd, number, self.least_sq)
    }
}

impl<'s, 'a: 's, V: LeafSearch<'s, 'a>> CutBoxVisitor for Leaves<'_, V> {
    #[inline(always)]
    fn most_sq(&self) -> f32 {
        self.search.near().most_sq
    }

    #[inline(always)]
    fn foresee(&self, number: usize) {
        self.search.near().elements.arrays.prefetch_leaf(number);
    }

    #[inline(always)]
    fn visit<S: Simd>(&mut self, simd: S, number: usize, least_sq: f32) -> ControlFlow<()> {
        self.search.leaf(simd, number, least_sq)
    }
}
