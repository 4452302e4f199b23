//! Queries of a mesh and a scan: collision, all contacts, distance, penetration.

pub(crate) mod collide;
pub(crate) mod course;
pub(crate) mod distance;
pub(crate) mod hint;
pub(crate) mod leaves;
pub(crate) mod mesh_scan_pair;
pub(crate) mod pair;
pub(crate) mod pairing;
pub(crate) mod penetration;
pub(crate) mod plan;
pub(crate) mod search;
pub(crate) mod sweep;
pub(crate) mod thickened;
pub(crate) mod triangle_lanes;
pub(crate) mod witness;
