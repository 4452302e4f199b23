#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod aabb;
mod cloud;
mod cloud_error;
mod frame;
mod id;
mod intake;
mod motion;
mod pose;
mod scanner;
mod triangles;

pub use aabb::Aabb;
pub use cloud::{Coordinate, Dropped, PointCloud};
pub use cloud_error::CloudError;
pub use frame::Frame;
pub use id::{NodeId, PointId};
pub use intake::{Intake, LEAST_POINTS, Repeated};
pub use motion::{Motion, MotionError, Screw};
pub use nalgebra;
pub use pose::{Pose, PoseError};
pub use scanner::Scanner;
pub use triangles::{MeshError, TriangleMesh};
