//! The option `--as-mesh` of commands about pairs: whether triangles are compared instead of points.

use clap::ValueEnum;

use crate::error::CliError;

/// The names of the inputs that are compared as meshes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum AsMeshName {
    /// The first input
    A,
    /// The second input
    B,
    /// Both inputs
    Both,
}

/// The options of `collide` that apply to scans only.
pub(crate) const OF_COLLIDE: [&str; 22] = [
    "kernel",
    "surface_only",
    "thickened",
    "margin",
    "evidence",
    "prove",
    "detail",
    "method",
    "flat",
    "test_points",
    "tolerance",
    "surfels",
    "probability",
    "brackets",
    "refinement",
    "seed",
    "order",
    "coverings",
    "resolution",
    "image",
    "up",
    "view",
];

/// The options of `distance` that apply to scans only.
pub(crate) const OF_DISTANCE: [&str; 7] =
    ["kernel", "surface_only", "thickened", "relative", "image", "up", "view"];

impl AsMeshName {
    /// Fails if a mesh would be compared with a scan, which is not possible yet.
    pub(crate) fn check(self) -> Result<(), CliError> {
        let (name, other) = match self {
            Self::A => ("a", "b"),
            Self::B => ("b", "a"),
            Self::Both => return Ok(()),
        };
        Err(CliError::Usage(format!(
            "--as-mesh {name}: expected two meshes, got a mesh and a scan, which no command compares yet, only the library's `MeshScanPair`; use `--as-mesh \
             both` if {other} has faces, or put points on the faces of {name} with `sample` and leave out --as-mesh"
        )))
    }
}
