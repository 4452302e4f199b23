//! The questions that a search for a penetration asks.

use std::ops::ControlFlow;

use nearmiss_geometry::nalgebra::Vector3;

use crate::penetration::survey::ContactSurvey;

pub(crate) type Vector = Vector3<f64>;

/// The search ends once the bounds for a scan differ by this, in sampling radii. Discs reach beyond edges, so
/// the upper bound may exceed the exact penetration by more.
pub(crate) const SLACK: f64 = 0.4;

/// Where a place that two things have in common is in each of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Where {
    /// Inside both.
    Inside,
    /// On the surface of a, inside b.
    OnA,
    /// Inside a, on the surface of b.
    OnB,
}

impl Where {
    /// The places that two things may have in common, given which of them are solid. A solid may be too thin
    /// for a place inside to be hit, so its surface counts as well. None for two surfaces.
    pub(crate) fn of(are_solid: [bool; 2]) -> &'static [Self] {
        match are_solid {
            [true, true] => &[Self::Inside, Self::OnA, Self::OnB],
            [false, true] => &[Self::OnA],
            [true, false] => &[Self::OnB],
            [false, false] => &[],
        }
    }

    /// The same of a scan or a mesh, which may be solid, and a shape. A place outside of the shape is moved
    /// to its core, so its surface need not count.
    pub(crate) fn of_shape(is_solid: bool) -> &'static [Self] {
        if is_solid { &[Self::Inside, Self::OnA] } else { &[Self::OnA] }
    }

    /// Returns for each thing whether the place is inside it.
    pub(crate) fn is_inside(self) -> [bool; 2] {
        [self != Self::OnA, self != Self::OnB]
    }
}

/// A place that is common to both things.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Deep {
    pub(crate) place: Vector,
    /// Where it is in both.
    pub(crate) at: Where,
    /// A further shift by less than this leaves the things in contact.
    pub(crate) depth: f64,
    /// The part of `depth` that is the depth in a.
    pub(crate) in_a: f64,
    /// The direction in which `depth` grows, of any length.
    pub(crate) uphill: Vector,
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

    /// The places that [`Probe::deep_at`] measures.
    fn places(&self) -> &'static [Where];

    /// Measures how deep a place is in both things after a shift; `None` if it is outside one of them. The
    /// place may be replaced by one nearby, and is moved to the surface that it is to be on.
    fn deep_at(&mut self, place: Vector, t: Vector, at: Where) -> ControlFlow<(), Option<Deep>>;

    /// Measures how deep a place is in both things after a shift, at the first of [`Self::places`] where it
    /// is.
    fn deep(&mut self, place: Vector, t: Vector) -> ControlFlow<(), Option<Deep>> {
        for &at in self.places() {
            let found = self.deep_at(place, t, at)?;
            if found.is_some() {
                return ControlFlow::Continue(found);
            }
        }
        ControlFlow::Continue(None)
    }

    /// Returns a length such that b meets the surface of a after every shorter shift, as parts of b are on
    /// both sides of it; 0 if none is known. `way` is the direction of a shift that separates the things.
    fn across(&mut self, way: Vector, contacts: &ContactSurvey) -> ControlFlow<(), f64> {
        let _ = (way, contacts);
        ControlFlow::Continue(0.0)
    }

    /// The centres of both things.
    fn centres(&self) -> [Vector; 2];

    /// The axes of boxes about both things.
    fn axes(&self) -> [[Vector; 3]; 2];

    /// A length by which the bounds may differ.
    fn slack(&self) -> f64;

    /// A bound of the rounding error of lengths.
    fn rounding(&self) -> f64;
}
