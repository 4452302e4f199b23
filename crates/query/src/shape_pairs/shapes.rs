//! Two placed convex shapes.

use nearmiss_geometry::Pose;

use crate::solid::between::{ShapeGap, gap};
use crate::solid::core::Solid;
use crate::solid::placed::PlacedShape;

/// Two placed convex shapes, such as two links of a robot.
///
/// ```
/// use nearmiss_geometry::Pose;
/// use nearmiss_query::{AsShape, Shape, ShapePair};
///
/// let rod = Shape::Capsule { ends: [[0.0; 3], [1.0, 0.0, 0.0]], radius: 0.1 };
/// let at = |z: f64| rod.at(&Pose::from_translation([0.0, 0.0, z]));
/// let gap = ShapePair::new(at(0.0), at(0.5)).distance().expect("both are valid");
/// assert!((gap.lower - 0.3).abs() < 1e-8 && (gap.upper - 0.3).abs() < 1e-8);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapePair<'a> {
    shapes: [PlacedShape<'a>; 2],
}

impl<'a> ShapePair<'a> {
    /// A pair of shapes.
    #[inline]
    #[must_use]
    pub fn new(a: PlacedShape<'a>, b: PlacedShape<'a>) -> Self {
        Self { shapes: [a, b] }
    }

    /// Both shapes.
    #[must_use]
    pub fn shapes(&self) -> &[PlacedShape<'a>; 2] {
        &self.shapes
    }

    /// Bounds the distance of the shapes as [`Shape::gap_to`](crate::Shape::gap_to) does, in world units
    /// and world coordinates. `None` if a shape or a pose is invalid.
    ///
    /// Costs about a microsecond. Does not allocate.
    #[must_use]
    pub fn distance(&self) -> Option<ShapeGap> {
        let [a, b] = &self.shapes;
        let frame = b.frame_of(a.pose())?;
        let (own, other) = (Solid::new(a.shape(), &Pose::IDENTITY)?, Solid::new(b.shape(), &frame)?);
        let ShapeGap { lower, upper, points: [on_a, on_b] } = gap(&own, &other);
        let (pose, scale) = (a.pose(), a.pose().scale());
        let points = [pose.apply(on_a), pose.apply(on_b)];
        Some(ShapeGap { lower: lower * scale, upper: upper * scale, points })
    }
}
