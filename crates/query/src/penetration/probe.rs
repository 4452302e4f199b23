//! The questions that a search for a penetration asks.

use std::ops::ControlFlow;

use nearmiss_geometry::nalgebra::Vector3;

use crate::penetration::survey::ContactSurvey;

pub(crate) type Vector = Vector3<f64>;

/// Distances from scans are bounded to this, in sampling radii: half the thickness of the volume that
/// contains the surface, and more.
pub(crate) const SLACK: f64 = 0.4;

/// A place that is common to both things.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Deep {
    pub(crate) place: Vector,
    /// A further shift by less than this leaves the things in contact.
    pub(crate) depth: f64,
    /// The part of `depth` that is the depth in a.
    pub(crate) in_a: f64,
    /// The direction in which `depth` grows, of any length.
    pub(crate) uphill: Vector,
}

/// Measures how deep a place is in both things by `deep`, which is told which of them count as solids; those
/// of the others that count are points of their surfaces. A solid may be too thin for a place inside to be
/// hit, so its surface counts as well. `None` for two surfaces.
pub(crate) fn deep_in_solids(
    are_solid: [bool; 2],
    mut deep: impl FnMut([bool; 2]) -> Option<Deep>,
) -> Option<Deep> {
    match are_solid {
        [false, false] => None,
        [true, true] => deep([true; 2]).or_else(|| deep([true, false])).or_else(|| deep([false, true])),
        one => deep(one),
    }
}

/// Two things a and b, and tests of them with b shifted. Each test breaks if the budget ended it.
pub(crate) trait Probe {
    /// Returns `true` if the things are apart after a shift.
    fn is_apart(&mut self, t: Vector) -> ControlFlow<(), bool>;

    /// Returns a place where the things meet after a shift, and the direction in which they are separated
    /// soonest there; `None` if they are not seen to meet.
    fn touch(&mut self, t: Vector) -> ControlFlow<(), Option<(Vector, Vector)>>;

    /// Finds all contacts without a shift.
    fn survey(&mut self, survey: &mut ContactSurvey) -> ControlFlow<()>;

    /// Measures how deep a place is in both things after a shift; `None` if it is outside one of them. The
    /// place may be replaced by one nearby.
    fn deep(&mut self, place: Vector, t: Vector) -> ControlFlow<(), Option<Deep>>;

    /// The centres of both things.
    fn centres(&self) -> [Vector; 2];

    /// The axes of boxes about both things.
    fn axes(&self) -> [[Vector; 3]; 2];

    /// A length by which bounds are known to differ.
    fn slack(&self) -> f64;

    /// A bound of the rounding error of lengths.
    fn rounding(&self) -> f64;
}
