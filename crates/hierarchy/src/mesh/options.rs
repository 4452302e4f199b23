//! Options of a build, and its errors.

use nearmiss_mesh::{CleanError, CleanOptions};
use thiserror::Error;

/// Options of [`MeshHierarchy::build`](crate::MeshHierarchy::build).
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct MeshBuildOptions {
    /// How the mesh is cleaned first. Default: vertices with equal coordinates are welded.
    pub clean: CleanOptions,
    /// `true`, the default, if the well-filled cells of each node are counted, for the probabilities
    /// of time-critical queries. Without them, all nodes are taken to be filled alike. Counting
    /// takes longer than the rest of a build.
    pub cells: bool,
    /// Number of threads; 0, the default, for one per core. The result does not depend on it.
    pub threads: usize,
}

impl Default for MeshBuildOptions {
    fn default() -> Self {
        Self { clean: CleanOptions::default(), cells: true, threads: 0 }
    }
}

impl MeshBuildOptions {
    /// The same options with or without counts of cells.
    #[must_use]
    pub const fn with_cells(self, cells: bool) -> Self {
        Self { cells, ..self }
    }

    /// The same options with this cleaning.
    #[must_use]
    pub const fn with_clean(self, clean: CleanOptions) -> Self {
        Self { clean, ..self }
    }

    /// The same options with this number of threads.
    #[must_use]
    pub const fn with_threads(self, threads: usize) -> Self {
        Self { threads, ..self }
    }
}

/// Why a mesh cannot be prepared.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum MeshBuildError {
    /// The mesh cannot be cleaned.
    #[error(transparent)]
    Clean(#[from] CleanError),
    /// No triangle has an area.
    #[error(
        "expected a mesh with at least one triangle of positive area, got {triangles} triangles without; give a mesh with faces"
    )]
    Empty {
        /// Number of triangles in the mesh.
        triangles: usize,
    },
    /// The mesh is so large that coordinates overflow.
    #[error("expected coordinates below 1e150, got {0:e}; scale the mesh")]
    TooFar(f64),
    /// The threads could not be started.
    #[error("cannot start {0} threads; ask for fewer, or for 0 to use one per core")]
    Threads(usize),
}
