#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod block;
mod tree;

pub use block::PointBlock;
pub use fearless_simd::Level;
pub use tree::{BlockBoxes, BlockGrid, BlockTree, Cones, Nearest, Neighbour, Overlaps, Skeleton};
