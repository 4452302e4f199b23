//! Placed scans, two of them in relative motion, and what a search through them has cost.

pub(crate) mod bounds;
pub(crate) mod likelihood;
pub(crate) mod meter;
pub(crate) mod motion;
pub(crate) mod placed;
pub(crate) mod prepared;
pub(crate) mod scan_pair;
pub(crate) mod shape_index;
