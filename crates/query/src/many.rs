//! Batches of questions and worlds of many scans, meshes and shapes.

pub(crate) mod batch;
pub(crate) mod body;
pub(crate) mod bounds;
pub(crate) mod nearest;
pub(crate) mod penetration;
pub(crate) mod touch;
pub(crate) mod world;
