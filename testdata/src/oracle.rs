//! Naive twins in double precision, written from the formulas alone: every point against every
//! point.
//!
//! The twins share no code with the libraries they test. Everything is O(n) per evaluation and
//! O(n²) per cloud, which is fast enough up to some ten thousand points.

mod covering;
mod disc;
mod eigen;
mod proximity;
mod radii;
mod side;
mod slices;
mod surface;
mod thickened;

pub(crate) use radii::count;

pub use covering::{Solid, clearance, covering_radius, to_nearest};
pub use disc::{Crossing, Disc, crossing};
pub use eigen::{Eigen, symmetric_eigen};
pub use proximity::{Proximity, proximity};
pub use radii::{
    GREATEST_RANK, LINE_RATIO, RANK, SLOPE, Spacing, looks_like_a_line, quantile, radii, smoothed, spacing,
    spacings,
};
pub use side::{Signs, falls, winding};
pub use slices::{SliceTwin, TwinVoxel};
pub use surface::{BORDER, Bandwidth, Evaluation, GAP, Kernel, Parameters, Status, SurfaceTwin, THIN};
pub use thickened::{Nearest, least_distance, nearest, touches};
