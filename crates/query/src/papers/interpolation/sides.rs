//! Sides of places, and what is remembered of them.

/// Orientation less certain than this, of 255, says nothing about sides.
pub(super) const CERTAIN: u8 = 64;

/// On which side of b a place is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Side {
    /// How far from the surface, in the world: positive outside, negative inside.
    pub(crate) distance: f64,
    /// The nearest point of b.
    pub(crate) near: u32,
    /// How far away that is.
    pub(crate) away: f64,
    /// Whether the sign means something: normals are oriented there, and sure of it.
    pub(crate) is_known: bool,
}

impl Side {
    /// The signed distance, if the sign means something.
    pub(crate) fn known(&self) -> Option<f64> {
        self.is_known.then_some(self.distance)
    }

    pub(crate) fn is_opposite(&self, other: &Self) -> bool {
        self.is_known && other.is_known && (self.distance < 0.0) != (other.distance < 0.0)
    }
}

/// So many sides of points are remembered.
const REMEMBERED: usize = 1024;

/// Sides of points of a that were looked up last.
#[derive(Debug, Clone)]
pub(crate) struct Cache(Vec<Option<(u32, Side)>>);

impl Default for Cache {
    fn default() -> Self {
        Self(vec![None; REMEMBERED])
    }
}

impl Cache {
    /// Where the side of a point is remembered, with the point that it is of.
    pub(crate) fn slot(&mut self, i: u32) -> &mut Option<(u32, Side)> {
        &mut self.0[i as usize % REMEMBERED]
    }

    pub(crate) fn clear(&mut self) {
        self.0.fill(None);
    }
}
