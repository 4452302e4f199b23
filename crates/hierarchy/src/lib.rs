#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod apart;
mod boxes;
mod build;
mod centres;
mod classes;
mod covering;
mod descent;
mod enclosure;
mod evaluate;
mod extents;
mod gather;
mod growth;
mod kind;
mod lanes;
mod leaf_block;
mod levels;
mod nearest;
mod neighbours;
mod options;
mod ordered;
mod outline;
mod part;
mod refit;
mod samples;
mod sampling;
mod sanity;
mod sections;
mod slices;
mod spacing;
mod split;
mod surfels;
mod survey;
mod topology;
mod tree;

pub use apart::{Extent, apart};
pub use boxes::{OrientedBox, Relative, SLACK};
pub use build::PointHierarchy;
pub use covering::Covering;
pub use descent::{
    Frontier, Heap, Open, PairVisitor, PlaceVisitor, Plunging, Stack, TreePair, descend, resume,
};
pub use gather::{GatherScratch, NeighbourList};
pub use growth::Growth;
pub use kind::{PointKind, SLAB, THICKNESS};
pub use leaf_block::{LeafBlock, Leaves};
pub use options::{BuildError, BuildOptions};
pub use outline::{Ball, Outline};
pub use part::Part;
pub use samples::Samples;
pub use sanity::Flaw;
pub use sections::{HierarchyMeta, LoadError};
pub use slices::Slices;
pub use survey::Survey;
pub use topology::{Children, Grandchildren, MOST_LEAF_POINTS, NodePair, Topology};
pub use tree::{Growths, NodeBounds, Siblings, Tree, whole};
