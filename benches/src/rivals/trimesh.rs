//! Parry's own test of two triangle meshes, as a user of a physics engine would call. Single
//! precision.

use nearmiss::{Pose, TriangleMesh};
use parry3d::math::{Matrix, Pose as Placement, Rotation, Vector};
use parry3d::query::intersection_test;
use parry3d::shape::TriMesh;

use crate::Failure;
use crate::rivals::method::{Method, Reply};

/// A triangle mesh as parry's shape.
#[expect(missing_debug_implementations, reason = "the shape's is a dump of all its triangles")]
pub struct Shape {
    mesh: TriMesh,
}

impl Shape {
    /// Converts the mesh to single precision.
    ///
    /// # Errors
    /// When parry rejects the mesh.
    pub fn new(mesh: &TriangleMesh) -> Result<Self, Failure> {
        Ok(Self { mesh: self::mesh(mesh)? })
    }
}

/// The mesh in single precision.
pub(super) fn mesh(mesh: &TriangleMesh) -> Result<TriMesh, Failure> {
    let vertices = mesh.vertices().iter().map(|&p| vector(p)).collect();
    Ok(TriMesh::new(vertices, mesh.triangles().to_vec())?)
}

#[expect(clippy::cast_possible_truncation, reason = "the rival works in single precision")]
pub(super) fn vector(p: [f64; 3]) -> Vector {
    Vector::from_array(p.map(|x| x as f32))
}

pub(super) fn placement(pose: &Pose) -> Placement {
    let column = |k: usize| vector(std::array::from_fn(|i| pose.rotation()[(i, k)]));
    let turn = Rotation::from_mat3(&Matrix::from_cols(column(0), column(1), column(2)));
    Placement::from_parts(vector(pose.translation()), turn)
}

impl Method for Shape {
    fn name(&self) -> String {
        "parry TriMesh intersection_test (mesh)".into()
    }

    fn ask(&mut self, a: &Pose, b: &Pose) -> Reply {
        let found = intersection_test(&placement(a), &self.mesh, &placement(b), &self.mesh);
        Reply { hit: found.is_ok_and(|found| found.intersecting), ..Reply::default() }
    }
}
