//! Known sides of parts, and the decisions made.

/// Hints on which side of the surface is the outside.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sides<'a> {
    /// Normals of the scan's input, one for each point; zero or NaN where unknown.
    pub normals: Option<&'a [[f32; 3]]>,
    /// Position of the scanner. Normals should point towards it.
    pub scanner: Option<Viewpoint<'a>>,
}

/// Positions from which points were scanned.
#[derive(Debug, Clone, Copy)]
pub enum Viewpoint<'a> {
    /// One position for all points.
    One([f32; 3]),
    /// A position for each point; the point itself where it is unknown.
    Each(&'a [[f32; 3]]),
}

impl Viewpoint<'_> {
    /// Returns the position from which point `i` was scanned.
    pub(crate) fn of(&self, i: usize) -> [f32; 3] {
        match self {
            Self::One(place) => *place,
            Self::Each(places) => places[i],
        }
    }
}

/// The evidence that decided the side of a component.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Decision {
    /// The majority of the normals in the scan's input.
    Normals,
    /// The majority of the points must face the scanner.
    Scanner,
    /// The enclosed volume must be positive.
    Volume,
    /// Convention: the component of largest magnitude of the sum of all normals is positive.
    Convention,
}

/// A set of points that edges connect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrientedPart {
    /// Least index of a point.
    pub first: u32,
    /// Number of points.
    pub points: u32,
    /// `true` if the part has two sides: no cycle of edges between nearly agreeing normals reverses
    /// a normal.
    pub orientable: bool,
    /// The evidence that decided which side is the outside.
    pub decision: Decision,
}
