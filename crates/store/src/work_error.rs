//! `WorkError`: the error of creating or keeping an array of a workspace.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use crate::words::{bytes, plain};

/// Error of creating or keeping an array of a [`Workspace`](crate::Workspace).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WorkError {
    /// The file or folder; empty for arrays in memory.
    pub path: PathBuf,
    /// The step that failed, as a verb phrase.
    pub step: &'static str,
    /// Kind of the operating system's error.
    pub kind: io::ErrorKind,
    /// Message of the operating system's error.
    pub cause: String,
}

impl fmt::Display for WorkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.path.as_os_str().is_empty() {
            write!(f, "{}: ", self.path.display())?;
        }
        let remedy = match self.kind {
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
                "free some space, or write the output to another disk"
            }
            io::ErrorKind::OutOfMemory => "work on disk, or with less detail",
            io::ErrorKind::WouldBlock => "wait for that process to end",
            io::ErrorKind::InvalidData => "remove the folder and start again",
            io::ErrorKind::InvalidInput => "close the stage with a smaller value of plain types",
            io::ErrorKind::Unsupported => "enable the feature `mmap` of nearmiss-store",
            _ => "check the path and its permissions",
        };
        write!(f, "cannot {} ({}); {remedy}", self.step, self.cause)
    }
}

impl std::error::Error for WorkError {}

impl WorkError {
    pub(crate) fn new(path: &Path, step: &'static str) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |cause| Self { path, step, kind: cause.kind(), cause: plain(&cause) }
    }

    /// The error of an allocation that failed.
    pub(crate) fn memory(length: usize) -> Self {
        let kind = io::ErrorKind::OutOfMemory;
        let cause = format!("out of memory: {} needed", bytes(length));
        Self { path: PathBuf::new(), step: "allocate an array", kind, cause }
    }
}
