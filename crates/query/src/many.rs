//! Batches of questions and worlds of many scans.

pub(crate) mod batch;
pub(crate) mod world;
