//! What is wrong with a hierarchy.

use thiserror::Error;

/// No stored length exceeds this, so that no square of one overflows. Frames keep coordinates below 2³⁴.
pub(super) const FARTHEST: f32 = (1_u64 << 40) as f32;

/// What is wrong with a hierarchy.
#[derive(Debug, Clone, PartialEq, Error)]
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
    /// A node's children or points are not there, or not its own.
    #[error("node {node} is not a node of this tree; prepare the scan again")]
    Node {
        /// Its id.
        node: usize,
    },
    /// A number is none that a build writes, or contradicts what it says about others.
    #[error("{what} {index} is wrong; prepare the scan again")]
    Value {
        /// Which number, and of what.
        what: &'static str,
        /// Whose.
        index: usize,
    },
    /// A number about the whole scan is none that a build writes, or contradicts the arrays.
    #[error("{what} is wrong; prepare the scan again")]
    Metadata {
        /// Which number.
        what: &'static str,
    },
}
