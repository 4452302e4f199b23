//! Typed ids. They are newtypes over `u32`, so that a node's number cannot be mistaken for a
//! point's.

use serde::{Deserialize, Serialize};

/// Index of a point in the caller's input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct PointId(pub u32);

/// Index of a node in its hierarchy; 0 is the root.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct NodeId(pub u32);

impl PointId {
    /// The id as an index into a slice.
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

impl NodeId {
    /// The root of every hierarchy.
    pub const ROOT: Self = Self(0);

    /// The id as an index into a slice.
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}
