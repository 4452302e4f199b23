//! Samples and coverings: a sample that is not there makes a query leave its arrays, a radius that is too
//! short one miss a contact.

use super::flaw::{FARTHEST, Flaw};
use crate::build::PointHierarchy;
use crate::covering::{Covering, centres_of};

/// What rounding may make of a mean of radii.
const MEAN: f32 = 1.0 + 1e-5;

/// Checks that the samples of each node are points of its own, and the radii lengths, if infinite ones. One
/// pass; the tree is sound and the arrays as long as they must be.
pub(super) fn check_ranges(scan: &PointHierarchy) -> Result<(), Flaw> {
    let lists = scan.sample_lists.chunks_exact(scan.samples_a_node as usize);
    let inner = scan.nodes.iter().enumerate().filter(|(_, node)| !node.is_leaf());
    for ((id, node), list) in inner.zip(lists) {
        let mut beyond = 0;
        for i in list {
            beyond |= u32::from(i.wrapping_sub(node.first) >= node.count);
        }
        if beyond != 0 {
            return Err(Flaw::Value { what: "a sample of node", index: id });
        }
    }
    let is_sound = |c: &Covering| {
        let lengths = (c.radius >= 0.0) & (c.sampling >= 0.0) & (c.spacing >= 0.0);
        lengths & (c.sampling <= c.radius) & (c.spacing <= FARTHEST)
    };
    let wrong = scan.coverings.iter().position(|c| !is_sound(c));
    wrong.map_or(Ok(()), |index| Err(Flaw::Value { what: "the covering of node", index }))
}

/// Of the samples of a node's children every so many-th is looked for in its covering: all would take as long
/// as the rest of the checks.
const STEP: usize = 4;

/// Checks that the samples of each node differ, that its covering contains some of those of its children, and
/// that its spacing is one of its points': given that the ranges are sound.
pub(super) fn check(scan: &PointHierarchy) -> Result<(), Flaw> {
    let slices = scan.slices();
    let wrong = |what, index| Err(Flaw::Value { what, index });
    for (id, node) in scan.nodes.iter().enumerate() {
        if scan.coverings[id].spacing > scan.boxes[id].reach * MEAN {
            return wrong("the covering of node", id);
        }
        if node.is_leaf() {
            continue;
        }
        let samples = slices.samples(id);
        if samples.iter().zip(samples.iter().skip(1)).any(|(one, next)| one >= next) {
            return wrong("a sample of node", id);
        }
        let centres = centres_of(samples, &scan.positions);
        let radius = slices.covering_radius(id);
        for child in [id + 1, node.right as usize] {
            let away =
                slices.samples(child).iter().step_by(STEP).map(|i| centres.nearest_sq(scan.positions[i]));
            if away.fold(0.0, f32::max).sqrt() > radius {
                return wrong("the covering of node", id);
            }
        }
    }
    Ok(())
}
