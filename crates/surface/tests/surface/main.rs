//! The surface: everything is one program, which links once.

mod absurd;
mod conformance;
mod eigen;
