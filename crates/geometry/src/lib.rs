#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod aabb;
mod cloud;
mod frame;
mod id;
mod pose;
mod scanner;
mod triangles;

pub use aabb::Aabb;
pub use cloud::{CloudError, Coordinate, Dropped, PointCloud};
pub use frame::Frame;
pub use id::{NodeId, PointId};
pub use nalgebra;
pub use pose::{Pose, PoseError};
pub use scanner::Scanner;
pub use triangles::{MeshError, TriangleMesh};
