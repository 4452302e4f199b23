//! One curve: a stretch of points, and how it ends.

/// Why a curve ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum CurveEnd {
    /// The surface of a ends there.
    BorderOfA,
    /// The surface of b ends there.
    BorderOfB,
    /// The surfaces touch: their normals are parallel to within half a degree, or come to be so faster than
    /// the curve can be followed. Other curves may end there too.
    Tangent,
    /// A surface does not look like one sheet there, or turns too sharply.
    Lost,
    /// The budget was spent.
    Budget,
}

/// One of [`crate::Curves`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Curve {
    /// Its first point.
    pub first: usize,
    /// How many points it has: one alone where the surfaces touch and no curve leads away.
    pub count: usize,
    /// Why it ends where it begins and where it ends; none if the last point is joined to the first.
    pub ends: Option<[CurveEnd; 2]>,
}

impl Curve {
    /// Whether it is a loop.
    #[must_use]
    pub const fn is_closed(&self) -> bool {
        self.ends.is_none()
    }

    /// The pairs of points that are joined.
    pub fn edges(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        let Self { first, count, .. } = *self;
        let joined = if self.is_closed() { count } else { count.saturating_sub(1) };
        (0..joined).map(move |i| [first + i, first + (i + 1) % count])
    }
}
