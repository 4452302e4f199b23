//! Conversions from the types of Bevy to those of nearmiss.

use bevy_math::{Ray3d, Vec3};
use bevy_transform::components::GlobalTransform;
use nearmiss::{Pose, PoseError, Ray, Shape};

/// The pose of a transform: rotation, translation and one scale.
///
/// # Errors
/// If the transform mirrors, shears, or scales unevenly; if a number is not finite.
pub fn pose_of(transform: &GlobalTransform) -> Result<Pose, PoseError> {
    let affine = transform.affine();
    let columns = [affine.x_axis, affine.y_axis, affine.z_axis, affine.translation];
    let [x, y, z, t] = columns.map(|column| Vec3::from(column).to_array().map(f64::from));
    let row = |k: usize| [x[k], y[k], z[k], t[k]];
    let mut matrix = [0.0; 16];
    for k in 0..3 {
        matrix[4 * k..4 * k + 4].copy_from_slice(&row(k));
    }
    matrix[15] = 1.0;
    Pose::from_matrix(&matrix)
}

/// The ray up to a distance of `max`.
#[must_use]
pub fn ray_of(ray: Ray3d, max: f32) -> Ray {
    let [origin, direction] = [ray.origin, *ray.direction].map(|it| it.to_array().map(f64::from));
    Ray::new(origin, direction).with_max(f64::from(max))
}

/// The ball about a place; a point with a radius of 0.
#[must_use]
pub fn sphere_of(centre: Vec3, radius: f32) -> Shape<'static> {
    Shape::Sphere { centre: centre.to_array().map(f64::from), radius: f64::from(radius) }
}
