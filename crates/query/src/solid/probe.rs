//! The answers of a scan's clearance grid about a shape, before any search.

use std::ops::ControlFlow;

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{Clearance, ClearanceGrid};

use crate::solid::core::Solid;
use crate::solid::elements::Elements;

/// The maximum number of places at which the grid is probed.
const MOST_PROBES: usize = 9;

/// The distance of places, in edges of the grid's cubes: that of the places of a cube.
const APART: f64 = 1.0 / 3.0;

/// The answer of the grid about a shape.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Probed<'a> {
    /// No part of the scan is within the margin of the shape.
    Clear,
    /// The caller ended the search at a point.
    Ended,
    /// Nothing is decided. The grid, and what it tells about the centre of the shape.
    Open(Option<(&'a ClearanceGrid, Clearance<'a>)>),
}

/// Returns `true` if the grid tells at the centre of a shape that no disc or ball is within the margin.
#[inline]
pub(crate) fn is_far(elements: &Elements<'_>, solid: &Solid<'_>) -> bool {
    let within = elements.margin + solid.radius + solid.half.norm();
    let told = elements.clear.map(|grid| grid.at(&elements.arrays, solid.centre.into(), within));
    told.is_some_and(|at| at.discs > within)
}

/// Probes the grid at the centre of a shape and, if that does not decide, along the longest axis of its core.
///
/// `proven` selects the volumes that contain the obstacle instead of the discs and balls. Calls `each` with
/// the points that are named where the shape may touch.
#[inline(always)]
pub(crate) fn probe<'a>(
    elements: &Elements<'a>,
    solid: &Solid<'_>,
    proven: bool,
    mut each: impl FnMut(usize) -> ControlFlow<()>,
) -> Probed<'a> {
    let Some(grid) = elements.clear else { return Probed::Open(None) };
    let within = elements.margin + solid.radius;
    let bound = |at: &Clearance<'_>| if proven { at.obstacle } else { at.discs };
    let mut named = |at: &Clearance<'_>, inner: f64| match at.nearest() {
        Some((leaf, number)) if at.discs <= within + inner => {
            each(elements.arrays.leaves.points(leaf).start + number)
        }
        _ => ControlFlow::Continue(()),
    };
    let at = |place: Vector3<f64>| grid.at(&elements.arrays, place.into(), within);
    let centre = at(solid.centre);
    if bound(&centre) > within + solid.half.norm() {
        return Probed::Clear;
    }
    let axis = solid.half.imax();
    let [length, a, b] = [0, 1, 2].map(|j| solid.half[(axis + j) % 3]);
    // Balls of this radius about places of the axis are in the core, if it is a segment or a box.
    let inner = a.min(b);
    if named(&centre, inner).is_break() {
        return Probed::Ended;
    }
    let across = (a * a + b * b).sqrt();
    let apart = (APART * grid.edge()).max(0.5 * across);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
    let count = ((length / apart).ceil() as usize).clamp(1, MOST_PROBES) | 1;
    #[expect(clippy::cast_precision_loss, reason = "a small number")]
    let half = length / count as f64;
    // Balls of this radius about the places contain the core.
    let cover = within + (half * half + across * across).sqrt() * (1.0 + 1e-9);
    let mut is_clear = bound(&centre) > cover;
    for i in 1..count {
        #[expect(clippy::cast_precision_loss, reason = "a small number")]
        let steps = i.div_ceil(2) as f64 * if i % 2 == 0 { 2.0 * half } else { -2.0 * half };
        let at = at(solid.centre + solid.axes[axis] * steps);
        is_clear &= bound(&at) > cover;
        if named(&at, inner).is_break() {
            return Probed::Ended;
        }
    }
    if is_clear { Probed::Clear } else { Probed::Open(Some((grid, centre))) }
}
