//! Bounding volumes: oriented boxes, growths from boxes to enclosures, and relative poses.

pub(crate) mod boxes;
pub(crate) mod cells;
pub(crate) mod growth;
pub(crate) mod lanes;
pub(crate) mod part;
