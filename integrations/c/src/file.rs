//! Files of scans and meshes: how they are checked, and why they fail.

use nearmiss::io::ReadError;
use nearmiss::store::{ContainerFault, OpenError, WriteError};
use nearmiss::{Check, LoadError};

use crate::status::{Failure, Status};

/// How the bytes of a prepared scan or mesh are checked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub enum Checks {
    /// Checksums and every number.
    Full = 0,
    /// The layout, for files from a trusted source; takes the same time for any size.
    Structure = 1,
}

/// The failure to read a file.
pub(crate) fn unreadable(cause: ReadError) -> Failure {
    let is_of_system = matches!(cause, ReadError::Io { .. } | ReadError::NotAFile { .. });
    Failure::new(if is_of_system { Status::Io } else { Status::Data }, cause)
}

/// The failure to load a prepared file.
pub(crate) fn unloadable(cause: LoadError) -> Failure {
    let is_of_system = matches!(cause, LoadError::Open(OpenError { fault: ContainerFault::Io { .. }, .. }));
    Failure::new(if is_of_system { Status::Io } else { Status::Data }, cause)
}

/// The failure to write a file.
pub(crate) fn unwritable(cause: WriteError) -> Failure {
    Failure::new(Status::Io, cause)
}

/// Returns the checks that a number stands for.
pub(crate) fn check(checks: i32) -> Result<Check, Failure> {
    match checks {
        0 => Ok(Check::Full),
        1 => Ok(Check::Structure),
        other => {
            Err(Failure::argument(format_args!("expected checks of 0 (full) or 1 (structure), got {other}")))
        }
    }
}
