//! Convex shapes and rays against the obstacle of a scan.

pub(crate) mod answer;
pub(crate) mod as_shape;
pub(crate) mod between;
pub(crate) mod cast;
pub(crate) mod closest;
pub(crate) mod contacts;
pub(crate) mod core;
pub(crate) mod depths;
pub(crate) mod descent;
pub(crate) mod distance;
pub(crate) mod elements;
pub(crate) mod gather;
pub(crate) mod hint;
pub(crate) mod inner;
pub(crate) mod lanes;
pub(crate) mod meeting;
pub(crate) mod place;
pub(crate) mod placed;
pub(crate) mod plan;
pub(crate) mod ray;
pub(crate) mod ray_lanes;
pub(crate) mod refine;
pub(crate) mod scratch;
pub(crate) mod shape;
pub(crate) mod sides;
pub(crate) mod touch;
