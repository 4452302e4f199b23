#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod convert;
mod dispatcher;
mod manifolds;
mod parts;
mod scan_shape;

pub use convert::{from_pose, to_pose};
pub use dispatcher::ScanDispatcher;
pub use scan_shape::ScanShape;
