//! Where scanners stood.

use std::ops::Range;

/// Where a scanner stood while it took some points of a cloud's input.
#[derive(Debug, Clone, PartialEq)]
pub struct Scanner {
    /// Its position in the caller's frame.
    pub position: [f64; 3],
    /// Its points, by their indices in the input.
    pub points: Range<usize>,
}
