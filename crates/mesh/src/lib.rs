#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod lattice;
mod sample;
mod triangle;

pub use lattice::{Lattice, lattice_samples};
pub use sample::{SampleError, SampleOptions, SampleSize, sample};
