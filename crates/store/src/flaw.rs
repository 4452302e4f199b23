//! What can be wrong with the arrays of a container that opens.

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

/// What is wrong with stored arrays, or with what is stored beside them.
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
    /// A number is none that a build writes, or contradicts what it says about others.
    #[error("{what} {index} is wrong; prepare the scan again")]
    Value {
        /// Which number, and of what.
        what: &'static str,
        /// Whose.
        index: usize,
    },
    /// A number about the whole is none that a build writes, or contradicts the arrays.
    #[error("{what} is wrong; prepare the scan again")]
    Metadata {
        /// Which number.
        what: &'static str,
    },
    /// What it was built with is out of range, or asks for what is not there.
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
