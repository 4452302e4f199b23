//! Parry's own tests of convex shapes and rays against a triangle mesh, as a user of a physics engine
//! would call them. Single precision.

use nearmiss::{Pose, Ray, Shape, TriangleMesh};
use parry3d::math::Pose as Placement;
use parry3d::query::{Ray as Line, RayCast, intersection_test};
use parry3d::shape::{Ball, Capsule, Cuboid, TriMesh};

use crate::Failure;
use crate::rivals::trimesh::{mesh, placement, vector};

/// A triangle mesh as the target of shapes and rays.
#[expect(missing_debug_implementations, reason = "the shape's is a dump of all its triangles")]
pub struct TriMeshTarget {
    mesh: TriMesh,
}

impl TriMeshTarget {
    /// Converts the mesh to single precision.
    ///
    /// # Errors
    /// When parry rejects the mesh.
    pub fn new(triangles: &TriangleMesh) -> Result<Self, Failure> {
        Ok(Self { mesh: mesh(triangles)? })
    }

    /// Returns `true` if a sphere, capsule or box touches a triangle. `false` for other shapes, and for
    /// boxes the radius about them is ignored.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "the rival works in single precision")]
    pub fn touches(&self, shape: &Shape<'_>) -> bool {
        let own = Placement::IDENTITY;
        let found = match *shape {
            Shape::Sphere { centre, radius } => {
                let at = placement(&Pose::from_translation(centre));
                intersection_test(&own, &self.mesh, &at, &Ball::new(radius as f32))
            }
            Shape::Capsule { ends: [p, q], radius } => {
                let capsule = Capsule::new(vector(p), vector(q), radius as f32);
                intersection_test(&own, &self.mesh, &own, &capsule)
            }
            Shape::Box { pose, half, .. } => {
                intersection_test(&own, &self.mesh, &placement(&pose), &Cuboid::new(vector(half)))
            }
            _ => return false,
        };
        found.is_ok_and(|found| found.intersecting)
    }

    /// Returns `true` if a ray, whose direction is a unit vector, hits a triangle.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "the rival works in single precision")]
    pub fn is_hit(&self, ray: &Ray) -> bool {
        let line = Line::new(vector(ray.origin), vector(ray.direction));
        self.mesh.cast_local_ray_and_get_normal(&line, ray.max as f32, false).is_some()
    }
}
