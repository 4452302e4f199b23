#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod adjacency;
mod border;
mod components;
mod dynamic;
mod graph;
mod influence;
mod options;
mod parallel;
mod prune;
mod sanity;
mod sections;

pub use adjacency::Adjacency;
pub use dynamic::{DynamicGraph, Touched};
pub use graph::{GraphCounts, PointGraph};
pub use options::{GraphError, GraphOptions, Prune};
pub use sanity::Flaw;
pub use sections::{GraphMeta, LoadError};
