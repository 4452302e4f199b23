//! Tests of the kinetic tree, in one program so that they link once.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod model;

mod contacts;
mod degenerate;
mod queries;
mod saved;
mod twin;
