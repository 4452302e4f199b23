//! A prepared mesh: its triangles in the order of a tree, and the boxes around them.

pub(crate) mod block;
pub(crate) mod build;
pub(crate) mod cells;
pub(crate) mod data;
pub(crate) mod deforming;
pub(crate) mod extents;
pub(crate) mod moments;
pub(crate) mod options;
pub(crate) mod part;
pub(crate) mod refit;
pub(crate) mod stored;
