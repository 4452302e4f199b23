#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

// In reading order: motion, the parts of a tree, the tree, its changes, its uses.
mod error;
mod motion;
mod plan;
mod queue;

mod counts;
mod nodes;
mod points;
mod primitives;

mod build;
mod edits;
mod events;
mod file;
mod find;
mod tree;

mod pairs;
mod separation;

mod self_separation;

pub use counts::Counts;
pub use error::KineticError;
pub use plan::FlightPlan;
pub use self_separation::SelfSeparationList;
pub use separation::{FirstContact, SeparationList};
pub use tree::KineticTree;
