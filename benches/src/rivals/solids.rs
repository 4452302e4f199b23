//! Parry's own tests of convex shapes and rays against a triangle mesh, as a user of a physics engine
//! would call them. Single precision.

use nearmiss::{Pose, Ray, Shape, TriangleMesh};
use parry3d::math::Pose as Placement;
use parry3d::query::{
    ContactManifold, ContactManifoldsWorkspace, DefaultQueryDispatcher, PersistentQueryDispatcher,
    Ray as Line, RayCast, distance, intersection_test,
};
use parry3d::shape::{Ball, Capsule, Cuboid, Cylinder, Shape as Solid, TriMesh};

use crate::Failure;
use crate::rivals::trimesh::{mesh, placement, vector};

/// Working memory of parry's contacts.
#[derive(Default)]
#[expect(missing_debug_implementations, reason = "the workspace is not printable")]
pub struct Manifolds {
    found: Vec<ContactManifold<(), ()>>,
    workspace: Option<ContactManifoldsWorkspace>,
}

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

    /// Returns `true` if a sphere, capsule, box or cylinder touches a triangle. `false` for other shapes. The
    /// radius about a box or a cylinder is ignored, as in the next methods.
    #[must_use]
    pub fn touches(&self, shape: &Shape<'_>) -> bool {
        let own = Placement::IDENTITY;
        ask(shape, |at, solid| intersection_test(&own, &self.mesh, at, solid))
            .is_some_and(|found| found.is_ok_and(|found| found.intersecting))
    }

    /// The distance from a sphere, capsule, box or cylinder; 0 if it touches. Infinite for other shapes.
    #[must_use]
    pub fn distance(&self, shape: &Shape<'_>) -> f64 {
        let own = Placement::IDENTITY;
        ask(shape, |at, solid| distance(&own, &self.mesh, at, solid))
            .and_then(Result::ok)
            .map_or(f64::INFINITY, |found| f64::from(found.distance))
    }

    /// The number of contacts with a sphere, capsule, box or cylinder, in all manifolds. `working` is used
    /// again.
    pub fn contacts(&self, shape: &Shape<'_>, working: &mut Manifolds) -> usize {
        let Manifolds { found, workspace } = working;
        found.clear();
        // A new shape each time has nothing in common with the last one.
        *workspace = None;
        let asked = ask(shape, |at, solid| {
            DefaultQueryDispatcher.contact_manifolds(at, &self.mesh, solid, 0.0, found, workspace)
        });
        asked.map_or(0, |_| found.iter().map(|manifold| manifold.points.len()).sum())
    }

    /// Returns `true` if a ray, whose direction is a unit vector, hits a triangle.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "the rival works in single precision")]
    pub fn is_hit(&self, ray: &Ray) -> bool {
        let line = Line::new(vector(ray.origin), vector(ray.direction));
        self.mesh.cast_local_ray_and_get_normal(&line, ray.max as f32, false).is_some()
    }
}

/// Asks a question about a sphere, capsule, box or cylinder as parry's shape. `None` for other shapes.
#[expect(clippy::cast_possible_truncation, reason = "the rival works in single precision")]
fn ask<T>(shape: &Shape<'_>, question: impl FnOnce(&Placement, &dyn Solid) -> T) -> Option<T> {
    Some(match *shape {
        Shape::Sphere { centre, radius } => {
            question(&placement(&Pose::from_translation(centre)), &Ball::new(radius as f32))
        }
        Shape::Capsule { ends: [p, q], radius } => {
            question(&Placement::IDENTITY, &Capsule::new(vector(p), vector(q), radius as f32))
        }
        Shape::Box { pose, half, .. } => question(&placement(&pose), &Cuboid::new(vector(half))),
        Shape::Cylinder { pose, half_height, radius, .. } => {
            question(&placement(&pose), &Cylinder::new(half_height as f32, radius as f32))
        }
        _ => return None,
    })
}
