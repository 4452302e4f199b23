#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod apart;
mod boxes;
mod build;
mod covering;
mod descend;
mod enclosure;
mod extents;
mod four_nodes;
mod gather;
mod growth;
mod lanes;
mod leaf_block;
mod levels;
mod neighbours;
mod options;
mod outline;
mod refit;
mod samples;
mod sampling;
mod sanity;
mod sections;
mod spacing;
mod split;
mod surfels;
mod topology;
mod wide;

pub use apart::{Extent, apart};
pub use boxes::{OrientedBox, Relative, SLACK};
pub use build::{PointHierarchy, Slices};
pub use covering::Covering;
pub use descend::{Frontier, Heap, NodePair, Split, Stack, Visitor, descend, resume};
pub use four_nodes::FourNodes;
pub use gather::GatherScratch;
pub use growth::Growth;
pub use leaf_block::{LeafBlock, Leaves};
pub use neighbours::NeighbourList;
pub use options::{BuildError, BuildOptions};
pub use outline::{Ball, Outline};
pub use samples::Samples;
pub use sanity::Flaw;
pub use sections::{HierarchyMeta, LoadError};
pub use surfels::{NormalCone, PointKind, THICKNESS};
pub use topology::{MOST_LEAF_POINTS, Node};
pub use wide::{Child, LeafVisitor, WideStack, WideTree, descend_wide, whole};
