//! Queries of two meshes: exact collision, all contacts, distance.

pub(crate) mod answer;
pub(crate) mod collide;
pub(crate) mod distance;
pub(crate) mod mesh_pair;
pub(crate) mod pair;
pub(crate) mod placed;
pub(crate) mod triangle_pairs;
