//! The surface: everything is one program, which links once.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod absurd;
mod conformance;
mod eigen;
