//! Bounding volumes: oriented boxes, how far enclosures exceed them, and relative motion.

pub(crate) mod boxes;
pub(crate) mod growth;
pub(crate) mod lanes;
pub(crate) mod part;
