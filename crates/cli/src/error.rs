//! Why a command fails: which file, what is wrong, where, and what would mend it.

use std::io;
use std::path::{Path, PathBuf};

use nearmiss::io::ReadError;
use nearmiss::mesh::SampleError;
use nearmiss::slices::{SliceError, StoreError};
use nearmiss::{BuildError, GraphError, LoadError, PlanError, SaveError, WorkError};
use thiserror::Error;

use crate::matrix::PoseRefused;

/// Why a command failed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CliError {
    /// The command line asks for something that makes no sense; exit status 2.
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
        /// Why not.
        cause: LoadError,
    },
    /// A prepared scan contradicts itself.
    #[error("{}: {what}; prepare it again with `preprocess`", path.display())]
    Insane {
        /// The file.
        path: PathBuf,
        /// How.
        what: String,
    },
    /// A scan could not be prepared.
    #[error("{}: {cause}", path.display())]
    Build {
        /// The input.
        path: PathBuf,
        /// Why not.
        cause: BuildError,
    },
    /// A graph could not be built.
    #[error("{}: {cause}", path.display())]
    Graph {
        /// The input.
        path: PathBuf,
        /// Why not.
        cause: GraphError,
    },
    /// A prepared scan could not be saved.
    #[error(transparent)]
    Save(#[from] SaveError),
    /// The folder that the work is done in fails.
    #[error(transparent)]
    Work(#[from] WorkError),
    /// A mesh could not be sampled.
    #[error("{}: {cause}", path.display())]
    Sample {
        /// The mesh.
        path: PathBuf,
        /// Why not.
        cause: SampleError,
    },
    /// No slice map can be made of these points with these options.
    #[error("{}: {cause}", path.display())]
    Slices {
        /// The input.
        path: PathBuf,
        /// Why not.
        cause: SliceError,
    },
    /// A slice map could not be saved or loaded.
    #[error(transparent)]
    SliceStore(#[from] StoreError),
    /// A question that cannot be asked; exit status 2.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// A matrix that is no pose.
    #[error(
        "{place}: {refused}; give a rotation, one scale and a translation, or re-export it with more digits"
    )]
    Pose {
        /// The option that gave it.
        place: String,
        /// Why not.
        refused: PoseRefused,
    },
    /// A line of a text file is not what it should be.
    #[error("{}: line {line}: {what}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Counted from 1.
        line: u64,
        /// What is wrong there, and what belongs there.
        what: String,
    },
    /// There is no such file.
    #[error("{}: no such file; check the path", path.display())]
    Missing {
        /// Where it was looked for.
        path: PathBuf,
    },
    /// A file could not be read or written.
    #[error("{}: cannot {verb}: {}; {remedy}", path.display(), plain(cause))]
    File {
        /// The file.
        path: PathBuf,
        /// What was being done.
        verb: &'static str,
        /// What the operating system said.
        cause: io::Error,
        /// What would mend it.
        remedy: &'static str,
    },
    /// A file of the right form that does not serve.
    #[error("{}: {what}", path.display())]
    Unfit {
        /// The file.
        path: PathBuf,
        /// What is wrong with it, and what would mend it.
        what: String,
    },
    /// Threads could not be started.
    #[error("cannot start {0} threads; ask for fewer with --threads")]
    Threads(usize),
    /// Standard output is gone.
    #[error("cannot write to standard output: {}", plain(.0))]
    Stdout(io::Error),
}

impl CliError {
    /// A file that cannot be read.
    pub(crate) fn reading(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |cause| match cause.kind() {
            io::ErrorKind::NotFound => Self::Missing { path },
            _ => Self::File { path, verb: "read it", cause, remedy: "check its permissions and the disk" },
        }
    }

    /// A file that cannot be written.
    pub(crate) fn writing(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |cause| Self::File {
            path,
            verb: "write it",
            cause,
            remedy: "check that the folder exists, may be written to and has space left",
        }
    }

    /// A prepared scan that cannot be opened.
    pub(crate) fn loading(path: &Path) -> impl FnOnce(LoadError) -> Self {
        let path = path.to_owned();
        |cause| Self::Load { path, cause }
    }

    /// The status that the process ends with.
    #[must_use]
    pub fn status(&self) -> u8 {
        match self {
            Self::Usage(_) | Self::Plan(_) => 2,
            Self::Stdout(cause) if cause.kind() == io::ErrorKind::BrokenPipe => 0,
            _ => 1,
        }
    }

    /// Whether there is anything to tell: whoever closes our output has read enough.
    #[must_use]
    pub fn is_silent(&self) -> bool {
        self.status() == 0
    }
}

/// Returns what the operating system said, in lower case and without its number.
pub(crate) fn plain(cause: &io::Error) -> String {
    let text = cause.to_string();
    let text = text.split(" (os error ").next().unwrap_or_default();
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_lowercase().chain(letters).collect())
}

/// What the container says names the file already.
fn prefix(cause: &LoadError, path: &Path) -> String {
    match cause {
        LoadError::Open(_) => String::new(),
        _ => format!("{}: ", path.display()),
    }
}
