#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod adjacency;
mod border;
mod components;
mod graph;
mod influence;
mod options;
mod parallel;
mod prune;

pub use adjacency::Adjacency;
pub use graph::{GraphCounts, PointGraph};
pub use options::{GraphError, GraphOptions, Prune};
