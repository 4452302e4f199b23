//! Many questions and many scans.

pub(crate) mod batch;
pub(crate) mod world;
