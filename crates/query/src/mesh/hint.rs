//! The state that queries of a pair of meshes pass on to the next one.

use crate::pair::clearance::Clearance;

/// The triangles that met, or were nearest, in the last query of a pair of meshes, and how far apart
/// the meshes were. The next query compares these triangles first; while the meshes have moved less
/// than they were apart, it needs no search. A hint never changes a verdict or a distance.
///
/// Keep one for each pair of meshes. A hint of other meshes is ignored.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MeshHint {
    pub(crate) met: Option<[u32; 2]>,
    pub(crate) nearest: Option<[u32; 2]>,
    pub(crate) clear: Option<Clearance>,
}
