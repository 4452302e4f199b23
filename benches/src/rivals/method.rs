//! The interface that nearmiss and its rivals share in the benchmarks.

use nearmiss::Pose;

/// A boolean answer, and its cost where it is counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Reply {
    /// `true` if the two copies meet.
    pub hit: bool,
    /// Evaluations of an implicit function, or triangle or point tests of a rival.
    pub evaluations: u64,
    /// Node pairs.
    pub node_pairs: u64,
}

/// A method to decide whether two posed copies of one object meet.
pub trait Method {
    /// The name shown in tables.
    fn name(&self) -> String;

    /// Runs before each query; not timed.
    fn prepare(&mut self) {}

    /// Decides whether the copies at `a` and `b` meet. Poses are rigid. All work that depends on
    /// them is timed.
    fn ask(&mut self, a: &Pose, b: &Pose) -> Reply;
}
