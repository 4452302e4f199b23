//! A convex shape at a pose in the world.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_geometry::{Aabb, Pose};

use crate::ask::answer::Reason;
use crate::pair::placed_balls::{is_proper, relative_pose};
use crate::solid::core::Solid;
use crate::solid::shape::Shape;

/// More than the relative rounding error of a place in double precision that is moved by a pose.
const ROUNDING: f64 = 1e-14;

/// A convex shape in a frame of its own, and the pose of that frame, as a link of a robot is given.
/// Lengths of the shape follow the scale of the pose.
///
/// Unlike [`Shape::moved`], this works for hulls and shapes of the caller's own, which borrow their
/// places. Takes a few nanoseconds to make or copy.
///
/// ```
/// use nearmiss_geometry::Pose;
/// use nearmiss_query::{PlacedShape, Shape};
///
/// let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
/// let hull = Shape::Hull { points: &corners, radius: 0.1 };
/// let pose = Pose::from_translation([5.0, 0.0, 0.0]).with_scale(2.0);
/// let bounds = PlacedShape::new(hull, &pose).bounds().expect("both are valid");
/// assert!((bounds.min[0] - 4.8).abs() < 1e-12 && (bounds.max[0] - 7.2).abs() < 1e-12);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlacedShape<'a> {
    shape: Shape<'a>,
    /// Maps the frame of the shape to the world.
    pose: Pose,
}

impl<'a> PlacedShape<'a> {
    /// Places `shape` at `pose`, which maps the frame in which the shape is given to the world.
    #[inline]
    #[must_use]
    pub fn new(shape: Shape<'a>, pose: &Pose) -> Self {
        Self { shape, pose: *pose }
    }

    /// The shape, in its own frame.
    #[must_use]
    pub fn shape(&self) -> &Shape<'a> {
        &self.shape
    }

    /// The pose of the shape.
    #[must_use]
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// Returns a bounding box of the shape in the world, rounding included. `None` if the shape or the
    /// pose is invalid.
    #[must_use]
    pub fn bounds(&self) -> Option<Aabb> {
        if !is_proper(&self.pose) {
            return None;
        }
        let (low, high, radius) = if let Some(moved) = self.shape.moved(&self.pose) {
            let Aabb { min, max } = moved.bounds()?;
            (Vector3::from(min), Vector3::from(max), 0.0)
        } else {
            // The box about a hull, or a shape of the caller's own, has the axes of the frame.
            let frame = self.pose.inverse();
            let Solid { centre, half, radius, .. } = Solid::new(&self.shape, &frame)?;
            (centre - half, centre + half, radius)
        };
        // The centre is that of the shape's own frame, moved by the translation.
        let far = Vector3::from(self.pose.translation()).norm() + low.norm() + high.norm() + radius;
        let more = radius + ROUNDING * far;
        let (min, max) = (low.add_scalar(-more), high.add_scalar(more));
        let is_finite = min.iter().chain(&max).all(|x| x.is_finite());
        is_finite.then(|| Aabb { min: min.into(), max: max.into() })
    }

    /// The pose, in the frame of the shape, of another frame whose pose in the world is `frame`. In this
    /// pose the other frame moves past the shape instead. `None` if a pose is invalid, or if the scales
    /// differ too much.
    pub(crate) fn frame_of(&self, frame: &Pose) -> Option<Pose> {
        relative_pose([&self.pose, frame])
    }

    /// The reason why questions about the shape in another frame have no answer; `None` if they have one.
    pub(crate) fn refused_in(&self, frame: &Pose) -> Option<Reason> {
        let Some(frame) = self.frame_of(frame) else { return Some(Reason::Pose) };
        Solid::new(&self.shape, &frame).is_none().then_some(Reason::Shape)
    }
}
