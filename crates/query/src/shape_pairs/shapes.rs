//! Two placed convex shapes.

use nearmiss_geometry::Pose;
use nearmiss_geometry::nalgebra::Vector3;

use crate::ask::answer::{Evidence, Statistics};
use crate::penetration::answer::Penetration;
use crate::penetration::search::Bounds;
use crate::solid::between::{ShapeGap, gap};
use crate::solid::core::Solid;
use crate::solid::overlap::overlap;
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
        let ShapeGap { lower, upper, points: [on_a, on_b] } = self.ask(gap)?;
        let pose = self.shapes[0].pose();
        let (scale, points) = (pose.scale(), [pose.apply(on_a), pose.apply(on_b)]);
        Some(ShapeGap { lower: lower * scale, upper: upper * scale, points })
    }

    /// Bounds the penetration of the shapes: how far b must at least be shifted to be separate from a.
    ///
    /// The bounds agree to a few percent: exactly if only the roundings overlap, and to a millionth of the
    /// size for boxes and hulls. Needs no budget.
    ///
    /// Grows a polytope inside the set of all differences of points of both cores (van den Bergen 2001).
    /// Costs up to 50 µs. Does not allocate.
    ///
    /// ```
    /// use nearmiss_geometry::Pose;
    /// use nearmiss_query::{AsShape, Shape, ShapePair};
    ///
    /// let rod = Shape::Capsule { ends: [[0.0; 3], [1.0, 0.0, 0.0]], radius: 0.1 };
    /// let at = |z: f64| rod.at(&Pose::from_translation([0.0, 0.0, z]));
    /// let found = ShapePair::new(at(0.0), at(0.15)).penetration();
    /// assert!((found.lower - 0.05).abs() < 1e-8 && (found.upper - 0.05).abs() < 1e-8);
    /// assert!(found.direction[2] > 0.999);
    /// ```
    #[must_use]
    pub fn penetration(&self) -> Penetration {
        let found = self.ask(|own, other| {
            let mut bounds = Bounds { lower: 0.0, shift: Vector3::zeros(), complete: true };
            if gap(own, other).lower <= 0.0 {
                let found = overlap(own, other);
                (bounds.lower, bounds.shift) = (found.lower.max(0.0), found.way * found.upper.max(0.0));
            }
            bounds
        });
        let Some(bounds) = found else { return Penetration::UNKNOWN };
        let pose = self.shapes[0].pose();
        let turned = |way: Vector3<f64>| pose.rotate(way.into());
        Penetration::new(&bounds, (pose.scale(), turned), (Evidence::Certified, 0.0), Statistics::default())
    }

    /// Calls `ask` with both shapes in the frame of the first; `None` if a shape or a pose is invalid.
    fn ask<R>(&self, ask: impl FnOnce(&Solid<'_>, &Solid<'_>) -> R) -> Option<R> {
        let [a, b] = &self.shapes;
        let frame = b.frame_of(a.pose())?;
        Some(ask(&Solid::new(a.shape(), &Pose::IDENTITY)?, &Solid::new(b.shape(), &frame)?))
    }
}
