//! Working memory of an interpolation search.

use nearmiss_graph::LazyPath;

use super::partners::Drawn;
use super::sides::Cache;
use super::volume::Volume;

/// Memory that is reused between queries; never influences an answer.
#[derive(Debug, Clone, Default)]
pub(crate) struct InterpolationScratch {
    pub(crate) volume: Volume,
    pub(crate) drawn: Drawn,
    pub(crate) path: LazyPath,
    pub(crate) sides: Cache,
    /// Drawn points near b, nearest first: distance, point, nearest point of b.
    pub(crate) near: Vec<(f64, u32, u32)>,
    pub(crate) seen: Vec<[u32; 2]>,
    /// Points about two surfel radii away from a drawn point.
    pub(crate) annulus: Vec<u32>,
    /// Edges on which searches ended, in ascending order.
    pub(crate) crossed: Vec<[u32; 2]>,
}
