//! Two placed convex shapes.

use nearmiss_geometry::Pose;
use nearmiss_geometry::nalgebra::Vector3;

use crate::ask::answer::{Evidence, Statistics};
use crate::penetration::answer::Penetration;
use crate::penetration::search::Bounds;
use crate::solid::between::{ShapeGap, gap};
use crate::solid::core::Solid;
use crate::solid::overlap::{Overlap, overlap};
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
    /// The bounds agree to about 1e-8 of the size if only the roundings overlap, to 1e-5 for boxes, and to a
    /// few percent for most round cores. Needs no budget.
    ///
    /// Grows a polytope inside the set of all differences of points of both cores (van den Bergen 2001).
    /// Takes up to 64 points of it, so some tens of microseconds for hulls of a few points. Does not
    /// allocate.
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
                (bounds.lower, bounds.shift) = (found.lower.max(0.0), beyond([own, other], &found));
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

/// A shift of the second of two shapes that is a little longer than their overlap, and separates them.
fn beyond([a, b]: [&Solid<'_>; 2], found: &Overlap) -> Vector3<f64> {
    /// Doublings of what is added.
    const ROUNDS: u32 = 32;
    let size = a.half.amax() + b.half.amax() + a.radius + b.radius;
    let far = a.centre.amax() + b.centre.amax();
    let mut more = 1e-15 * (size + far);
    let mut length = found.upper.max(0.0);
    for _ in 0..ROUNDS {
        if gap(a, &b.shifted(&(found.way * length))).lower > 0.0 {
            break;
        }
        length = found.upper.max(0.0) + more;
        more *= 2.0;
    }
    found.way * length
}
