#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod block;
mod cubes;
mod tree;

pub use block::PointBlock;
pub use cubes::Cubes;
pub use fearless_simd::Level;
pub use tree::{
    BlockBoxes, BlockGrid, BlockTree, BoxBody, BoxGrid, BoxRay, BoxStarts, BoxTree, Cones, CutBox,
    CutBoxVisitor, Nearest, Neighbour, Overlaps, Skeleton, Slab,
};
