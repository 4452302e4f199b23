//! Tests of the facade, in one program so that they link once.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod analytic;
mod certificates;
mod curves;
mod geodesic;
mod hostile;
mod invariance;
mod moving_meshes;
mod moving_scans;
mod obstacles;
mod resting;
mod saved;
mod saved_meshes;
mod threads;
