//! Predicates, contacts and distances of triangles against exact arithmetic; clean meshes.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod cases;
mod clean;
mod contact;
mod distance;
mod exact;
mod meet;
