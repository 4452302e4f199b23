//! Errors of commands: the file, the place in it, the fault and a remedy.

use std::io;
use std::path::{Path, PathBuf};

use nearmiss::io::{PlyError, ReadError};
use nearmiss::mesh::SampleError;
use nearmiss::slices::{SliceError, StoreError};
use nearmiss::store::{ContainerFault, OpenError};
use nearmiss::{
    BuildError, GraphError, LoadError, Mesh, MeshBuildError, PlanError, SaveError, Scan, WorkError,
};
use thiserror::Error;

use crate::matrix::PoseRefused;

/// An error of a command.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CliError {
    /// Wrong usage of the command line; exit status 2.
    #[error("{0}")]
    Usage(String),
    /// A point cloud or mesh could not be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A prepared scan could not be opened.
    #[error("{}{cause}", prefix(cause, path))]
    Load {
        /// The file.
        path: PathBuf,
        /// The reason.
        cause: LoadError,
    },
    /// A prepared scan is inconsistent.
    #[error("{}: {what}; prepare it again with `preprocess`", path.display())]
    CorruptScan {
        /// The file.
        path: PathBuf,
        /// The inconsistency.
        what: String,
    },
    /// A scan could not be prepared.
    #[error("{}: {cause}", path.display())]
    Build {
        /// The input.
        path: PathBuf,
        /// The reason.
        cause: BuildError,
    },
    /// A mesh could not be prepared.
    #[error("{}: {cause}", path.display())]
    BuildMesh {
        /// The input.
        path: PathBuf,
        /// The reason.
        cause: MeshBuildError,
    },
    /// A graph could not be built.
    #[error("{}: {cause}", path.display())]
    Graph {
        /// The input.
        path: PathBuf,
        /// The reason.
        cause: GraphError,
    },
    /// A prepared scan could not be saved.
    #[error(transparent)]
    Save(#[from] SaveError),
    /// Work on disk failed.
    #[error(transparent)]
    Work(#[from] WorkError),
    /// A mesh could not be sampled.
    #[error("{}: {cause}", path.display())]
    Sample {
        /// The mesh.
        path: PathBuf,
        /// The reason.
        cause: SampleError,
    },
    /// A slice map could not be built from these points with these options.
    #[error("{}: {cause}{}", path.display(), options_for(cause))]
    Slices {
        /// The input.
        path: PathBuf,
        /// The reason.
        cause: SliceError,
    },
    /// A slice map could not be saved or loaded.
    #[error(transparent)]
    SliceStore(#[from] StoreError),
    /// Options that do not fit together or do not fit the scans; exit status 2.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// A matrix is not a pose.
    #[error("{place}: {refused}")]
    Pose {
        /// The option that gave the matrix.
        place: String,
        /// The reason.
        refused: PoseRefused,
    },
    /// A line of a text file is invalid.
    #[error("{}: line {line}: {what}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// The number of the line, counted from 1.
        line: u64,
        /// The fault and a remedy.
        what: String,
    },
    /// A file does not exist.
    #[error("{}: no such file; check the path", path.display())]
    Missing {
        /// The missing file.
        path: PathBuf,
    },
    /// A file could not be read or written.
    #[error("{}: cannot {verb}: {}; {remedy}", path.display(), plain(cause))]
    File {
        /// The file.
        path: PathBuf,
        /// The operation that failed.
        verb: &'static str,
        /// The error of the operating system.
        cause: io::Error,
        /// A remedy.
        remedy: &'static str,
    },
    /// A file that was read, or a path, that is unsuitable.
    #[error("{}: {what}", path.display())]
    UnsuitableFile {
        /// The file.
        path: PathBuf,
        /// The fault and a remedy.
        what: String,
    },
    /// Threads could not be started.
    #[error("cannot start {0} threads; use fewer with --threads")]
    Threads(usize),
    /// Standard output could not be written.
    #[error("cannot write to standard output: {}", plain(.0))]
    Stdout(io::Error),
}

impl CliError {
    /// Returns a function that wraps an error of reading `path`.
    pub(crate) fn reading(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |cause| match cause.kind() {
            io::ErrorKind::NotFound => Self::Missing { path },
            _ => Self::File { path, verb: "read it", cause, remedy: "check its permissions and the disk" },
        }
    }

    /// Returns a function that wraps an error of writing `path`.
    pub(crate) fn writing(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |cause| Self::File {
            path,
            verb: "write it",
            cause,
            remedy: "check that the folder exists, may be written to and has space left",
        }
    }

    /// Returns the error of a PLY file that cannot be written.
    pub(crate) fn writing_ply(path: &Path) -> impl FnOnce(PlyError) -> Self {
        let path = path.to_owned();
        move |error| match error {
            PlyError::Io { cause } => Self::writing(&path)(cause),
            error => Self::UnsuitableFile { path, what: error.to_string() },
        }
    }

    /// Returns a function that wraps an error of opening the prepared scan or mesh at `path`.
    pub(crate) fn loading(path: &Path) -> impl FnOnce(LoadError) -> Self {
        let path = path.to_owned();
        |cause| match of_other_kind(&cause) {
            Some(what) => Self::UnsuitableFile { path, what: what.into() },
            None => Self::Load { path, cause },
        }
    }

    /// Returns the exit status of the process.
    #[must_use]
    pub fn status(&self) -> u8 {
        match self {
            Self::Usage(_) | Self::Plan(_) => 2,
            Self::Stdout(cause) if cause.kind() == io::ErrorKind::BrokenPipe => 0,
            _ => 1,
        }
    }

    /// Returns `true` if no message is printed, which is the case after the reader of a pipe has
    /// closed it.
    #[must_use]
    pub fn is_silent(&self) -> bool {
        self.status() == 0
    }
}

/// Returns the options that mend this fault, in brackets; empty for faults that name them.
fn options_for(cause: &SliceError) -> &'static str {
    match cause {
        SliceError::Memory { .. } => " (--pixel or --resolution, --slice-height, --memory)",
        _ => "",
    }
}

/// Returns the message of the operating system, starting in lower case and without its error
/// number.
pub(crate) fn plain(cause: &io::Error) -> String {
    let text = cause.to_string();
    let text = text.split(" (os error ").next().unwrap_or_default();
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_lowercase().chain(letters).collect())
}

/// Returns what to do about a prepared mesh where a scan is expected, and the reverse.
fn of_other_kind(cause: &LoadError) -> Option<&'static str> {
    let LoadError::Open(OpenError { fault: ContainerFault::Kind { found, expected }, .. }) = cause else {
        return None;
    };
    match (*found, *expected) {
        (Mesh::KIND, Scan::KIND) => Some(
            "expected a prepared scan, got a prepared mesh; compare its triangles with a scan by `collide A B --as-mesh b` \
             (or a: the letter of the mesh; `distance` and `sweep` alike), or with a mesh by `mesh-collide`; or make it \
             a scan: put points on its faces with `sample`, or prepare its vertices with `preprocess` without --as-mesh",
        ),
        (Scan::KIND, Mesh::KIND) => Some(
            "expected a prepared mesh, got a prepared scan; compare a scan with a mesh by `collide A B --as-mesh b` (or a: \
             the letter of the mesh; `distance` and `sweep` alike), two scans without --as-mesh, or prepare an input \
             that has faces again with `preprocess --as-mesh`",
        ),
        _ => None,
    }
}

/// Returns the path as a prefix of a message, unless `cause` names the file itself.
fn prefix(cause: &LoadError, path: &Path) -> String {
    match cause {
        LoadError::Open(_) => String::new(),
        _ => format!("{}: ", path.display()),
    }
}
