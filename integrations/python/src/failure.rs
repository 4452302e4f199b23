//! Errors of the library as exceptions of Python: `OSError` for the system's, else `ValueError`.

use std::fmt::Display;
use std::io;

use nearmiss::io::ReadError;
use nearmiss::slices::StoreError;
use nearmiss::store::{ContainerFault, OpenError, WriteError};
use nearmiss::{LoadError, SaveError};
use pyo3::PyErr;
use pyo3::exceptions::{PyOSError, PyValueError};

/// Returns a `ValueError` with the message of an error.
pub(crate) fn refused(cause: impl Display) -> PyErr {
    PyValueError::new_err(cause.to_string())
}

/// Returns an `OSError` with the number of the system's error, such as a `FileNotFoundError`.
fn system(cause: &impl Display, system: &io::Error) -> PyErr {
    match system.raw_os_error() {
        Some(number) => PyOSError::new_err((number, cause.to_string())),
        None => PyOSError::new_err(cause.to_string()),
    }
}

/// Returns the exception of a file that cannot be read.
pub(crate) fn unreadable(cause: ReadError) -> PyErr {
    match &cause {
        ReadError::Io { cause: inner, .. } => system(&cause, inner),
        _ => refused(cause),
    }
}

/// Returns the exception of a prepared file that cannot be opened.
pub(crate) fn unloadable(cause: LoadError) -> PyErr {
    match &cause {
        LoadError::Open(OpenError { fault: ContainerFault::Io { source }, .. }) => system(&cause, source),
        _ => refused(cause),
    }
}

/// Returns the exception of a file that cannot be written.
pub(crate) fn unwritable(cause: SaveError) -> PyErr {
    match &cause {
        WriteError::Io { source, .. } => system(&cause, source),
        _ => PyOSError::new_err(cause.to_string()),
    }
}

/// Returns the exception of a folder of slices that cannot be read or written.
pub(crate) fn unstored(cause: StoreError) -> PyErr {
    match &cause {
        StoreError::Open(OpenError { fault: ContainerFault::Io { source }, .. })
        | StoreError::Slice { cause: OpenError { fault: ContainerFault::Io { source }, .. }, .. } => {
            system(&cause, source)
        }
        StoreError::Folder { cause: inner, .. } => system(&cause, inner),
        StoreError::Write(WriteError::Io { source, .. }) => system(&cause, source),
        _ => refused(cause),
    }
}
