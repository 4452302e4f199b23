//! Convex shapes.

use nearmiss::Shape as Convex;

use crate::pointer::slice;
use crate::pose::{Pose, nearmiss_pose_identity};
use crate::status::Failure;

/// The kind of a shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub enum ShapeKind {
    /// A ball about `corners[0]`.
    Sphere = 0,
    /// All points within `radius` of the segment from `corners[0]` to `corners[1]`.
    Capsule = 1,
    /// A box about the origin of `pose` with half sides `half`.
    Box = 2,
    /// A cylinder about the axis y of `pose`, of half height `half[1]`.
    Cylinder = 3,
    /// A cone about the axis y of `pose`, of half height `half[1]`, with its tip upwards.
    Cone = 4,
    /// The triangle `corners`.
    Triangle = 5,
    /// The convex hull of `points`.
    Hull = 6,
}

/// A convex shape in the world. Make it with `nearmiss_sphere` and the like.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Shape {
    /// A `NearmissShapeKind`.
    pub kind: i32,
    /// The pose of a box, a cylinder or a cone.
    pub pose: Pose,
    /// Half sides or the half height.
    pub half: [f64; 3],
    /// The radius of a sphere, a capsule, a cylinder or a cone.
    pub radius: f64,
    /// The length by which a box, cylinder, cone, triangle or hull is grown in all directions.
    pub rounding: f64,
    /// The centre, ends or corners.
    pub corners: [[f64; 3]; 3],
    /// The points of a hull, three numbers each, which stay valid as long as the shape is used.
    pub points: *const f64,
    /// The number of points of a hull.
    pub point_count: usize,
}

fn none(kind: ShapeKind) -> Shape {
    Shape {
        kind: kind as i32,
        pose: nearmiss_pose_identity(),
        half: [0.0; 3],
        radius: 0.0,
        rounding: 0.0,
        corners: [[0.0; 3]; 3],
        points: std::ptr::null(),
        point_count: 0,
    }
}

/// A place that is missing: a shape with it is refused.
const NOWHERE: [f64; 3] = [f64::NAN; 3];

/// A ball. Thread safety: any thread.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_sphere(centre: Option<&[f64; 3]>, radius: f64) -> Shape {
    let centre = centre.copied().unwrap_or(NOWHERE);
    Shape { corners: [centre, [0.0; 3], [0.0; 3]], radius, ..none(ShapeKind::Sphere) }
}

/// All points within `radius` of a segment. Thread safety: any thread.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_capsule(start: Option<&[f64; 3]>, end: Option<&[f64; 3]>, radius: f64) -> Shape {
    let [start, end] = [start, end].map(|place| place.copied().unwrap_or(NOWHERE));
    Shape { corners: [start, end, [0.0; 3]], radius, ..none(ShapeKind::Capsule) }
}

/// A box with these half sides about the origin of `pose`. Thread safety: any thread.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_box(pose: Pose, half_x: f64, half_y: f64, half_z: f64) -> Shape {
    Shape { pose, half: [half_x, half_y, half_z], ..none(ShapeKind::Box) }
}

/// A cylinder about the axis y of `pose`. Thread safety: any thread.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_cylinder(pose: Pose, half_height: f64, radius: f64) -> Shape {
    Shape { pose, half: [0.0, half_height, 0.0], radius, ..none(ShapeKind::Cylinder) }
}

/// A cone about the axis y of `pose`, with its tip upwards. Thread safety: any thread.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_cone(pose: Pose, half_height: f64, radius: f64) -> Shape {
    Shape { pose, half: [0.0, half_height, 0.0], radius, ..none(ShapeKind::Cone) }
}

/// A triangle, grown by `rounding`. Thread safety: any thread.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_triangle(
    a: Option<&[f64; 3]>,
    b: Option<&[f64; 3]>,
    c: Option<&[f64; 3]>,
    rounding: f64,
) -> Shape {
    let corners = [a, b, c].map(|corner| corner.copied().unwrap_or(NOWHERE));
    Shape { corners, rounding, ..none(ShapeKind::Triangle) }
}

/// The convex hull of `count` points of three numbers each, grown by `rounding`. The points are not
/// copied: they stay valid as long as the shape is used. Thread safety: any thread.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_hull(points: *const f64, count: usize, rounding: f64) -> Shape {
    Shape { points, point_count: count, rounding, ..none(ShapeKind::Hull) }
}

impl Shape {
    /// Checks the numbers and returns the shape.
    ///
    /// # Safety
    /// The points of a hull are valid.
    pub(crate) unsafe fn checked<'a>(&self) -> Result<Convex<'a>, Failure> {
        let Self { pose, half, radius, rounding, corners, .. } = *self;
        let lengths = [half[0], half[1], half[2], radius, rounding];
        if let Some(wrong) = lengths.iter().find(|&&l| !(l >= 0.0 && l.is_finite())) {
            return Err(Failure::argument(format_args!(
                "expected finite lengths of at least 0, got {wrong}"
            )));
        }
        let are_finite = |points: &[[f64; 3]]| points.iter().flatten().all(|c| c.is_finite());
        let not_finite = || Failure::argument("expected finite points of a shape, got NaN or infinity");
        if !are_finite(&corners) {
            return Err(not_finite());
        }
        let half_height = half[1];
        Ok(match self.kind {
            0 => Convex::Sphere { centre: corners[0], radius },
            1 => Convex::Capsule { ends: [corners[0], corners[1]], radius },
            2 => Convex::Box { pose: pose.checked()?, half, radius: rounding },
            3 => Convex::Cylinder { pose: pose.checked()?, half_height, radius, rounding },
            4 => Convex::Cone { pose: pose.checked()?, half_height, radius, rounding },
            5 => Convex::Triangle { points: corners, radius: rounding },
            6 => {
                // SAFETY: the caller promises the points; three numbers in a row are one array.
                let points = unsafe { slice(self.points.cast::<[f64; 3]>(), self.point_count, "points") }?;
                if points.is_empty() {
                    return Err(Failure::argument("expected at least one point of a hull, got none"));
                }
                if !are_finite(points) {
                    return Err(not_finite());
                }
                Convex::Hull { points, radius: rounding }
            }
            other => {
                return Err(Failure::argument(format_args!(
                    "expected a kind of shape of 0 to 6, got {other}"
                )));
            }
        })
    }
}

/// A shape that owns the points of its hull.
#[derive(Debug, Clone)]
pub(crate) enum OwnShape {
    Hull(Box<[[f64; 3]]>, f64),
    Other(Convex<'static>),
}

impl OwnShape {
    pub(crate) fn new(shape: Convex<'_>) -> Result<Self, Failure> {
        Ok(Self::Other(match shape {
            Convex::Sphere { centre, radius } => Convex::Sphere { centre, radius },
            Convex::Capsule { ends, radius } => Convex::Capsule { ends, radius },
            Convex::Box { pose, half, radius } => Convex::Box { pose, half, radius },
            Convex::Cylinder { pose, half_height, radius, rounding } => {
                Convex::Cylinder { pose, half_height, radius, rounding }
            }
            Convex::Cone { pose, half_height, radius, rounding } => {
                Convex::Cone { pose, half_height, radius, rounding }
            }
            Convex::Triangle { points, radius } => Convex::Triangle { points, radius },
            Convex::Hull { points, radius } => return Ok(Self::Hull(points.into(), radius)),
            _ => return Err(Failure::argument("expected a kind of shape of 0 to 6")),
        }))
    }
}

impl nearmiss::AsShape for OwnShape {
    fn as_shape(&self) -> Convex<'_> {
        match self {
            Self::Hull(points, radius) => Convex::Hull { points, radius: *radius },
            Self::Other(shape) => *shape,
        }
    }
}
