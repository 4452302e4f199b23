//! The progress of a build after each of its steps, as shares of its running time.

pub(crate) const TREE: f64 = 0.15;
pub(crate) const SPACINGS: f64 = 0.35;
pub(crate) const RADII: f64 = 0.4;
pub(crate) const FITS: f64 = 0.55;
pub(crate) const ORDERED: f64 = 0.6;
pub(crate) const LISTS: f64 = 0.66;
pub(crate) const SURFELS: f64 = 0.84;
pub(crate) const BOXES: f64 = 0.88;
pub(crate) const ENCLOSURES: f64 = 0.9;
pub(crate) const COVERINGS: f64 = 0.97;
