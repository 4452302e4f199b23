//! Data of the points of a node: tangent discs, samples, coverings, enclosures.

pub(crate) mod alignment;
pub(crate) mod centres;
pub(crate) mod classes;
pub(crate) mod covering;
pub(crate) mod enclosure;
pub(crate) mod extents;
pub(crate) mod parts;
pub(crate) mod pixels;
pub(crate) mod samples;
pub(crate) mod sectors;
pub(crate) mod surfels;
