//! Queries of a placed convex shape and a scan, a mesh, or another shape.

pub(crate) mod mesh;
pub(crate) mod mesh_distance;
pub(crate) mod mesh_penetration;
pub(crate) mod scan;
pub(crate) mod shapes;
