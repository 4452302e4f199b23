//! A single curve: a range of points and the reasons for its ends.

/// The reason why a curve ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum CurveEnd {
    /// The surface of a ends.
    BorderOfA,
    /// The surface of b ends.
    BorderOfB,
    /// The surfaces are tangent: their normals are parallel to within half a degree, or become
    /// parallel faster than the curve can be followed. Other curves may end there too.
    Tangent,
    /// A surface does not look like a single sheet, or turns too sharply.
    Lost,
    /// The budget was spent.
    Budget,
}

/// A curve of [`crate::Curves`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Curve {
    /// The index of the first point.
    pub first: usize,
    /// The number of points. It is 1 if the surfaces are tangent and no curve leads away.
    pub count: usize,
    /// The reasons for the ends at the first and the last point; `None` if the last point is joined
    /// to the first.
    pub ends: Option<[CurveEnd; 2]>,
}

impl Curve {
    /// Returns `true` if the curve is closed.
    #[must_use]
    pub const fn is_closed(&self) -> bool {
        self.ends.is_none()
    }

    /// Returns the pairs of points that are joined.
    pub fn edges(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        let Self { first, count, .. } = *self;
        let joined = if self.is_closed() { count } else { count.saturating_sub(1) };
        (0..joined).map(move |i| [first + i, first + (i + 1) % count])
    }
}
