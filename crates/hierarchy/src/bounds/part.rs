//! The two parts of a scan that enclosures contain.

/// The set that an enclosure contains in addition to the node's points and discs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The node's part of the implicit surface.
    Surface = 0,
    /// The node's part of the obstacle.
    Obstacle = 1,
}
