//! Files damaged by accident or on purpose. Opening one yields an error or a scan that answers in
//! bounded time. Answers are never wrong if checksums are compared.
#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "a test may panic, and tell what it counted")]

mod cases;
mod cost;
mod damage;
mod exercise;
pub(crate) mod exercise_mesh;
mod faults;
mod graph;
mod meshes;
mod mutations;
mod repair;
