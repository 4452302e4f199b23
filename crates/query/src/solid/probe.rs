//! The answers of a scan's clearance grid about a shape, before any search.

use std::ops::ControlFlow;

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{Clearance, ClearanceGrid};

use crate::solid::core::Solid;
use crate::solid::elements::Elements;
use crate::solid::shape::Shape;

/// The maximum number of parts of a core.
const MOST_PARTS: usize = 11;

/// The maximum number of parts if only a touch is left to find.
const MOST_TO_TOUCH: usize = 5;

/// The maximum number of parts that wait for others: each one that is halved leaves one more.
const MOST_WAITING: usize = MOST_PARTS / 2 + 1;

/// The estimated distance of what is nearest, relative to the one that is to be proven, from which on another
/// place is looked up for the proof.
const FAR_ENOUGH: f64 = 0.9;

/// A direction from the nearest point, and its distance.
type Direction = ([f64; 3], f64);

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

/// Returns `true` if the grid tells at the centre of a shape that no disc or ball is within this distance of
/// the shape or, if enclosures count, no part of the obstacle.
#[inline]
pub(crate) fn is_far(elements: &Elements<'_>, solid: &Solid<'_>, (within, enclosures): (f64, bool)) -> bool {
    let within = within + solid.radius + solid.half.norm() * (1.0 + 1e-9);
    elements.clear.is_some_and(|grid| {
        let at = grid.at(&elements.arrays, solid.centre.into(), within);
        within < if enclosures { at.obstacle } else { at.discs }
    })
}

/// The answer of the grid about the centre of a shape.
#[derive(Debug, Clone, Copy)]
pub(crate) struct About<'a> {
    pub(crate) at: Clearance<'a>,
    /// `true` if this proves that no part of the scan is within the margin of a ball about the shape: the
    /// core of such a shape need not be worked out.
    pub(crate) is_clear: bool,
    /// The centre, and the radius about the core, in the stored frame.
    pub(crate) ball: (Vector3<f64>, f64),
}

/// Looks up the centre of a shape. `None` without a grid, and for shapes of any places.
///
/// `proven` selects the volumes that contain the obstacle instead of the discs and balls.
#[inline(always)]
pub(crate) fn about<'a>(elements: &Elements<'a>, shape: &Shape<'_>, proven: bool) -> Option<About<'a>> {
    let (grid, (centre, [radius, beyond])) = (elements.clear?, shape.ball()?);
    let placed = elements.placed.stored_to_world();
    let (centre, radius) = (placed.apply_inverse(centre), radius / placed.scale());
    let within = elements.margin + radius;
    let at = grid.at(&elements.arrays, centre, within);
    let bound = if proven { at.obstacle } else { at.discs };
    let is_clear = bound > within + beyond / placed.scale() * (1.0 + 1e-9);
    Some(About { at, is_clear, ball: (centre.into(), radius) })
}

/// Probes the grid at the centre of a shape and, where that does not decide, at the centres of parts of its
/// core.
///
/// `proven` selects the volumes that contain the obstacle instead of the discs and balls. Calls `each` with
/// the points that are named where the shape may touch. `centre` is what the grid told about the centre, if
/// it was asked.
#[inline(always)]
pub(crate) fn probe<'a>(
    elements: &Elements<'a>,
    solid: &Solid<'_>,
    (proven, centre): (bool, Option<Clearance<'a>>),
    mut each: impl FnMut(usize) -> ControlFlow<()>,
) -> Probed<'a> {
    let Some(grid) = elements.clear else { return Probed::Open(None) };
    let within = elements.margin + solid.radius;
    let probes = Probes { elements, grid, within, proven };
    let centre = centre.unwrap_or_else(|| probes.at(solid.centre));
    if probes.bound(&centre) > within + solid.half.norm() {
        return Probed::Clear;
    }
    let mut waiting = [Part { place: solid.centre, half: solid.half }; MOST_WAITING];
    let (mut left, mut count, mut is_clear) = (1, 1, true);
    while left > 0 {
        left -= 1;
        let part = waiting[left];
        let at = if count == 1 { centre } else { probes.at(part.place) };
        let cover = within + part.half.norm() * (1.0 + 1e-9);
        let mut bound = probes.bound(&at);
        if bound > cover {
            continue;
        }
        // A ball of this radius about the place is in the core, if that is a point, a segment or a box.
        let (named, direction) = probes.named(&at, solid, (part.place, part.half.min()));
        if named.is_some_and(|i| each(i).is_break()) {
            return Probed::Ended;
        }
        let direction = direction.or_else(|| at.direction());
        // Another place tells more only if what is nearest is far enough.
        if is_clear && direction.is_some_and(|(_, distance)| distance > FAR_ENOUGH * cover) {
            bound = bound.max(probes.beyond(part.place, direction));
            if bound > cover {
                continue;
            }
        }
        is_clear &= bound > within;
        let most = if is_clear { MOST_PARTS } else { MOST_TO_TOUCH };
        let clear = (bound - within).max(0.0);
        match part.halves(solid, clear, direction.map_or(Vector3::zeros(), |own| own.0.into())) {
            None => {}
            Some(_) if count + 2 > most => is_clear = false,
            Some(halves) => {
                waiting[left..left + 2].copy_from_slice(&halves);
                (left, count) = (left + 2, count + 2);
            }
        }
    }
    if is_clear { Probed::Clear } else { Probed::Open(Some((grid, centre))) }
}

/// Probes the grid at the centre of a ball, given what it told about that. As [`probe`], which takes longer
/// to set up. The caller has found that the centre alone does not prove a separation.
#[inline(always)]
pub(crate) fn probe_ball<'a>(
    elements: &Elements<'a>,
    solid: &Solid<'_>,
    (proven, at): (bool, Clearance<'a>),
    mut each: impl FnMut(usize) -> ControlFlow<()>,
) -> Probed<'a> {
    let Some(grid) = elements.clear else { return Probed::Open(None) };
    let probes = Probes { elements, grid, within: elements.margin + solid.radius, proven };
    let (named, direction) = probes.named(&at, solid, (solid.centre, 0.0));
    if named.is_some_and(|i| each(i).is_break()) {
        return Probed::Ended;
    }
    let direction = direction.or_else(|| at.direction());
    if probes.beyond(solid.centre, direction) > probes.within {
        return Probed::Clear;
    }
    Probed::Open(Some((grid, at)))
}

/// A part of a core, or a box about it.
#[derive(Debug, Clone, Copy)]
struct Part {
    place: Vector3<f64>,
    half: Vector3<f64>,
}

impl Part {
    /// The halves along the longest axis, less what is in a ball of radius `clear` about the centre. The one
    /// that is nearer to the surface, from which the `direction` points, comes last. `None` for a point.
    #[inline(always)]
    fn halves(&self, solid: &Solid<'_>, clear: f64, direction: Vector3<f64>) -> Option<[Self; 2]> {
        let axis = self.half.imax();
        let [length, a, b] = [0, 1, 2].map(|j| self.half[(axis + j) % 3]);
        if length == 0.0 {
            return None;
        }
        // The ball contains the part up to here along the axis.
        let done = (clear * clear - a * a - b * b).max(0.0).sqrt() * (1.0 - 1e-9);
        let (off, mut half) = (solid.axes[axis] * (0.5 * (length + done)), self.half);
        half[axis] = 0.5 * (length - done) * (1.0 + 1e-9);
        let off = if off.dot(&direction) < 0.0 { -off } else { off };
        Some([off, -off].map(|off| Self { place: self.place + off, half }))
    }
}

/// Probes of a grid about a shape.
struct Probes<'s, 'a> {
    elements: &'s Elements<'a>,
    grid: &'a ClearanceGrid,
    /// The distance from the core up to which the scan is of interest.
    within: f64,
    proven: bool,
}

impl<'a> Probes<'_, 'a> {
    #[inline(always)]
    fn at(&self, place: Vector3<f64>) -> Clearance<'a> {
        self.grid.at(&self.elements.arrays, place.into(), self.within)
    }

    #[inline(always)]
    fn bound(&self, at: &Clearance<'_>) -> f64 {
        if self.proven { at.obstacle } else { at.discs }
    }

    /// Returns the point that is named at a place, if a ball of radius `inner` about the place touches there,
    /// or if what is nearest, by an estimate, is in the shape. Also the direction, if it was needed.
    #[inline(always)]
    fn named(
        &self,
        at: &Clearance<'_>,
        solid: &Solid<'_>,
        (place, inner): (Vector3<f64>, f64),
    ) -> (Option<usize>, Option<Direction>) {
        let most = self.within + inner;
        let touches = at.farthest() <= most;
        let direction = if touches { None } else { at.direction() };
        let may_touch = match direction {
            Some((way, distance)) if distance > most => {
                let nearest = || place - Vector3::from(way) * distance;
                !solid.is_point() && solid.is_box() && solid.distance(&nearest()) <= self.within
            }
            _ => touches || at.discs <= most,
        };
        let point = |(leaf, number)| self.elements.arrays.leaves.points(leaf).start + number;
        (if may_touch { at.nearest().map(point) } else { None }, direction)
    }

    /// The bound about a place by what the grid knows beyond it, in a direction from the nearest point.
    #[inline(always)]
    fn beyond(&self, place: Vector3<f64>, direction: Option<Direction>) -> f64 {
        let length = self.grid.step_beyond(self.within);
        let Some((step, _)) = direction.filter(|_| length > 0.0) else { return f64::NEG_INFINITY };
        let step = Vector3::from(step) * length;
        let reach = self.within + length;
        let other = self.grid.beside(&self.elements.arrays, (place + step).into(), (-step).into(), reach);
        self.bound(&other)
    }
}
