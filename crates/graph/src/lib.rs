#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod adjacency;

pub use adjacency::Adjacency;
