//! Our own queries of two prepared meshes.

use nearmiss::{MeshBuildOptions, MeshHierarchy, MeshPair, MeshScratch, PlacedMesh, Pose, TriangleMesh};

use crate::Failure;
use crate::rivals::method::{Method, Reply};

/// A prepared mesh and a copy of itself, with a scratch that is reused.
#[derive(Debug, Clone)]
pub struct OurMesh {
    mesh: MeshHierarchy,
    scratch: MeshScratch,
}

impl OurMesh {
    /// Prepares the mesh.
    ///
    /// # Errors
    /// When it has no triangles with an area.
    pub fn new(mesh: &TriangleMesh) -> Result<Self, Failure> {
        let mesh = MeshHierarchy::build(mesh, &MeshBuildOptions::default())?;
        Ok(Self { mesh, scratch: MeshScratch::default() })
    }
}

impl Method for OurMesh {
    fn name(&self) -> String {
        "nearmiss, exact (mesh)".into()
    }

    fn ask(&mut self, a: &Pose, b: &Pose) -> Reply {
        let pair = MeshPair::new(PlacedMesh::new(&self.mesh, a), PlacedMesh::new(&self.mesh, b));
        let answer = pair.collide(&mut self.scratch);
        Reply {
            hit: answer.verdict.is_intersecting(),
            evaluations: answer.statistics.leaf_pairs,
            node_pairs: answer.statistics.node_pairs,
        }
    }
}
