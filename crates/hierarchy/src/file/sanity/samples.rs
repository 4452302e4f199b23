//! Validation of samples and coverings: an invalid sample makes a query leave its arrays, a radius
//! that is too short makes it miss a contact.

use nearmiss_geometry::NodeId;
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::ranges;

use nearmiss_store::Flaw;

use super::limits::FARTHEST;
use crate::patch::covering::{Covering, centres_of};
use crate::scan::build::PointHierarchy;

/// Allowance for the rounding of a mean of radii.
const MEAN: f32 = 1.0 + 1e-5;

/// Stride of the samples of a node's children that are tested against its covering. Testing all
/// would take as long as the rest of the checks.
const STEP: usize = 4;

/// Checks that the samples of each node are distinct points of its own, that the lengths of its
/// covering are valid (possibly infinite), that the covering contains some of the samples of its
/// children, and that its spacing is at most the greatest local radius under it.
pub(super) fn check(scan: &PointHierarchy) -> Result<(), Flaw> {
    let topology = scan.topology();
    let found =
        ranges(topology.len(), |ids| ids.map(|id| NodeId(id32(id))).try_for_each(|id| check_node(scan, id)));
    found.into_iter().collect()
}

fn check_node(scan: &PointHierarchy, id: NodeId) -> Result<(), Flaw> {
    let (topology, arrays, covering) = (scan.topology(), scan.arrays(), &scan.arrays.coverings[id.index()]);
    let wrong = |what| Err(Flaw::Value { what, index: id.index() });
    let Covering { radius, sampling, spacing } = *covering;
    let lengths = (radius >= 0.0) & (sampling >= 0.0) & (spacing >= 0.0) & (sampling <= radius);
    if !(lengths & (spacing <= FARTHEST)) || spacing > arrays.tree.reach(id) * MEAN {
        return wrong("the covering of node");
    }
    if topology.is_leaf(id) {
        return Ok(());
    }
    let points = topology.points(id);
    let count = scan.meta.samples as usize;
    let list = &scan.arrays.sample_lists[id.index() * count..][..count];
    let is_own = |i: &u32| points.contains(&(*i as usize));
    let ascends = points.len() <= count || list.windows(2).all(|two| two[0] < two[1]);
    if !(list.iter().all(is_own) && ascends) {
        return wrong("a sample of node");
    }
    let centres = centres_of(arrays.samples(id.index()), scan.positions());
    for child in topology.children(id).iter() {
        let samples = arrays.samples(child.index());
        let away = samples.iter().step_by(STEP).map(|i| centres.nearest_sq(scan.positions()[i]));
        if away.fold(0.0, f32::max).sqrt() > radius {
            return wrong("the covering of node");
        }
    }
    Ok(())
}
