//! `Counts`: the work that a kinetic tree has done.

use serde::{Deserialize, Serialize};

/// The work of a kinetic tree since it was built. Differences of two values measure what happened
/// in between.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Counts {
    /// Events in leaves: one point overtook another.
    pub leaf_events: u64,
    /// Events of inner nodes: the extremal point of one child overtook that of the other.
    pub tree_events: u64,
    /// Legs of plans that came into effect.
    pub legs: u64,
    /// Plans that the caller replaced.
    pub plans: u64,
    /// Primitives inserted.
    pub insertions: u64,
    /// Primitives removed.
    pub removals: u64,
    /// Nodes made by splits and by rebuilding subtrees.
    pub rebuilt: u64,
    /// Changes of one side of one bounding volume: its extremal point became another one.
    pub updates: u64,
    /// Certificates computed: those of events and those of changed plans.
    pub certificates: u64,
    /// Nodes whose earliest event was compared again, on the way from an event to the root.
    pub steps: u64,
}

impl Counts {
    /// Returns the number of events: those in leaves and those of inner nodes.
    #[must_use]
    pub const fn events(&self) -> u64 {
        self.leaf_events + self.tree_events
    }

    /// Returns `true` if counting on will not overflow.
    pub(crate) fn is_plausible(&self) -> bool {
        let Self { leaf_events, tree_events, legs, plans, insertions, .. } = *self;
        let Self { removals, rebuilt, updates, certificates, steps, .. } = *self;
        let events = [leaf_events, tree_events, legs, plans, insertions];
        let work = [removals, rebuilt, updates, certificates, steps];
        events.into_iter().chain(work).all(|count| count < 1 << 62)
    }
}
