//! The tree over the points: its topology, its split, and the boxes of siblings side by side.

pub(crate) mod axes;
pub(crate) mod cut;
pub(crate) mod items;
pub(crate) mod split;
pub(crate) mod topology;
pub(crate) mod wide;
