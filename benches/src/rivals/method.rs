//! The interface that nearmiss and its rivals share in the benchmarks.

use nearmiss::Pose;

/// An answer to the boolean question, with what it cost where that is counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Reply {
    /// Whether the two copies meet.
    pub hit: bool,
    /// Evaluations of an implicit function; triangle or point tests of a rival.
    pub evaluations: u64,
    /// Node pairs.
    pub node_pairs: u64,
}

/// A way to answer whether two posed copies of one object meet.
pub trait Method {
    /// The name shown in tables.
    fn name(&self) -> String;

    /// Done before each question, and not timed.
    fn prepare(&mut self) {}

    /// Whether the copies at `a` and `b` meet. Poses are rigid; all work that depends on them is done here.
    fn ask(&mut self, a: &Pose, b: &Pose) -> Reply;
}
