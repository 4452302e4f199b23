#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod adjacency;
mod border;
mod close_list;
mod close_pairs;
mod components;
mod dynamic;
mod geodesic;
mod graph;
mod influence;
mod kernel;
mod lazy_path;
mod length;
mod levels;
mod options;
mod orient;
mod path_sections;
mod prune;
mod sanity;
mod sections;
mod surface_graph;

pub use adjacency::Adjacency;
pub use close_list::{Close, CloseList};
pub use close_pairs::ClosePairs;
pub use dynamic::{DynamicGraph, Touched};
pub use geodesic::{GeodesicScratch, Reached};
pub use graph::{GraphCounts, PointGraph};
pub use kernel::{Foot, GeodesicKernel, KernelScratch};
pub use lazy_path::{LazyPath, PathPoint};
pub use length::{Network, edge_lengths};
pub use levels::{LevelCells, LevelScratch, Levels};
pub use options::{GraphError, GraphOptions, Paths, Prune};
pub use orient::{Decision, Orientation, OrientedPart, Sides, Viewpoint, orient};
pub use sections::GraphMeta;
pub use surface_graph::{SurfaceGraph, SurfaceGraphMeta, SurfaceSamples};
