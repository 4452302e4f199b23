//! What is measured beside each other: ours, and what users would pick instead, behind one trait.

pub mod eigen;
pub mod grid;
pub mod jacobi;
pub mod kiddo;
pub mod ours;
pub mod parry;
pub mod triangles;
pub mod trimesh;

use nearmiss::{BuildOptions, CollideOptions, Detail, Pose, Scan};

use crate::Failure;
use crate::object::Object;

/// An answer to the boolean question, with what it cost where that is counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Reply {
    /// Whether the two copies meet.
    pub hit: bool,
    /// Evaluations of an implicit function; triangle or point tests of a rival.
    pub evaluations: u64,
    /// Node pairs.
    pub node_pairs: u64,
}

/// A way to answer whether two posed copies of one object meet.
pub trait Method {
    /// What to call it in a table.
    fn name(&self) -> String;

    /// Done before each question, and not timed.
    fn prepare(&mut self) {}

    /// Whether the copies at `a` and `b` meet. Poses are rigid; all work that depends on them is done here.
    fn ask(&mut self, a: &Pose, b: &Pose) -> Reply;
}

/// A rival by its name: `parry`, `trimesh` or `kiddo`; `None` if it needs a mesh and the object has none.
///
/// # Errors
/// When there is no such rival, or it refuses the object.
pub fn rival(name: &str, object: &Object) -> Result<Option<Box<dyn Method>>, Failure> {
    let of_mesh = |make: fn(&nearmiss::TriangleMesh) -> Result<Box<dyn Method>, Failure>| {
        object.mesh.as_ref().map(make).transpose()
    };
    match name {
        "parry" => of_mesh(|mesh| Ok(Box::new(parry::MeshTree::new(mesh)))),
        "trimesh" => of_mesh(|mesh| Ok(Box::new(trimesh::Shape::new(mesh)?))),
        "kiddo" => Ok(Some(Box::new(kiddo::PointScan::new(&object.cloud, object.r)?))),
        _ => Err(format!("no rival {name:?}; there are parry, trimesh and kiddo").into()),
    }
}

/// Calls `measure` with ours, asking for a verdict and for a witness, and with the rivals parry and kiddo as
/// far as they take the object.
///
/// # Errors
/// When the object cannot be prepared.
pub fn bench(object: &Object, mut measure: impl FnMut(&mut dyn Method)) -> Result<(), Failure> {
    let scan = Scan::build(&object.cloud, &BuildOptions::default())?;
    for detail in [Detail::Verdict, Detail::Witness] {
        measure(&mut ours::Ours::new(&scan, &CollideOptions::default().with_detail(detail))?);
    }
    for name in ["parry", "kiddo"] {
        if let Some(mut rival) = rival(name, object)? {
            measure(rival.as_mut());
        }
    }
    Ok(())
}
