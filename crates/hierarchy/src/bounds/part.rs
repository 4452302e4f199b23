//! Surface or obstacle.

/// What an enclosure of a node holds beside its points and their discs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The node's part of the implicit surface.
    Surface = 0,
    /// The node's part of the obstacle.
    Obstacle = 1,
}
