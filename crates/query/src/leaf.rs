//! Comparison of the points of two leaves.

pub(crate) mod ball_pair;
pub(crate) mod crossing;
pub(crate) mod disc_pair;
pub(crate) mod disc_triangle;
pub(crate) mod nearest_points;
pub(crate) mod point_gap;
pub(crate) mod point_pair;
pub(crate) mod scan_pairing;
pub(crate) mod surfel_pair;
