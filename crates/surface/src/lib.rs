#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod eigen;
mod eigen_batch;
mod eigen_cholesky;
mod fit;
mod gathered;
mod kernel;
mod meet;
mod neighbourhood;
mod options;
mod project;
mod side_by_side;

pub use eigen::{Eigen3, symmetric_eigen};
pub use eigen_batch::{EigenBlock, MatrixBlock, symmetric_eigen_batch};
pub use eigen_cholesky::{LeastEigen, cubic_cholesky_eigen};
pub use fearless_simd::Level;
pub use fit::{BORDER, Evaluation, Status};
pub use gathered::Gathered;
pub use kernel::Kernel;
pub use meet::{Meeting, meet, step_onto_both};
pub use neighbourhood::{Centre, HalfBlock, MeasuredBlock, Moments, Neighbourhood};
pub use options::{Bandwidth, Metric, SurfaceError, SurfaceOptions, SurfacePlan};
pub use project::{Projection, project};
pub use side_by_side::SideBySide;
