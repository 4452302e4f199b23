//! Bounds on the distance of a shape and a scan.

use std::ops::ControlFlow;

use fearless_simd::{Level, Simd};
use nearmiss_lanes::wide::Bits;

use crate::ask::answer::Evidence;
use crate::ask::options::Semantics;
use crate::solid::answer::ShapeDistance;
use crate::solid::core::{Gap, Solid};
use crate::solid::descent::{LeafSearch, Near};
use crate::solid::elements::{Element, Elements};
use crate::solid::plane::Plane;

/// The search for the nearest disc or ball, nearest node first.
struct Apart<'s, 'a> {
    near: Near<'s, 'a>,
    /// The greatest distance of interest.
    within: f64,
    /// The least distance of the shape so far, and its point.
    upper: f64,
    best: Option<(usize, Gap)>,
    /// The plane between the core and the nearest part.
    plane: Option<Plane>,
    /// The least lower bound of any point that was compared.
    lower: f64,
}

/// The part of a scan that is nearest to a shape, in the stored frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Nearest {
    /// The point whose disc or ball it is.
    pub(crate) i: usize,
    pub(crate) gap: Gap,
    /// The distance of the disc or ball from the shape.
    pub(crate) upper: f64,
    /// A lower bound on the distance of the obstacle.
    pub(crate) lower: f64,
}

/// Bounds the distance of `solid` and the scan, up to `within` in the world. `None` if it is further
/// away, or invalid. `corners` is memory for those of the shape.
pub(crate) fn distance(
    elements: &Elements<'_>,
    solid: Option<&Solid<'_>>,
    within: f64,
    working: (Level, &mut Vec<[f32; 3]>),
) -> Option<ShapeDistance> {
    let (solid, scale) = (solid?, elements.scale());
    let found = nearest(elements, solid, (within / scale).next_up(), working)?;
    let Nearest { i, gap, upper, lower } = Some(found).filter(|it| it.upper * scale <= within)?;
    // From the core to the shape.
    let way = gap.on_disc - gap.on_core;
    let length = way.norm();
    let share = if length > 0.0 { (solid.radius / length).min(1.0) } else { 0.0 };
    let is_ball = !elements.is_disc(i);
    Some(ShapeDistance {
        lower: lower * scale,
        upper: upper * scale,
        points: [elements.in_world(&gap.on_disc), elements.in_world(&(gap.on_core + way * share))],
        source: elements.placed.scan().id(i),
        band: elements.band(i),
        evidence: if is_ball { Evidence::Certified } else { Evidence::Estimated },
    })
}

/// The part of the scan that is nearest to `solid`, up to `most`. `None` if all are further away. `corners`
/// is memory for those of the shape.
pub(crate) fn nearest(
    elements: &Elements<'_>,
    solid: &Solid<'_>,
    most: f64,
    (level, corners): (Level, &mut Vec<[f32; 3]>),
) -> Option<Nearest> {
    // Enclosures, because the nearest place of the obstacle may be outside the boxes.
    let near = Near::new(elements, solid, elements.certifies, corners);
    let none = f64::INFINITY;
    let mut search = Apart { near, within: most, upper: none, best: None, plane: None, lower: none };
    search.near.limit(most);
    // Ends early if they touch.
    if search.near_centre(level).is_continue() {
        // The descent bounds what is near again, with the enclosures of nodes.
        search.lower = none;
        let near = search.near;
        let within = search.upper.min(most);
        let _touching = near.search(level, within, &mut search);
    }
    let (i, gap) = search.best.filter(|_| search.upper <= most)?;
    let upper = search.upper;
    let lower = match elements.semantics {
        Semantics::Thickened(_) => upper,
        _ if !elements.certifies => 0.0,
        _ => search.lower.clamp(0.0, upper),
    };
    Some(Nearest { i, gap, upper, lower })
}

impl Apart<'_, '_> {
    /// Compares the shape with what the grid names at its centre: a point or, further away, a leaf.
    fn near_centre(&mut self, level: Level) -> ControlFlow<()> {
        let Near { elements, solid, .. } = self.near;
        let Some(grid) = elements.clear else { return ControlFlow::Continue(()) };
        let place = solid.centre.into();
        if let Some((leaf, number)) = grid.at(&elements.arrays, place, solid.radius).nearest() {
            return self.compare(elements.arrays.leaves.points(leaf).start + number);
        }
        let Some(leaf) = grid.leaf(place) else { return ControlFlow::Continue(()) };
        Near::visit_leaf(level, leaf, self)
    }

    /// Compares the shape with the part of a point.
    fn compare(&mut self, i: usize) -> ControlFlow<()> {
        let Near { elements, solid, .. } = self.near;
        if elements.is_doubtful(i) {
            return ControlFlow::Continue(());
        }
        let element = elements.element(i);
        if let (Some(plane), Element::Disc(disc)) = (&self.plane, &element)
            && plane.above(disc) > solid.radius + self.upper.max(disc.thickness())
        {
            return ControlFlow::Continue(());
        }
        let (gap, thick) = element.gap(solid, self.upper);
        let distance = gap.distance - solid.radius;
        let distance = if distance <= thick { 0.0 } else { distance };
        if distance < self.upper {
            (self.upper, self.best) = (distance, Some((i, gap)));
            self.plane = solid.plane_across(&(gap.on_core - gap.on_disc));
            self.near.limit(distance.min(self.within));
        }
        if self.upper == 0.0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    /// Updates the lower bound by the obstacle near a point.
    fn bound(&mut self, i: usize, by_lanes: f64) {
        let Near { elements, solid, .. } = self.near;
        let own = if solid.is_closed_in_lanes() && by_lanes > 0.0 {
            by_lanes
        } else {
            let most = self.lower.min(self.upper) + solid.radius;
            by_lanes.max(elements.cell_gap(solid, i, (most, self.plane.as_ref())) - solid.radius)
        };
        self.lower = self.lower.min(own);
    }
}

impl<'s, 'a> LeafSearch<'s, 'a> for Apart<'s, 'a> {
    #[inline(always)]
    fn near(&self) -> &Near<'s, 'a> {
        &self.near
    }

    #[inline(always)]
    fn leaf<S: Simd>(&mut self, simd: S, number: usize, least_sq: f32) -> ControlFlow<()> {
        let elements = self.near.elements;
        let node_gap = self.near.node_gap(least_sq);
        if elements.semantics == Semantics::Surface {
            self.lower = self.lower.min(node_gap);
        }
        for (block, first, count) in elements.arrays.leaves.blocks(number) {
            let gaps = elements.leaf_gaps(simd, &self.near.lane_box, (number, block, first, count));
            let mut left = Elements::lanes_within(simd, (&gaps.elements, count), self.near.most);
            while left != 0 {
                let mut lane = left.trailing_zeros() as usize;
                for other in Bits(left) {
                    if gaps.elements[other] < gaps.elements[lane] {
                        lane = other;
                    }
                }
                left &= !(1 << lane);
                if gaps.elements[lane] > self.near.most {
                    break;
                }
                self.compare(first + lane)?;
            }
            if elements.certifies && elements.semantics == Semantics::Obstacle {
                let upper = self.lower.min(self.upper);
                for lane in Bits(Elements::lanes_within(simd, (&gaps.cells, count), self.near.most)) {
                    let by_lanes = self.near.gap_of_shape(gaps.cells[lane]).max(node_gap);
                    if by_lanes < upper.min(self.lower) {
                        self.bound(first + lane, by_lanes);
                    }
                }
            }
        }
        ControlFlow::Continue(())
    }
}
