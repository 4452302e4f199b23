//! Placed scans, pairs of them under a relative pose, and the cost of a search.

pub(crate) mod bounds;
pub(crate) mod cell_table;
pub(crate) mod cell_volume;
pub(crate) mod clearance;
pub(crate) mod likelihood;
pub(crate) mod meter;
pub(crate) mod moving;
pub(crate) mod pairing;
pub(crate) mod placed;
pub(crate) mod placed_balls;
pub(crate) mod prepared;
pub(crate) mod relative_pose;
pub(crate) mod scan_pair;
pub(crate) mod shape_index;
