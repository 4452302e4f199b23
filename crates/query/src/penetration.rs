//! How far, and in which direction, to shift one thing out of another.
//!
//! The search is the same for two meshes, two scans, a scan and a mesh, and a scan and a shape. Each is a
//! [`Probe`] that answers the search's questions.
//!
//! [`Probe`]: probe::Probe

mod across;
pub(crate) mod answer;
pub(crate) mod apart;
pub(crate) mod cover;
mod deepest;
pub(crate) mod interior;
pub(crate) mod probe;
pub(crate) mod scans;
pub(crate) mod search;
pub(crate) mod shapes;
pub(crate) mod survey;
