//! Conversions between the types of parry and those of nearmiss.

use std::fmt;

use parry3d::bounding_volume::Aabb;
use parry3d::math::{Pose as ParryPose, Real, Rot3, Vector};
use parry3d::shape::{HalfSpace, Shape as ParryShape, TypedShape};

use nearmiss::{Pose, Shape, SupportMap};

/// A pose of parry in double precision.
#[must_use]
pub fn from_pose(pose: &ParryPose) -> Pose {
    let [x, y, z, w] = pose.rotation.to_array().map(f64::from);
    Pose::new(from_vector(pose.translation), [x, y, z, w])
}

/// A pose in single precision, without its scale.
#[must_use]
pub fn to_pose(pose: &Pose) -> ParryPose {
    let columns = [0, 1, 2].map(|k| pose.rotate([0, 1, 2].map(|j| f64::from(u8::from(j == k)))));
    let [x, y, z] = columns.map(to_vector);
    let rotation = Rot3::from_mat3(&parry3d::math::Mat3::from_cols(x, y, z));
    ParryPose::from_parts(to_vector(pose.translation()), rotation)
}

pub(crate) fn from_vector(v: Vector) -> [f64; 3] {
    v.to_array().map(f64::from)
}

pub(crate) fn to_vector(v: [f64; 3]) -> Vector {
    Vector::from_array(v.map(to_real))
}

/// The nearest number in single precision.
#[expect(clippy::cast_possible_truncation, reason = "parry's numbers are in single precision")]
pub(crate) fn to_real(x: f64) -> Real {
    x as Real
}

/// Calls `ask` with a convex shape in the frame into which `pose` maps it. Returns `None` if the shape
/// is not convex. A half-space becomes a box that covers it within `bounds`.
pub(crate) fn with_convex<R>(
    shape: &dyn ParryShape,
    pose: &ParryPose,
    bounds: &Aabb,
    ask: impl FnOnce(&Shape<'_>) -> R,
) -> Option<R> {
    let at = |p: Vector| from_vector(pose * p);
    let mut own = None;
    let converted = match shape.as_typed_shape() {
        TypedShape::Ball(ball) => {
            Shape::Sphere { centre: from_vector(pose.translation), radius: f64::from(ball.radius) }
        }
        TypedShape::Capsule(capsule) => Shape::Capsule {
            ends: [at(capsule.segment.a), at(capsule.segment.b)],
            radius: f64::from(capsule.radius),
        },
        TypedShape::Segment(it) => Shape::Capsule { ends: [at(it.a), at(it.b)], radius: 0.0 },
        TypedShape::Triangle(it) => Shape::Triangle { points: [at(it.a), at(it.b), at(it.c)], radius: 0.0 },
        TypedShape::RoundTriangle(it) => Shape::Triangle {
            points: [it.inner_shape.a, it.inner_shape.b, it.inner_shape.c].map(at),
            radius: f64::from(it.border_radius),
        },
        TypedShape::Cuboid(it) => {
            Shape::Box { pose: from_pose(pose), half: from_vector(it.half_extents), radius: 0.0 }
        }
        TypedShape::RoundCuboid(it) => Shape::Box {
            pose: from_pose(pose),
            half: from_vector(it.inner_shape.half_extents),
            radius: f64::from(it.border_radius),
        },
        TypedShape::Cylinder(it) => cylinder(pose, it.half_height, it.radius, 0.0),
        TypedShape::RoundCylinder(it) => {
            cylinder(pose, it.inner_shape.half_height, it.inner_shape.radius, it.border_radius)
        }
        TypedShape::Cone(it) => cone(pose, it.half_height, it.radius, 0.0),
        TypedShape::RoundCone(it) => {
            cone(pose, it.inner_shape.half_height, it.inner_shape.radius, it.border_radius)
        }
        TypedShape::HalfSpace(it) => below(it, pose, bounds),
        TypedShape::RoundConvexPolyhedron(it) => Shape::Own {
            map: own.insert(Placed::new(&it.inner_shape, pose)?),
            radius: f64::from(it.border_radius),
        },
        _ => Shape::Own { map: own.insert(Placed::new(shape, pose)?), radius: 0.0 },
    };
    Some(ask(&converted))
}

fn cylinder(pose: &ParryPose, half_height: Real, radius: Real, rounding: Real) -> Shape<'static> {
    let [half_height, radius, rounding] = [half_height, radius, rounding].map(f64::from);
    Shape::Cylinder { pose: from_pose(pose), half_height, radius, rounding }
}

fn cone(pose: &ParryPose, half_height: Real, radius: Real, rounding: Real) -> Shape<'static> {
    let [half_height, radius, rounding] = [half_height, radius, rounding].map(f64::from);
    Shape::Cone { pose: from_pose(pose), half_height, radius, rounding }
}

/// The part of a half-space within `bounds`, as a box below its plane.
fn below(space: &HalfSpace, pose: &ParryPose, bounds: &Aabb) -> Shape<'static> {
    let normal = pose.rotation * space.normal;
    let centre = bounds.center();
    let above = (centre - pose.translation).dot(normal);
    // Reaches past the bounds, whatever its rotation about the normal.
    let half = 2.0 * (bounds.half_extents().length() + above.abs());
    let on_plane = centre - normal * above;
    let turn = Rot3::from_rotation_arc(Vector::Y, normal);
    let placed = ParryPose::from_parts(on_plane - normal * half, turn);
    Shape::Box { pose: from_pose(&placed), half: [f64::from(half); 3], radius: 0.0 }
}

/// A convex shape of parry in another frame, known by its support map.
struct Placed<'a> {
    shape: &'a dyn ParryShape,
    pose: &'a ParryPose,
    centre: [f64; 3],
}

impl<'a> Placed<'a> {
    /// `None` if the shape has no support map.
    fn new(shape: &'a dyn ParryShape, pose: &'a ParryPose) -> Option<Self> {
        let map = shape.as_support_map()?;
        // The mean of points of a convex shape is inside it.
        let centre = match shape.as_convex_polyhedron() {
            Some(hull) => mean(hull.points().iter().copied()),
            None => {
                let axes = [Vector::X, Vector::Y, Vector::Z].into_iter().flat_map(|axis| [axis, -axis]);
                mean(axes.map(|axis| map.local_support_point(axis)))
            }
        };
        Some(Self { shape, pose, centre: from_vector(pose * centre) })
    }
}

fn mean(points: impl Iterator<Item = Vector>) -> Vector {
    let (sum, count) = points.fold((Vector::ZERO, 0.0_f32), |(sum, n), point| (sum + point, n + 1.0));
    sum / count.max(1.0)
}

impl fmt::Debug for Placed<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Placed").field("shape", &self.shape.shape_type()).finish_non_exhaustive()
    }
}

impl SupportMap for Placed<'_> {
    fn support(&self, direction: [f64; 3]) -> [f64; 3] {
        let longest = direction.iter().fold(0.0_f64, |longest, c| longest.max(c.abs()));
        let toward = to_vector(direction.map(|c| c / longest)).normalize();
        match self.shape.as_support_map() {
            Some(map) => from_vector(map.support_point(self.pose, toward)),
            None => self.centre,
        }
    }

    fn centre(&self) -> [f64; 3] {
        self.centre
    }
}
