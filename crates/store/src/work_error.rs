//! Why an array of a workspace could not be made or kept.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// An array of a [`Workspace`](crate::Workspace) could not be made or kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WorkError {
    /// The file or folder; empty if arrays are in memory.
    pub path: PathBuf,
    /// The step that failed, as a verb phrase.
    pub step: &'static str,
    /// The kind of the system's answer.
    pub kind: io::ErrorKind,
    /// The system's words.
    pub cause: String,
}

impl fmt::Display for WorkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.path.as_os_str().is_empty() {
            write!(f, "{}: ", self.path.display())?;
        }
        write!(f, "cannot {}: {}", self.step, self.cause)?;
        match self.kind {
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
                f.write_str("; free some space, or write the output to another disk")
            }
            io::ErrorKind::OutOfMemory => f.write_str("; work in a folder, or with less detail"),
            io::ErrorKind::WouldBlock => f.write_str("; wait for the other process to end"),
            _ => Ok(()),
        }
    }
}

impl std::error::Error for WorkError {}

impl WorkError {
    pub(crate) fn new(path: &Path, step: &'static str) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |cause| Self { path, step, kind: cause.kind(), cause: cause.to_string() }
    }

    /// The system gives no memory.
    pub(crate) fn memory(bytes: usize) -> Self {
        let kind = io::ErrorKind::OutOfMemory;
        let cause = format!("the system gives no {bytes} bytes");
        Self { path: PathBuf::new(), step: "get memory for an array", kind, cause }
    }
}
