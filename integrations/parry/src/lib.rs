#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

/// The example of the guide compiles and runs.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/guide/rapier.md")]
struct Guide;

mod convert;
mod dispatcher;
mod manifolds;
mod parts;
mod scan_shape;

pub use convert::{from_pose, to_pose};
pub use dispatcher::ScanDispatcher;
pub use scan_shape::ScanShape;
