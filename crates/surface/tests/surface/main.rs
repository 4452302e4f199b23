//! Tests of the surface, in one program so that they link once.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod absurd;
mod conformance;
mod eigen;
mod gathered;
