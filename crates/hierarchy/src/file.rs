//! Sections of a saved scan, and the checks of what is read.

pub(crate) mod sanity;
pub(crate) mod sections;
