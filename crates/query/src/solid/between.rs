//! The distance of two convex shapes, such as two links of a robot.

use nearmiss_geometry::Pose;
use nearmiss_geometry::nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::solid::closest::{Closest, closest};
use crate::solid::core::Solid;
use crate::solid::shape::Shape;

/// Bounds on the distance of two shapes, in world units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ShapeGap {
    /// A lower bound; 0 if they may touch.
    pub lower: f64,
    /// An upper bound: the distance of `points`. 0 if they touch.
    pub upper: f64,
    /// The nearest points, of the first and of the second shape. If they touch, points that both have
    /// in common, up to the radii.
    pub points: [[f64; 3]; 2],
}

impl Shape<'_> {
    /// Bounds the distance of two shapes: lower ≤ distance ≤ upper. They agree to about 1e-9 of the
    /// distance of their cores. `None` if a shape is invalid.
    ///
    /// By the algorithm of Gilbert, Johnson & Keerthi (1988) for the cores, less both radii. Costs about
    /// a microsecond. Does not allocate.
    ///
    /// ```
    /// use nearmiss_query::Shape;
    ///
    /// let ball = Shape::Sphere { centre: [0.0, 0.0, 1.0], radius: 0.5 };
    /// let rod = Shape::Capsule { ends: [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]], radius: 0.1 };
    /// let gap = ball.gap_to(&rod).expect("both are valid");
    /// assert!(gap.lower <= 0.4 + 1e-9 && gap.upper >= 0.4 - 1e-9 && gap.upper - gap.lower < 1e-8);
    /// ```
    #[must_use]
    pub fn gap_to(&self, other: &Shape<'_>) -> Option<ShapeGap> {
        let [a, b] = [Solid::new(self, &Pose::IDENTITY)?, Solid::new(other, &Pose::IDENTITY)?];
        Some(gap(&a, &b))
    }
}

/// Bounds the distance of two shapes in one frame.
pub(crate) fn gap(a: &Solid<'_>, b: &Solid<'_>) -> ShapeGap {
    // Relative to the first, so that rounding is relative to the distance.
    let origin = a.centre;
    let support = |d: &Vector3<f64>| [a.support(d) - origin, b.support(&-d) - origin];
    let Closest { points, distance, lower } = closest(support, a.inside - b.inside, [0.0, f64::INFINITY]);
    let radii = a.radius + b.radius;
    let way = points[1] - points[0];
    let along = way.try_normalize(0.0).unwrap_or_else(Vector3::zeros);
    // Neither beyond the other.
    let share = if radii > distance && radii > 0.0 { distance / radii } else { 1.0 };
    let on_a = points[0] + along * (a.radius * share) + origin;
    let on_b = points[1] - along * (b.radius * share) + origin;
    ShapeGap {
        lower: (lower - radii).max(0.0),
        upper: (distance - radii).max(0.0),
        points: [on_a.into(), on_b.into()],
    }
}
