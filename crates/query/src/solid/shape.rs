//! Convex shapes in the world, as the caller gives them.

use std::fmt::Debug;

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_geometry::{Aabb, Pose};

/// A convex shape of the caller's own, known by its support map.
pub trait SupportMap: Debug + Sync {
    /// Returns a point of the shape that is furthest along `direction`, which has any length above
    /// zero. World coordinates.
    fn support(&self, direction: [f64; 3]) -> [f64; 3];

    /// Returns a point inside the shape, which tells the side of a surface on which the shape is.
    fn centre(&self) -> [f64; 3];
}

impl PartialEq for dyn SupportMap + '_ {
    /// Returns `true` if both are the same object.
    fn eq(&self, other: &Self) -> bool {
        std::ptr::addr_eq(self, other)
    }
}

/// A convex shape in world coordinates. A shape with a length that is negative or NaN, or with a
/// point that is not finite, is invalid: it touches nothing.
///
/// The radius of a capsule, box, triangle, hull or own shape rounds it: the shape is everything
/// within that distance of its core. Cylinders and cones have a radius of their own, and round by
/// `rounding`. Zero leaves the core itself. A segment is a capsule of radius 0.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Shape<'a> {
    /// All points within `radius` of `centre`.
    Sphere {
        /// The centre.
        centre: [f64; 3],
        /// The radius.
        radius: f64,
    },
    /// All points within `radius` of a segment.
    Capsule {
        /// The end points of the segment.
        ends: [[f64; 3]; 2],
        /// The radius about the segment.
        radius: f64,
    },
    /// All points within `radius` of a solid box.
    Box {
        /// The pose of the box, which maps an axis-aligned box about the origin to the world. Its
        /// scale applies.
        pose: Pose,
        /// Half the edge lengths, before the pose is applied.
        half: [f64; 3],
        /// The radius about the box, in world units.
        radius: f64,
    },
    /// All points within `rounding` of a solid cylinder.
    Cylinder {
        /// The pose of the cylinder, which maps a cylinder about the y axis and the origin to the
        /// world. Its scale applies.
        pose: Pose,
        /// Half the height, before the pose is applied.
        half_height: f64,
        /// The radius of the cylinder, before the pose is applied.
        radius: f64,
        /// The radius about the cylinder, in world units.
        rounding: f64,
    },
    /// All points within `rounding` of a solid cone.
    Cone {
        /// The pose of the cone, which maps a cone about the y axis to the world. Its base is at
        /// −`half_height`, its tip at `half_height`. Its scale applies.
        pose: Pose,
        /// Half the height, before the pose is applied.
        half_height: f64,
        /// The radius of the base, before the pose is applied.
        radius: f64,
        /// The radius about the cone, in world units.
        rounding: f64,
    },
    /// All points within `radius` of a triangle.
    Triangle {
        /// The corners.
        points: [[f64; 3]; 3],
        /// The radius about the triangle.
        radius: f64,
    },
    /// All points within `radius` of the convex hull of points. Costs O(points) for each step of an
    /// iteration, so points inside the hull are best left out.
    Hull {
        /// The points, at least one.
        points: &'a [[f64; 3]],
        /// The radius about the hull.
        radius: f64,
    },
    /// All points within `radius` of a convex shape of the caller's own.
    Own {
        /// The shape.
        map: &'a dyn SupportMap,
        /// The radius about the shape.
        radius: f64,
    },
}

impl Shape<'_> {
    /// Returns the shape moved by a pose, as a link of a robot is; lengths follow its scale. `None` for a
    /// hull or a shape of the caller's own, which borrow their places.
    #[must_use]
    pub fn moved(&self, by: &Pose) -> Option<Shape<'static>> {
        let scale = by.scale();
        Some(match *self {
            Self::Sphere { centre, radius } => {
                Shape::Sphere { centre: by.apply(centre), radius: radius * scale }
            }
            Self::Capsule { ends, radius } => {
                Shape::Capsule { ends: ends.map(|end| by.apply(end)), radius: radius * scale }
            }
            Self::Box { pose, half, radius } => {
                Shape::Box { pose: by.after(&pose), half, radius: radius * scale }
            }
            Self::Cylinder { pose, half_height, radius, rounding } => {
                let pose = by.after(&pose);
                Shape::Cylinder { pose, half_height, radius, rounding: rounding * scale }
            }
            Self::Cone { pose, half_height, radius, rounding } => {
                let pose = by.after(&pose);
                Shape::Cone { pose, half_height, radius, rounding: rounding * scale }
            }
            Self::Triangle { points, radius } => {
                Shape::Triangle { points: points.map(|p| by.apply(p)), radius: radius * scale }
            }
            Self::Hull { .. } | Self::Own { .. } => return None,
        })
    }

    /// Returns the radius about the core, in world units.
    #[must_use]
    pub fn rounding(&self) -> f64 {
        match *self {
            Self::Sphere { radius, .. }
            | Self::Capsule { radius, .. }
            | Self::Box { radius, .. }
            | Self::Triangle { radius, .. }
            | Self::Hull { radius, .. }
            | Self::Own { radius, .. } => radius,
            Self::Cylinder { rounding, .. } | Self::Cone { rounding, .. } => rounding,
        }
    }

    /// The lengths in world units, none of which may be negative or NaN.
    fn lengths(&self) -> [f64; 4] {
        let rounding = self.rounding();
        match *self {
            Self::Box { pose, half: [x, y, z], .. } => {
                let scale = scale_of(&pose);
                [x * scale, y * scale, z * scale, rounding]
            }
            Self::Cylinder { pose, half_height, radius, .. }
            | Self::Cone { pose, half_height, radius, .. } => {
                let scale = scale_of(&pose);
                [half_height * scale, radius * scale, 0.0, rounding]
            }
            Self::Hull { points: [], .. } => [f64::NAN; 4],
            _ => [0.0, 0.0, 0.0, rounding],
        }
    }

    /// The centre of a ball that contains the shape, the radius about the core, and the radius of a ball
    /// about the core, in the world. `None` for shapes of any places, and if a length is negative or NaN.
    #[inline]
    pub(crate) fn ball(&self) -> Option<([f64; 3], [f64; 2])> {
        let length = |v: [f64; 3]| (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
        let (centre, beyond, lengths) = match *self {
            Self::Sphere { centre, .. } => (centre, 0.0, [0.0; 3]),
            Self::Capsule { ends: [p, q], .. } => {
                let [centre, along] = [1.0, -1.0].map(|sign| [0, 1, 2].map(|k| 0.5 * (p[k] + sign * q[k])));
                (centre, length(along), [0.0; 3])
            }
            Self::Box { pose, half, .. } => (pose.translation(), scale_of(&pose) * length(half), half),
            Self::Cylinder { pose, half_height, radius, .. }
            | Self::Cone { pose, half_height, radius, .. } => {
                let half = [radius, half_height, 0.0];
                (pose.translation(), scale_of(&pose) * length(half), half)
            }
            Self::Triangle { .. } | Self::Hull { .. } | Self::Own { .. } => return None,
        };
        let rounding = self.rounding();
        let is_proper = rounding >= 0.0 && beyond >= 0.0 && lengths.iter().all(|&l| l >= 0.0);
        is_proper.then_some((centre, [rounding, beyond]))
    }

    /// Returns `true` if no length is negative, infinite or NaN, and all coordinates are finite.
    #[inline]
    pub(crate) fn is_valid(&self) -> bool {
        // Zero times a number that is not finite is NaN.
        let sum_of_zeros = |p: [f64; 3]| p[0] * 0.0 + p[1] * 0.0 + p[2] * 0.0;
        let zero = match *self {
            Self::Sphere { centre, .. } => sum_of_zeros(centre),
            Self::Capsule { ends: [p, q], .. } => sum_of_zeros(p) + sum_of_zeros(q),
            Self::Box { pose, .. } | Self::Cylinder { pose, .. } | Self::Cone { pose, .. } => {
                sum_of_zeros(pose.translation()) + pose.rotation().sum() * 0.0
            }
            Self::Triangle { points: [p, q, r], .. } => sum_of_zeros(p) + sum_of_zeros(q) + sum_of_zeros(r),
            Self::Hull { points, .. } => points.iter().map(|&p| sum_of_zeros(p)).sum(),
            Self::Own { map, .. } => sum_of_zeros(map.centre()),
        };
        let lengths = self.lengths();
        !zero.is_nan() && lengths.iter().all(|&l| l >= 0.0 && l.is_finite())
    }

    /// A bounding box of the shape in the world, rounding included. `None` if the shape is invalid: a length
    /// is negative, a length or a coordinate is not finite, or a hull has no points.
    #[must_use]
    pub fn bounds(&self) -> Option<Aabb> {
        /// Relative rounding error of a corner's coordinates in double precision.
        const ROUNDING: f64 = 4e-15;
        if !self.is_valid() {
            return None;
        }
        let (low, high) = match *self {
            Self::Sphere { centre, .. } => (centre, centre),
            Self::Capsule { ends: [p, q], .. } => hull_of([p, q].into_iter()),
            Self::Triangle { points, .. } => hull_of(points.into_iter()),
            Self::Hull { points, .. } => hull_of(points.iter().copied()),
            Self::Box { pose, half, .. } => about(&pose, half),
            Self::Cylinder { pose, half_height, radius, .. }
            | Self::Cone { pose, half_height, radius, .. } => about(&pose, [radius, half_height, radius]),
            Self::Own { map, .. } => {
                let axis = |k: usize, sign: f64| {
                    let mut axis = [0.0; 3];
                    axis[k] = sign;
                    map.support(axis)[k]
                };
                ([0, 1, 2].map(|k| axis(k, -1.0)), [0, 1, 2].map(|k| axis(k, 1.0)))
            }
        };
        let radius = self.rounding();
        let more = [0, 1, 2].map(|k| radius + ROUNDING * (low[k].abs() + high[k].abs() + radius));
        let (min, max) = ([0, 1, 2].map(|k| low[k] - more[k]), [0, 1, 2].map(|k| high[k] + more[k]));
        Some(Aabb { min, max })
    }
}

/// The scale of a pose; NaN if its rotation is not finite.
#[inline]
fn scale_of(pose: &Pose) -> f64 {
    pose.scale() + 0.0 * pose.rotation().sum()
}

fn hull_of(points: impl Iterator<Item = [f64; 3]>) -> ([f64; 3], [f64; 3]) {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for p in points {
        for k in 0..3 {
            (low[k], high[k]) = (low[k].min(p[k]), high[k].max(p[k]));
        }
    }
    (low, high)
}

/// The least and the greatest coordinates of an oriented box.
fn about(pose: &Pose, half: [f64; 3]) -> ([f64; 3], [f64; 3]) {
    let (turn, centre) = (pose.rotation(), Vector3::from(pose.translation()));
    let reach = Vector3::from([0, 1, 2].map(|k| (0..3).map(|j| (turn[(k, j)] * half[j]).abs()).sum::<f64>()));
    ((centre - reach * pose.scale()).into(), (centre + reach * pose.scale()).into())
}
