//! Flaws in the contents of a container that opens.

use thiserror::Error;

use crate::error::OpenError;

/// Why a container does not hold what is loaded from it.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LoadError {
    /// It cannot be opened, or a section is missing or damaged.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// Its sections contradict each other.
    #[error(transparent)]
    Flaw(#[from] Flaw),
}

/// A flaw in stored arrays, or in the metadata.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Flaw {
    /// Two arrays do not fit each other.
    #[error("{array} has {found} entries where {expected} belong; prepare the scan again")]
    Length {
        /// Which array.
        array: &'static str,
        /// How many entries it has.
        found: usize,
        /// How many it should have.
        expected: usize,
    },
    /// A value that no build writes, or that contradicts other values.
    #[error("{what} {index} is wrong; prepare the scan again")]
    Value {
        /// The kind of value.
        what: &'static str,
        /// The index of the point, node or block it belongs to.
        index: usize,
    },
    /// A number in the metadata that no build writes, or that contradicts the arrays.
    #[error("{what} is wrong; prepare the scan again")]
    Metadata {
        /// Which number.
        what: &'static str,
    },
    /// Options that are out of range, or that need an array which is absent.
    #[error("{cause}; prepare the scan again")]
    Options {
        /// What is out of range, or missing.
        cause: String,
    },
}

impl Flaw {
    /// Checks that an array has so many entries.
    ///
    /// # Errors
    /// [`Flaw::Length`] when it has not.
    pub fn length(array: &'static str, found: usize, expected: usize) -> Result<(), Self> {
        if found == expected { Ok(()) } else { Err(Self::Length { array, found, expected }) }
    }

    /// Turns the index of the first wrong value, if there is one, into an error.
    ///
    /// # Errors
    /// [`Flaw::Value`] with that index.
    pub fn first(what: &'static str, index: Option<usize>) -> Result<(), Self> {
        index.map_or(Ok(()), |index| Err(Self::Value { what, index }))
    }

    /// Returns the flaw of options that a build refuses, with the reason.
    pub fn options(cause: impl ToString) -> Self {
        Self::Options { cause: cause.to_string() }
    }
}
