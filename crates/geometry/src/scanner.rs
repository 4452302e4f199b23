//! Positions of the scanners that took a cloud.

use std::ops::Range;

/// Position of a scanner while it took some points of a cloud's input.
#[derive(Debug, Clone, PartialEq)]
pub struct Scanner {
    /// Position of the scanner in the caller's frame.
    pub position: [f64; 3],
    /// Indices of the scanner's points in the input.
    pub points: Range<usize>,
}
