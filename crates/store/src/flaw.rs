//! Errors of loading the contents of a container.

use thiserror::Error;

use crate::error::OpenError;
use crate::words::counted;

/// Error of loading data from a container.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LoadError {
    /// The container cannot be opened, or a section is missing or damaged.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// The sections contradict each other.
    #[error(transparent)]
    Flaw(#[from] Flaw),
}

/// An inconsistency in the stored arrays or the metadata.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Flaw {
    /// An array has the wrong length.
    #[error(
        "expected {} in {array}, got {found}; prepare the scan again",
        counted(expected, "entry", "entries")
    )]
    Length {
        /// Name of the array.
        array: &'static str,
        /// Number of entries.
        found: usize,
        /// Expected number of entries.
        expected: usize,
    },
    /// A value is out of range, or contradicts other values.
    #[error("{what} {index} is invalid; prepare the scan again")]
    Value {
        /// Name of the value.
        what: &'static str,
        /// Index of its point, node or block.
        index: usize,
    },
    /// A number in the metadata is out of range, or contradicts the arrays.
    #[error("{what} is invalid; prepare the scan again")]
    Metadata {
        /// Name of the number.
        what: &'static str,
    },
    /// The options are out of range, or need an array that is missing.
    #[error("{cause}; prepare the scan again")]
    Options {
        /// Message of the failed check.
        cause: String,
    },
}

impl Flaw {
    /// Checks the length of an array.
    ///
    /// # Errors
    /// Returns [`Flaw::Length`] if `found` differs from `expected`.
    pub fn length(array: &'static str, found: usize, expected: usize) -> Result<(), Self> {
        if found == expected { Ok(()) } else { Err(Self::Length { array, found, expected }) }
    }

    /// Returns an error if there is an invalid value.
    ///
    /// # Errors
    /// Returns [`Flaw::Value`] if `index`, the index of the first invalid value, is `Some`.
    pub fn first(what: &'static str, index: Option<usize>) -> Result<(), Self> {
        index.map_or(Ok(()), |index| Err(Self::Value { what, index }))
    }

    /// Creates a [`Flaw::Options`] with the given cause.
    pub fn options(cause: impl ToString) -> Self {
        Self::Options { cause: cause.to_string() }
    }
}
