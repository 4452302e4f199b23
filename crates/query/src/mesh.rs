//! Queries of two meshes: exact collision, all contacts, distance, motions.

pub(crate) mod answer;
pub(crate) mod collide;
pub(crate) mod course;
pub(crate) mod distance;
pub(crate) mod foot;
pub(crate) mod hint;
pub(crate) mod itself;
pub(crate) mod mesh_pair;
pub(crate) mod odds;
pub(crate) mod pair;
pub(crate) mod pairing;
pub(crate) mod penetration;
pub(crate) mod placed;
pub(crate) mod prepared;
pub(crate) mod quality;
pub(crate) mod region;
pub(crate) mod solid;
pub(crate) mod time_critical;
pub(crate) mod triangle_pairs;
