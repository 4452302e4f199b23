//! What is known about the sides of parts, and what was decided.

/// Which side is out, where something says so.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sides<'a> {
    /// Normals that the scan came with, one a point; zero or NaN where it had none.
    pub normals: Option<&'a [[f32; 3]]>,
    /// Where the scanner stood: normals point there.
    pub scanner: Option<Viewpoint<'a>>,
}

/// Where points were seen from.
#[derive(Debug, Clone, Copy)]
pub enum Viewpoint<'a> {
    /// All from one place.
    One([f32; 3]),
    /// Each from a place of its own; from itself where that is not known.
    Each(&'a [[f32; 3]]),
}

impl Viewpoint<'_> {
    /// Where point `i` was seen from.
    pub(crate) fn of(&self, i: usize) -> [f32; 3] {
        match self {
            Self::One(place) => *place,
            Self::Each(places) => places[i],
        }
    }
}

/// What decided the side of a component.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Decision {
    /// The greater part of the scan's own normals.
    Normals,
    /// The greater part faces the scanner.
    Scanner,
    /// The volume it encloses is positive.
    Volume,
    /// Nothing: the sum of the normals has a positive component of largest magnitude.
    Convention,
}

/// Points that edges connect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrientedPart {
    /// The least index of a point.
    pub first: u32,
    /// Number of points.
    pub points: u32,
    /// Whether it has two sides: no ring of edges between normals that nearly agree turns a normal round.
    pub orientable: bool,
    /// What decided which is out.
    pub decision: Decision,
}
