#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod clean;
mod contact;
mod distance;
mod flat;
mod lattice;
mod meet;
mod nearest;
mod orientation;
mod sample;
mod triangle;
mod weld;
mod wide;

pub use clean::{CleanError, CleanMesh, CleanOptions, CleanReport, validate};
pub use contact::{TriangleContact, triangle_contact, unit_normal};
pub use distance::{TriangleDistance, triangle_distance};
pub use lattice::{Lattice, lattice_samples};
pub use meet::triangles_meet;
pub use nearest::nearest_on_triangle;
pub use sample::{SampleError, SampleOptions, SamplePattern, SampleSize, sample};
pub use triangle::Corners;
