//! Axis-aligned bounding boxes in double precision.

use serde::{Deserialize, Serialize};

/// An axis-aligned bounding box, closed: all x with `min[k] <= x[k] <= max[k]`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Aabb {
    /// Least coordinates.
    pub min: [f64; 3],
    /// Greatest coordinates.
    pub max: [f64; 3],
}

impl Aabb {
    /// The empty box. Grown by a point, it contains that point alone.
    pub const EMPTY: Self = Self { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] };

    /// Returns the smallest box that contains all `points`; [`Aabb::EMPTY`] if there are no points.
    #[must_use]
    pub fn of(points: impl IntoIterator<Item = [f64; 3]>) -> Self {
        let mut bounds = Self::EMPTY;
        for p in points {
            bounds.grow(p);
        }
        bounds
    }

    /// Grows the box until it contains `p`.
    #[inline]
    pub fn grow(&mut self, p: [f64; 3]) {
        for (k, &x) in p.iter().enumerate() {
            self.min[k] = self.min[k].min(x);
            self.max[k] = self.max[k].max(x);
        }
    }

    /// Returns `true` if `p` is in the box or on its border.
    #[must_use]
    pub fn contains(&self, p: [f64; 3]) -> bool {
        (0..3).all(|k| self.min[k] <= p[k] && p[k] <= self.max[k])
    }

    /// Returns `true` if the boxes have a point in common.
    #[must_use]
    pub fn meets(&self, other: &Self) -> bool {
        (0..3).all(|k| self.min[k] <= other.max[k] && other.min[k] <= self.max[k])
    }

    /// Returns `true` if no part of `other` is outside the box.
    #[must_use]
    pub fn encloses(&self, other: &Self) -> bool {
        (0..3).all(|k| self.min[k] <= other.min[k] && other.max[k] <= self.max[k])
    }

    /// Returns the box that extends further by `length` to every side.
    #[must_use]
    pub fn grown(&self, length: f64) -> Self {
        Self { min: self.min.map(|x| x - length), max: self.max.map(|x| x + length) }
    }

    /// Returns the centre of the box.
    #[must_use]
    pub fn centre(&self) -> [f64; 3] {
        [0, 1, 2].map(|k| 0.5 * self.min[k] + 0.5 * self.max[k])
    }

    /// Returns half the edge lengths.
    #[must_use]
    pub fn half_extents(&self) -> [f64; 3] {
        [0, 1, 2].map(|k| 0.5 * self.max[k] - 0.5 * self.min[k])
    }

    /// Returns the eight corners.
    #[must_use]
    pub fn corners(&self) -> [[f64; 3]; 8] {
        std::array::from_fn(|i| [0, 1, 2].map(|k| if i >> k & 1 == 0 { self.min[k] } else { self.max[k] }))
    }
}
