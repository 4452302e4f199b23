//! Sides of b, and a cache of them.

/// The least confidence of a normal's orientation, from 0 to 255, with which sides are known.
pub(super) const CERTAIN: u8 = 64;

/// The side of b on which a point is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Side {
    /// The signed distance from the surface, in the world: positive outside, negative inside.
    pub(crate) distance: f64,
    /// The nearest point of b.
    pub(crate) near: u32,
    /// The distance from that point.
    pub(crate) away: f64,
    /// `true` if the sign is meaningful: the normals there are oriented with sufficient confidence.
    pub(crate) is_known: bool,
}

impl Side {
    /// The signed distance, if the sign is meaningful.
    pub(crate) fn known(&self) -> Option<f64> {
        self.is_known.then_some(self.distance)
    }

    pub(crate) fn is_opposite(&self, other: &Self) -> bool {
        self.is_known && other.is_known && (self.distance < 0.0) != (other.distance < 0.0)
    }
}

/// The number of cached sides.
const REMEMBERED: usize = 1024;

/// A cache of the sides of points of a.
#[derive(Debug, Clone)]
pub(crate) struct Cache(Vec<Option<(u32, Side)>>);

impl Default for Cache {
    fn default() -> Self {
        Self(vec![None; REMEMBERED])
    }
}

impl Cache {
    /// The cache slot for point `i`, with the point whose side it holds.
    pub(crate) fn slot(&mut self, i: u32) -> &mut Option<(u32, Side)> {
        &mut self.0[i as usize % REMEMBERED]
    }

    pub(crate) fn clear(&mut self) {
        self.0.fill(None);
    }
}
