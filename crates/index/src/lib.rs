#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod block;
mod cubes;
mod tree;

pub use block::PointBlock;
pub use cubes::Cubes;
pub use fearless_simd::Level;
pub use tree::{
    BlockBoxes, BlockGrid, BlockTree, BoxRay, BoxTree, Cones, Nearest, Neighbour, Overlaps, RayBox,
    RayVisitor, Skeleton, Slab,
};
