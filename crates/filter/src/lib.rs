#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod classes;
mod crop;
mod error;
mod neighbours;
mod outliers;
mod voxel;

pub use classes::classes;
pub use crop::crop;
pub use error::FilterError;
pub use neighbours::min_neighbours;
pub use outliers::remove_outliers;
pub use voxel::voxel;
