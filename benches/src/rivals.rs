//! Methods that are measured against each other, ours and those that users would pick instead,
//! behind one trait.

pub mod eigen;
pub mod grid;
pub mod jacobi;
pub mod kiddo;
pub mod mesh;
mod method;
pub mod ours;
pub mod parry;
pub mod program;
pub mod refit;
pub mod solids;
pub mod triangles;
pub mod trimesh;

use nearmiss::{BuildOptions, CollideOptions, Detail, Scan};

pub use method::{Method, Reply};

use crate::Failure;
use crate::object::Object;

/// Names of rivals. `mesh` is our own query of the object's mesh.
pub const NAMES: [&str; 4] = ["mesh", "parry", "trimesh", "kiddo"];

/// Returns a rival by its name, one of [`NAMES`], or `None` if it needs a mesh and the object has
/// none.
///
/// # Errors
/// When there is no such rival, or it rejects the object.
pub fn rival(name: &str, object: &Object) -> Result<Option<Box<dyn Method>>, Failure> {
    let of_mesh = |make: fn(&nearmiss::TriangleMesh) -> Result<Box<dyn Method>, Failure>| {
        object.mesh.as_ref().map(make).transpose()
    };
    match name {
        "mesh" => of_mesh(|mesh| Ok(Box::new(mesh::OurMesh::new(mesh)?))),
        "parry" => of_mesh(|mesh| Ok(Box::new(parry::MeshTree::new(mesh)))),
        "trimesh" => of_mesh(|mesh| Ok(Box::new(trimesh::Shape::new(mesh)?))),
        "kiddo" => Ok(Some(Box::new(kiddo::PointScan::new(&object.cloud, object.r)?))),
        _ => Err(format!("expected a rival of {}, got {name:?}", NAMES.join(", ")).into()),
    }
}

/// Calls `measure` with ours, once for a verdict and once for a witness, and with the rivals parry
/// and kiddo if they accept the object.
///
/// # Errors
/// When the object cannot be prepared.
pub fn bench(object: &Object, mut measure: impl FnMut(&mut dyn Method)) -> Result<(), Failure> {
    let scan = Scan::build(&object.cloud, &BuildOptions::default())?;
    for detail in [Detail::Verdict, Detail::Witness] {
        measure(&mut ours::Ours::new(&scan, &CollideOptions::estimated().with_detail(detail))?);
    }
    for name in ["parry", "kiddo"] {
        if let Some(mut rival) = rival(name, object)? {
            measure(rival.as_mut());
        }
    }
    Ok(())
}
