//! The descent of two wide trees: sixteen pairs of boxes in one pass.

use std::ops::ControlFlow;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x4, f32x16, mask32x16};
use nearmiss_lanes::wide::{bits, repeated, spread};

use crate::boxes::Relative;
use crate::descend::NodePair;
use crate::lanes::{Boxes, along_normals};
use crate::slices::Slices;
use crate::wide::{Child, LANES, Lanes, Siblings, WIDTH, whole};

/// How often a descent turns to the best pair of all.
const TURNS: u32 = 64;

/// What a descent does with what it finds.
pub trait LeafVisitor {
    /// Whether it is told how far apart is what is.
    const NOTES_GAPS: bool = false;

    /// Of the pairs of boxes that were compared last those that are apart are no less so than this.
    fn apart(&mut self, least: f32) {
        let _ = least;
    }

    /// Whether it is after any pair of leaves that meets, not after all: then the likeliest come first.
    fn wants_any(&self) -> bool;

    /// So many pairs of boxes were compared; may end the descent.
    fn compared(&mut self, pairs: u32) -> ControlFlow<()>;

    /// Returns `true` if a leaf and an inner node, whose boxes are not apart, are known to hold nothing that
    /// meets.
    fn is_apart(&mut self, pair: [Child; 2]) -> bool {
        let _ = pair;
        false
    }

    /// Two leaves, by their numbers, whose boxes are not apart.
    fn leaf_pair(&mut self, leaves: [usize; 2]) -> ControlFlow<()>;
}

/// The pairs that a descent has still to look at.
#[derive(Debug, Clone, Default)]
pub struct WideStack {
    pairs: Vec<Open>,
}

/// A pair that is not apart.
#[derive(Debug, Clone, Copy)]
struct Open {
    pair: [Child; 2],
    /// The distance of the centres as a share of how far the boxes reach: less where they overlap more.
    share: f32,
}

impl WideStack {
    /// Forgets all pairs.
    pub fn clear(&mut self) {
        self.pairs.clear();
    }

    /// Brings the pair to the top that overlaps most, of several the first, if there are turns left.
    #[inline(always)]
    fn turn_to_best(&mut self, turns: &mut u32) {
        let Some(left) = turns.checked_sub(1) else { return };
        *turns = left;
        let (mut best, mut least) = (0, f32::INFINITY);
        for (i, open) in self.pairs.iter().enumerate() {
            if open.share < least {
                (best, least) = (i, open.share);
            }
        }
        if let Some(last) = self.pairs.len().checked_sub(1) {
            self.pairs.swap(best, last);
        }
    }

    /// The pairs still there, as those of the binary trees of `a` and `b`, the next first.
    pub fn open(&self, a: &Slices<'_>, b: &Slices<'_>) -> impl Iterator<Item = NodePair> {
        let pairs = self.pairs.iter().rev();
        pairs.map(|open| NodePair { a: a.wide.id(open.pair[0]), b: b.wide.id(open.pair[1]) })
    }
}

/// Visits the pairs of leaves of `a` and `b` whose boxes are no further apart than `reach`, in a's frame,
/// until `visitor` ends it.
///
/// Of siblings the pair that overlaps most comes first, and so on down to the leaves. Where nothing is found
/// there and the visitor wants any, the next is the pair that overlaps most of all that are left: the
/// neighbours of leaves that do not meet seldom do (plunging, as branch and bound calls it; docs/decisions).
/// After so many turns, the others are looked at depth first: what meets would have been found, and looking
/// for the best would take longer than looking at all.
pub fn descend_wide<V: LeafVisitor>(
    (a, b): (&Slices<'_>, &Slices<'_>),
    relative: &Relative,
    reach: f32,
    level: Level,
    stack: &mut WideStack,
    visitor: &mut V,
) -> ControlFlow<()> {
    stack.clear();
    stack.pairs.push(Open { pair: [a.wide.root(), b.wide.root()], share: 0.0 });
    dispatch!(level, simd => simd.vectorize(
        #[inline(always)]
        || descend_by(simd, (a, b), relative, reach, stack, visitor),
    ))
}

#[inline(always)]
fn descend_by<S: Simd, V: LeafVisitor>(
    simd: S,
    (a, b): (&Slices<'_>, &Slices<'_>),
    relative: &Relative,
    reach: f32,
    stack: &mut WideStack,
    visitor: &mut V,
) -> ControlFlow<()> {
    let mut turns = if visitor.wants_any() { TURNS } else { 0 };
    while let Some(open) = stack.pairs.pop() {
        let pair = open.pair;
        if pair[0].is_leaf() && pair[1].is_leaf() {
            let flow = visitor.leaf_pair(pair.map(Child::index));
            if flow.is_break() {
                // It was not looked at to the end, so it is still open.
                stack.pairs.push(open);
                return flow;
            }
            stack.turn_to_best(&mut turns);
            continue;
        }
        if pair[0].is_leaf() != pair[1].is_leaf() && visitor.is_apart(pair) {
            stack.turn_to_best(&mut turns);
            continue;
        }
        let [whole_a, whole_b] = whole([a.wide, b.wide], pair, relative.scale());
        let (alone_a, alone_b);
        let below_a = if whole_a {
            alone_a = a.alone(pair[0]);
            &alone_a
        } else {
            &a.wide.nodes[pair[0].index()]
        };
        let below_b = if whole_b {
            alone_b = b.alone(pair[1]);
            &alone_b
        } else {
            &b.wide.nodes[pair[1].index()]
        };
        let Near { mut lanes, most, shares, compared, apart } =
            compare(simd, relative, [below_a, below_b], (reach, V::NOTES_GAPS));
        if V::NOTES_GAPS {
            visitor.apart(apart);
        }
        if lanes == 0 {
            stack.turn_to_best(&mut turns);
        } else {
            let open = |lane: u32| Open {
                pair: [
                    below_a.children[lane as usize % WIDTH],
                    below_b.children[lane as usize / WIDTH % WIDTH],
                ],
                share: shares[lane as usize % LANES],
            };
            lanes &= !(1 << most);
            while lanes != 0 {
                stack.pairs.push(open(lanes.trailing_zeros()));
                lanes &= lanes - 1;
            }
            stack.pairs.push(open(most));
        }
        visitor.compared(compared)?;
    }
    ControlFlow::Continue(())
}

impl Slices<'_> {
    /// A node by itself.
    fn alone(&self, child: Child) -> Siblings {
        let mut alone = Siblings::NONE;
        alone.set(0, &self.boxes[self.wide.id(child).index()], child);
        alone
    }
}

/// What of sixteen pairs of boxes is near. Lane 4j + i is child i of a and child j of b.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Near {
    /// Those that are not apart, as bits.
    lanes: u32,
    /// The one of these that overlaps most: as [`Relative::gaps_and_overlaps`] has it.
    most: u32,
    /// How far they are from each other, in that sense.
    shares: [f32; LANES],
    /// How many there are at all.
    compared: u32,
    /// How far those that are apart are at least, if that is wanted.
    apart: f32,
}

/// As [`Relative::gaps_and_overlaps`], in the same order of operations.
#[inline(always)]
fn compare<S: Simd>(
    simd: S,
    relative: &Relative,
    [a, b]: [&Siblings; 2],
    (reach, notes_gaps): (f32, bool),
) -> Near {
    let boxes_a = Boxes {
        centre: each_repeated(simd, &a.centre),
        half: each_repeated(simd, &a.half),
        axes: [
            each_repeated(simd, &a.axes[0]),
            each_repeated(simd, &a.axes[1]),
            each_repeated(simd, &a.axes[2]),
        ],
    };
    let [hx, hy, hz] = four(simd, &b.half);
    let scale = relative.scale();
    let boxes_b = Boxes {
        centre: each_spread(relative.points_of_four(four(simd, &b.centre))),
        half: each_spread([hx * scale, hy * scale, hz * scale]),
        axes: [
            each_spread(relative.directions_of_four(four(simd, &b.axes[0]))),
            each_spread(relative.directions_of_four(four(simd, &b.axes[1]))),
            each_spread(relative.directions_of_four(four(simd, &b.axes[2]))),
        ],
    };
    let mut gap = f32x16::splat(simd, f32::MIN);
    let mut share = f32x16::splat(simd, 0.0);
    along_normals(
        &boxes_a,
        &boxes_b,
        #[inline(always)]
        |away, reach| {
            gap = gap.max(away - reach);
            share = share.max(away / (reach + f32::MIN_POSITIVE));
        },
    );
    let [of_a, of_b] = [a.lanes(), b.lanes()];
    // Those of b are the first few.
    let there = (of_a * 0x1111) & ((1 << (4 * of_b.count_ones())) - 1);
    let there = mask32x16::from_bitmask(simd, u64::from(there));
    let near = gap.simd_le(reach) & there;
    let apart = if notes_gaps {
        (there & !near).select(gap, f32x16::splat(simd, f32::INFINITY)).reduce_min()
    } else {
        f32::INFINITY
    };
    let share = near.select(share, f32x16::splat(simd, f32::INFINITY));
    let lanes = bits(near);
    let most = bits(share.simd_eq(share.reduce_min())) & lanes;
    Near {
        lanes,
        // What is no number has no least.
        most: if most == 0 { lanes } else { most }.trailing_zeros(),
        shares: share.to_array(),
        compared: of_a.count_ones() * of_b.count_ones(),
        apart,
    }
}

// A closure given to the standard library would not be compiled for the instruction set.

#[inline(always)]
fn four<S: Simd>(simd: S, [x, y, z]: &[Lanes; 3]) -> [f32x4<S>; 3] {
    [f32x4::load_array_ref(simd, x), f32x4::load_array_ref(simd, y), f32x4::load_array_ref(simd, z)]
}

#[inline(always)]
fn each_repeated<S: Simd>(simd: S, rows: &[Lanes; 3]) -> [f32x16<S>; 3] {
    let [x, y, z] = four(simd, rows);
    [repeated(x), repeated(y), repeated(z)]
}

#[inline(always)]
fn each_spread<S: Simd>([x, y, z]: [f32x4<S>; 3]) -> [f32x16<S>; 3] {
    [spread(x), spread(y), spread(z)]
}

#[cfg(test)]
mod tests;
