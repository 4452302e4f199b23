//! Validation of the boxes: an invalid box, or one outside its parent's, makes a query visit
//! everything or miss a contact.

use bytemuck::{bytes_of, cast_ref};
use nearmiss_geometry::NodeId;
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::ranges;
use nearmiss_lanes::vector::{dot, sub};

use nearmiss_store::Flaw;

use super::limits::FARTHEST;
use crate::bounds::boxes::OrientedBox;
use crate::bounds::growth::Growth;
use crate::bounds::part::Part;
use crate::tree::wide::{Siblings, Tree};

/// Tolerance for unit and orthogonal axes: far above rounding errors, far below those of a corrupt
/// box.
const ASKEW: f32 = 1e-3;

/// Greatest extent of a child beyond its parent that rounding explains, relative to their
/// coordinates. Both boxes were enlarged by 3e-6 of their own coordinates, and the comparison has
/// the same rounding error.
const STICKS_OUT: f32 = 1.2e-5;

/// The count of numbers in a box.
const NUMBERS: usize = size_of::<OrientedBox>() / size_of::<f32>();

/// For each number of a box, a mask of the bits that are compared (all, or all but the sign) and
/// the greatest valid value. Finite numbers without their sign are ordered like their bits;
/// infinity and NaN are above them all.
const RANGES: [(u32, u32); NUMBERS] = {
    let mut ranges = [(u32::MAX, FARTHEST.to_bits()); NUMBERS];
    let mut i = 0;
    while i < 15 {
        match i {
            0..3 => ranges[i].0 = i32::MAX.cast_unsigned(),
            3..6 => {}
            _ => ranges[i] = (i32::MAX.cast_unsigned(), (1.0 + ASKEW).to_bits()),
        }
        i += 1;
    }
    ranges
};

/// Returns `true` if the numbers of a box are in their ranges: centre, half edges, axes, reach.
pub(crate) fn is_in_range(bounds: &OrientedBox) -> bool {
    let bits: &[u32; NUMBERS] = cast_ref(bounds);
    let mut beyond = 0;
    for (x, (mask, most)) in bits.iter().zip(RANGES) {
        beyond |= u32::from(x & mask > most);
    }
    beyond == 0
}

/// Checks the boxes and enclosures of all nodes: the numbers are in their ranges, axes form a
/// frame, each box is within its parent's, and unused lanes are zero.
pub(crate) fn check(tree: &Tree<'_>) -> Result<(), Flaw> {
    let topology = tree.topology;
    let wrong = |what, id: NodeId| Err(Flaw::Value { what, index: id.index() });
    let is_sound = |bounds: &OrientedBox| is_in_range(bounds) && is_frame(&bounds.axes);
    if !is_sound(&tree.root.bounds) {
        return wrong("the box of node", NodeId::ROOT);
    }
    let found = ranges(topology.inner(), |parents| {
        for parent in parents {
            let (id, siblings) = (NodeId(id32(parent)), &tree.siblings[parent]);
            let own = tree.bounds(id);
            let children = topology.children(id);
            let mut again = Siblings::NONE;
            for (lane, child) in children.iter().enumerate() {
                let bounds = tree.bounds(child);
                again.set(lane, &bounds);
                if !(is_sound(&bounds) && lies_within(&bounds, &own)) {
                    return wrong("the box of node", child);
                }
                let growths = [Part::Surface, Part::Obstacle].map(|part| tree.growth(part, child));
                if !growths.iter().all(Growth::is_sound) {
                    return wrong("the enclosure of node", child);
                }
            }
            let unused = &tree.reaches_below(id)[children.len()..];
            if bytes_of(&again) != bytes_of(siblings) || unused.iter().any(|reach| reach.to_bits() != 0) {
                return wrong("the boxes of the children of node", id);
            }
        }
        Ok(())
    });
    found.into_iter().collect()
}

/// Returns `true` if three vectors are unit and orthogonal. Written so that NaN fails.
#[inline]
fn is_frame(&[x, y, z]: &[[f32; 3]; 3]) -> bool {
    let is_unit = |axis: [f32; 3]| (dot(axis, axis) - 1.0).abs() <= ASKEW;
    let is_right = |a: [f32; 3], b: [f32; 3]| dot(a, b).abs() <= ASKEW;
    is_unit(x) & is_unit(y) & is_unit(z) & is_right(x, y) & is_right(x, z) & is_right(y, z)
}

/// Returns `true` if `child` may be the box of a node under that of `parent`. Its interval along
/// each of its own axes must be within the parent's, because it is tight around discs that the
/// parent's box contains too. Its greatest local radius must not exceed the parent's.
#[inline]
fn lies_within(child: &OrientedBox, parent: &OrientedBox) -> bool {
    let d = sub(child.centre, parent.centre);
    let size = |v: [f32; 3]| v[0].abs() + v[1].abs() + v[2].abs();
    let slack = STICKS_OUT * (size(parent.centre) + size(parent.half));
    let mut inside = child.reach <= parent.reach;
    for k in 0..3 {
        let u = child.axes[k];
        let mut room = slack;
        for j in 0..3 {
            room += parent.half[j] * dot(parent.axes[j], u).abs();
        }
        inside &= dot(d, u).abs() + child.half[k] <= room;
    }
    inside
}
