#![doc = include_str!("../README.md")]
// Every function is called from C: names are exported, arrays come as pointers, and handles are
// freed through them. Each block of unsafe code says what its caller promised.
#![expect(unsafe_code, reason = "the border to C")]

// Bottom up.
mod handle;
mod pointer;
pub mod status;

pub mod file;
pub mod pose;

pub mod mesh;
pub mod scan;

pub mod hint;
pub mod options;
pub mod plan;
pub mod scratch;

pub mod answer;
pub mod collide;

pub mod shape;
pub mod target;

pub mod penetration;

pub mod cloud;
pub mod motion;
pub mod slices;
pub mod walk;
pub mod world;
