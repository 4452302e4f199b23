//! The boxes: one that is none, or that leaves its parent's, makes a query look everywhere or miss a contact.

use bytemuck::cast_ref;
use nearmiss_lanes::vector::{dot, sub};

use super::flaw::{FARTHEST, Flaw};
use crate::boxes::OrientedBox;
use crate::growth::Growth;
use crate::topology::Node;

/// Axes are unit and at right angles to rounding; this is far from rounding and far from a box that lies.
const ASKEW: f32 = 1e-3;

/// What rounding may make a child stick out of its parent, relative to their coordinates: both boxes were
/// grown by 2e-6 of their own, and the comparison rounds as much again.
const STICKS_OUT: f32 = 8e-6;

/// Numbers of a box.
const NUMBERS: usize = size_of::<OrientedBox>() / size_of::<f32>();

/// For each number of a box the bits that count, all or all but the sign, and the greatest value they may
/// have. Finite numbers without their sign are ordered like their bits, and what is not finite is above them
/// all.
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

/// Checks that the numbers of every box lie in their ranges: the middle, half edges, axes, reach. One pass,
/// at the speed of memory.
pub(super) fn check_ranges(boxes: &[OrientedBox]) -> Result<(), Flaw> {
    let is_sound = |b: &OrientedBox| {
        let bits: &[u32; NUMBERS] = cast_ref(b);
        let mut beyond = 0;
        for (x, (mask, most)) in bits.iter().zip(RANGES) {
            beyond |= u32::from(x & mask > most);
        }
        beyond == 0
    };
    first_wrong(boxes.iter().position(|b| !is_sound(b)))
}

/// Checks the boxes of a tree whose topology and ranges are sound: axes form a frame, and each box lies
/// within its parent's.
pub(super) fn check(nodes: &[Node], boxes: &[OrientedBox]) -> Result<(), Flaw> {
    let askew = boxes.iter().position(|b| !is_frame(&b.axes));
    first_wrong(askew)?;
    for (id, (node, bounds)) in nodes.iter().zip(boxes).enumerate() {
        if !node.is_leaf() {
            for child in [id + 1, node.right as usize] {
                if !lies_within(&boxes[child], bounds) {
                    return first_wrong(Some(child));
                }
            }
        }
    }
    Ok(())
}

/// Checks that enclosures are no smaller than boxes, and finite.
pub(super) fn check_growths(growths: &[Growth]) -> Result<(), Flaw> {
    let wrong = growths.iter().position(|growth| !growth.is_sound());
    wrong.map_or(Ok(()), |index| Err(Flaw::Value { what: "the enclosure of node", index }))
}

fn first_wrong(node: Option<usize>) -> Result<(), Flaw> {
    node.map_or(Ok(()), |index| Err(Flaw::Value { what: "the box of node", index }))
}

/// Whether three vectors are unit and at right angles. Written so that what is no number fails.
#[inline]
fn is_frame(&[x, y, z]: &[[f32; 3]; 3]) -> bool {
    let is_unit = |axis: [f32; 3]| (dot(axis, axis) - 1.0).abs() <= ASKEW;
    let is_right = |a: [f32; 3], b: [f32; 3]| dot(a, b).abs() <= ASKEW;
    is_unit(x) & is_unit(y) & is_unit(z) & is_right(x, y) & is_right(x, z) & is_right(y, z)
}

/// Whether `child` may be the box of a node under that of `parent`: along each of its own axes it is no
/// longer than the discs it is about, which the parent's box holds, and no point below it reaches further.
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
