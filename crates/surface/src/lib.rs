#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod eigen;
mod fit;
mod kernel;
mod meet;
mod neighbourhood;
mod options;
mod project;

pub use eigen::{Eigen3, symmetric_eigen};
pub use fit::{BORDER, Evaluation, Status};
pub use kernel::Kernel;
pub use meet::{Meeting, meet};
pub use neighbourhood::{Centre, Neighbourhood, PointBlock};
pub use options::{Bandwidth, SurfaceError, SurfaceOptions, SurfacePlan};
pub use project::{Projection, project};
