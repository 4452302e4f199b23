//! The facade: everything is one program, which links once.

mod analytic;
mod certificates;
mod curves;
mod geodesic;
mod hostile;
mod invariance;
mod obstacles;
mod saved;
mod threads;
