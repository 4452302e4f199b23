//! Sections of a saved scan, and the validation of loaded ones.

pub(crate) mod sanity;
pub(crate) mod sections;
