//! Reading and opening of meshes, prepared or raw.

use std::path::Path;

use nearmiss::io::{Format, ReadError};
use nearmiss::{Aabb, Check, Mesh, MeshBuildOptions, Metric, TriangleMesh};

use crate::as_mesh::AsMeshName;
use crate::bodies::Bodies;
use crate::error::CliError;
use crate::input::{self, Opening};
use crate::posing::Posable;
use crate::units::diagonal;

/// The length by which making a matrix a pose may move the bounds of a mesh, as a share of their
/// diagonal.
const TOLERANCE: f64 = 1e-4;

impl Posable for Mesh {
    fn bounds(&self) -> &Aabb {
        nearmiss::MeshHierarchy::bounds(self)
    }

    fn tolerance(&self) -> (f64, &'static str) {
        (TOLERANCE * diagonal(Posable::bounds(self)), "a ten-thousandth of the diagonal of the bounds")
    }
}

/// Reads the triangles of a file.
pub(crate) fn read_mesh(path: &Path, format: Option<Format>) -> Result<TriangleMesh, CliError> {
    input::check_raw(path)?;
    let _limit = input::limit_reading(path, format);
    nearmiss::io::read_mesh(path, format).map_err(|cause| match cause {
        ReadError::NoFaces { path } => CliError::UnsuitableFile {
            path,
            what:
                "expected a mesh, got points without faces; name a file with faces; to compare points with a mesh, name \
                 the mesh by `collide A B --as-mesh a` or `b`; to compare points with points, leave out --as-mesh"
                    .into(),
        },
        cause => CliError::Read(cause),
    })
}

/// Prepares the triangles of the file at `path`.
pub(crate) fn build(path: &Path, mesh: &TriangleMesh, options: &MeshBuildOptions) -> Result<Mesh, CliError> {
    Mesh::build(mesh, options).map_err(|cause| CliError::BuildMesh { path: path.to_owned(), cause })
}

impl Opening {
    /// Opens a prepared mesh, or prepares the triangles of a raw input with default options.
    pub(crate) fn open_mesh(self, path: &Path) -> Result<Mesh, CliError> {
        input::check_there(path)?;
        if input::is_prepared(path) {
            let check = if self.verify { Check::Full } else { Check::Structure };
            return Mesh::open(path, check).map_err(CliError::loading(path));
        }
        let bar = self.console.spinner(format_args!("reading {}", path.display()));
        let mesh = read_mesh(path, None)?;
        drop(bar);
        let _bar = self.console.spinner(format_args!("preparing {}", path.display()));
        build(path, &mesh, &MeshBuildOptions::default().with_threads(self.threads))
    }

    /// Opens two meshes. If both paths are equal, the file is opened once.
    pub(crate) fn open_meshes(self, [a, b]: [&Path; 2]) -> Result<[Mesh; 2], CliError> {
        let first = self.open_mesh(a)?;
        let second = if a == b { first.clone() } else { self.open_mesh(b)? };
        Ok([first, second])
    }

    /// Opens a mesh and a scan, for this kernel if one is given. `which` names the mesh.
    pub(crate) fn open_mesh_and_scan(
        self,
        which: AsMeshName,
        kernel: Option<Metric>,
        [a, b]: [&Path; 2],
    ) -> Result<Bodies, CliError> {
        let mesh_is_a = which == AsMeshName::A;
        let [of_mesh, of_scan] = if mesh_is_a { [a, b] } else { [b, a] };
        let (mesh, scan) = (self.open_mesh(of_mesh)?, self.open_for(kernel, of_scan)?);
        Ok(Bodies::MeshAndScan { mesh, scan, mesh_is_a })
    }
}
