//! Batches of questions and worlds of many scans and meshes.

pub(crate) mod batch;
pub(crate) mod body;
pub(crate) mod nearest;
pub(crate) mod world;
