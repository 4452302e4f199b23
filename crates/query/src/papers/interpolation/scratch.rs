//! What an interpolation search works with.

use nearmiss_graph::LazyPath;

use super::partners::Drawn;
use super::sides::Cache;
use super::volume::Volume;

/// Reused between queries; never influences an answer.
#[derive(Debug, Clone, Default)]
pub(crate) struct InterpolationScratch {
    pub(crate) volume: Volume,
    pub(crate) drawn: Drawn,
    pub(crate) path: LazyPath,
    pub(crate) sides: Cache,
    /// Points whose neighbourhood in b is near, nearest first, and where those ended that were drawn there.
    pub(crate) near: Vec<(f64, u32, u32)>,
    pub(crate) seen: Vec<[u32; 2]>,
    /// Points about two surfel radii away from one.
    pub(crate) annulus: Vec<u32>,
    /// Edges on which searches ended, in order.
    pub(crate) crossed: Vec<[u32; 2]>,
}
