//! Data of single points: spacing, kind, support, leaf records.

pub(crate) mod affine;
pub(crate) mod disc;
pub(crate) mod gather;
pub(crate) mod kind;
pub(crate) mod leaf_block;
pub(crate) mod neighbours;
pub(crate) mod raster;
pub(crate) mod spacing;
pub(crate) mod stored_point;
