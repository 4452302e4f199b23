//! Tests of the graph, in one program so that they link once.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod clouds;
mod geodesics;
mod kernel;
mod lazy_paths;
mod levels;
mod looks;
mod orientation;
mod stored;
mod stored_paths;
mod twin;
mod updates;
