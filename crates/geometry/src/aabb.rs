//! Axis-aligned bounding box, closed, in double precision.

use serde::{Deserialize, Serialize};

/// An axis-aligned box: all x with `min[k] <= x[k] <= max[k]`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Aabb {
    /// Least coordinates.
    pub min: [f64; 3],
    /// Greatest coordinates.
    pub max: [f64; 3],
}

impl Aabb {
    /// The box of no point; growing it by any point gives that point.
    pub const EMPTY: Self = Self { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] };

    /// The least box that contains all `points`; [`Aabb::EMPTY`] when there are none.
    #[must_use]
    pub fn of(points: impl IntoIterator<Item = [f64; 3]>) -> Self {
        let mut bounds = Self::EMPTY;
        for p in points {
            bounds.grow(p);
        }
        bounds
    }

    /// Makes the box contain `p`.
    pub fn grow(&mut self, p: [f64; 3]) {
        for (k, &x) in p.iter().enumerate() {
            self.min[k] = self.min[k].min(x);
            self.max[k] = self.max[k].max(x);
        }
    }

    /// Whether `p` lies in the box or on its border.
    #[must_use]
    pub fn contains(&self, p: [f64; 3]) -> bool {
        (0..3).all(|k| self.min[k] <= p[k] && p[k] <= self.max[k])
    }

    /// The middle of the box.
    #[must_use]
    pub fn centre(&self) -> [f64; 3] {
        [0, 1, 2].map(|k| 0.5 * self.min[k] + 0.5 * self.max[k])
    }

    /// Half the edge lengths.
    #[must_use]
    pub fn half_extents(&self) -> [f64; 3] {
        [0, 1, 2].map(|k| 0.5 * self.max[k] - 0.5 * self.min[k])
    }

    /// The eight corners.
    #[must_use]
    pub fn corners(&self) -> [[f64; 3]; 8] {
        std::array::from_fn(|i| [0, 1, 2].map(|k| if i >> k & 1 == 0 { self.min[k] } else { self.max[k] }))
    }
}
