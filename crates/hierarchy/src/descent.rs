//! The descent of a pair of trees: one loop that compares sixteen node pairs per pass. Queries
//! differ in their visitor, in the comparison of nodes and in the order of pairs.

mod frontier;
mod single;

use std::ops::ControlFlow;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16};
use nearmiss_geometry::NodeId;
use nearmiss_lanes::wide::{bits, common};

use crate::bounds::boxes::Relative;
use crate::bounds::lanes::along_normals;
use crate::tree::topology::{FAN, NodePair};
use crate::tree::wide::{LANES, Siblings, Tree, lanes_of, whole};

pub use frontier::{Frontier, Heap, Open, Plunging, Stack};
pub use single::PlaceVisitor;

/// The callbacks of every descent over node pairs. Pairs are ordered by keys of type `K`.
pub trait PairVisitor<K = f32> {
    /// Called after each comparison with the number of node pairs compared. May end the descent.
    fn compared(&mut self, pairs: u32) -> ControlFlow<()>;

    /// Visits two leaves, by their numbers, that were not pruned. `open` has their nodes.
    fn leaf_pair(&mut self, leaves: [usize; 2], open: &Open<K>) -> ControlFlow<()>;

    /// Returns `true` if a pair still has to be visited. Called when its turn has come.
    fn is_wanted(&mut self, open: &Open<K>) -> bool {
        let _ = open;
        true
    }

    /// Returns `true` if a leaf and an inner node, whose boxes are not disjoint, are known to have
    /// no contact.
    fn is_apart(&mut self, pair: NodePair) -> bool {
        let _ = pair;
        false
    }

    /// Returns which nodes of a pair must not be split although they may have children.
    fn is_fine(&self, pair: NodePair) -> [bool; 2] {
        let _ = pair;
        [false; 2]
    }

    /// Visits two nodes that must not be split, at least one of which has children.
    fn fine_pair(&mut self, pair: NodePair) -> ControlFlow<()> {
        let _ = pair;
        ControlFlow::Continue(())
    }
}

/// The callbacks of a descent that compares boxes along their face normals ([`TreePair`]).
pub trait BoxVisitor: PairVisitor {
    /// `true` if [`Self::least_apart`] is called.
    const NOTES_GAPS: bool = false;

    /// `true` if [`Self::apart`] is called.
    const NOTES_PAIRS: bool = false;

    /// `true` if [`Self::urgency`] is called.
    const LOOKS_CLOSER: bool = false;

    /// Called with a lower bound `gap` on the gaps of all pairs that the last comparison pruned.
    fn least_apart(&mut self, gap: f32) {
        let _ = gap;
    }

    /// Called with a pair whose boxes have this gap, or that [`Self::urgency`] pruned.
    fn apart(&mut self, pair: NodePair, gap: f32) {
        let _ = (pair, gap);
    }

    /// Returns the priority of a pair, the lowest first. `share` is the distance of the two centres
    /// divided by the sum of the half extents, the maximum over six axes: 0 for concentric boxes, 1
    /// for boxes that just touch. `None` prunes the pair.
    fn urgency(&mut self, pair: NodePair, share: f32) -> Option<f32> {
        let _ = pair;
        Some(share)
    }
}

/// A comparison of the node pairs that replace a split pair, sixteen in one pass.
pub trait Comparison<V, K = f32> {
    /// Returns the trees of a and of b.
    fn trees(&self) -> [&Tree<'_>; 2];

    /// Returns the length in a's frame of a unit of b's.
    fn scale(&self) -> f32;

    /// Compares the pairs below `open`, in which the nodes marked by `whole` are not split, and
    /// pushes those that are near to the frontier. Returns the number of pairs compared, and the
    /// next pair unless the frontier is to choose it.
    fn put_near<S: Simd, F: Frontier<K>>(
        &self,
        simd: S,
        open: Open<K>,
        whole: [bool; 2],
        frontier: &mut F,
        visitor: &mut V,
    ) -> (u32, Option<Open<K>>);
}

/// The most urgent of some siblings, held back while the others are pushed.
#[derive(Debug, Clone, Copy)]
pub struct MostUrgent<K>(Option<Open<K>>);

impl<K: PartialOrd + Copy> MostUrgent<K> {
    /// Creates an empty list of siblings.
    #[inline(always)]
    #[must_use]
    pub const fn new() -> Self {
        Self(None)
    }

    /// Adds a sibling.
    #[inline(always)]
    pub fn add<F: Frontier<K>>(&mut self, mut open: Open<K>, frontier: &mut F) {
        if let Some(known) = &mut self.0 {
            if open.key < known.key {
                std::mem::swap(known, &mut open);
            }
            frontier.push(open);
        } else {
            self.0 = Some(open);
        }
    }

    /// Ends the list of siblings. Returns the most urgent one if the descent continues with it.
    /// Without any sibling, reports to the frontier that nothing is left below the last pair.
    #[inline(always)]
    pub fn finish<S: Simd, F: Frontier<K>>(self, simd: S, frontier: &mut F) -> Option<Open<K>> {
        match self.0 {
            Some(most) => frontier.push_last(most),
            None => {
                frontier.settle(simd);
                None
            }
        }
    }
}

impl<K: PartialOrd + Copy> Default for MostUrgent<K> {
    fn default() -> Self {
        Self::new()
    }
}

/// Two trees in a relative pose. The boxes within `reach` of each other are near.
#[derive(Debug, Clone, Copy)]
pub struct TreePair<'a> {
    /// The tree in whose frame lengths are measured.
    pub a: &'a Tree<'a>,
    /// The other tree.
    pub b: &'a Tree<'a>,
    /// The relative pose of b in a's frame.
    pub relative: &'a Relative,
    /// The greatest gap of boxes that are near. Includes the slack of the relative pose
    /// ([`Relative::slack`]).
    pub reach: f32,
}

/// Visits the leaf pairs whose boxes are near, from the pair of roots down, until `visitor` ends
/// the descent.
pub fn descend<V: BoxVisitor, F: Frontier>(
    pair: TreePair<'_>,
    level: Level,
    frontier: &mut F,
    visitor: &mut V,
) -> ControlFlow<()> {
    frontier.push(Open { pair: NodePair::ROOTS, key: 0.0 });
    resume(&pair, level, frontier, visitor)
}

/// Visits the leaf pairs that are near according to `comparison`, from the pairs in the frontier
/// down, until `visitor` ends the descent. The frontier then holds the remaining pairs, including
/// one whose visit was interrupted.
pub fn resume<K: Copy, C: Comparison<V, K>, F: Frontier<K>, V: PairVisitor<K>>(
    comparison: &C,
    level: Level,
    frontier: &mut F,
    visitor: &mut V,
) -> ControlFlow<()> {
    dispatch!(level, simd => simd.vectorize(
        #[inline(always)]
        || resume_by(simd, comparison, frontier, visitor),
    ))
}

/// The loop of all queries about a pair of trees.
#[inline(always)]
fn resume_by<S: Simd, K: Copy, C: Comparison<V, K>, F: Frontier<K>, V: PairVisitor<K>>(
    simd: S,
    comparison: &C,
    frontier: &mut F,
    visitor: &mut V,
) -> ControlFlow<()> {
    let [a, b] = comparison.trees();
    let mut next = None;
    while let Some(open) = next.take().or_else(|| frontier.pop()) {
        if !visitor.is_wanted(&open) {
            continue;
        }
        let pair = open.pair;
        let leaves = [a.topology.is_leaf(pair.a), b.topology.is_leaf(pair.b)];
        let fine = visitor.is_fine(pair);
        if (leaves[0] || fine[0]) && (leaves[1] || fine[1]) {
            let flow = if leaves == [true; 2] {
                let numbers = [a.topology.leaf_number(pair.a), b.topology.leaf_number(pair.b)];
                visitor.leaf_pair(numbers, &open)
            } else {
                visitor.fine_pair(pair)
            };
            if flow.is_break() {
                // Its visit was interrupted, so the pair is still open.
                frontier.push(open);
                return flow;
            }
            frontier.settle(simd);
            continue;
        }
        if leaves[0] != leaves[1] && visitor.is_apart(pair) {
            frontier.settle(simd);
            continue;
        }
        let whole = if fine == [false; 2] { whole([a, b], pair, leaves, comparison.scale()) } else { fine };
        let compared;
        (compared, next) = comparison.put_near(simd, open, whole, frontier, visitor);
        let flow = visitor.compared(compared);
        if flow.is_break() {
            next.into_iter().for_each(|open| frontier.push(open));
            return flow;
        }
    }
    ControlFlow::Continue(())
}

/// The boxes that represent one node of a pair: its own, or those of its children.
struct Side<'a> {
    boxes: &'a Siblings,
    /// The lanes in use, as bits.
    lanes: u32,
    /// The node in lane `i` is `first + i * step`.
    first: u32,
    step: u32,
}

impl<'a> Side<'a> {
    #[inline(always)]
    fn below(tree: &Tree<'a>, id: NodeId) -> Self {
        let children = tree.topology.children(id);
        Self { boxes: &tree.siblings[id.index()], lanes: lanes_of(children), first: children.first, step: 1 }
    }

    /// Returns the node's own box, found among those of its siblings. A root's box is written to
    /// `alone`.
    #[inline(always)]
    fn whole(tree: &'a Tree<'_>, id: NodeId, alone: &'a mut Option<Siblings>) -> Self {
        let (boxes, lane) = if let Some((parent, lane)) = tree.topology.parent(id) {
            (&tree.siblings[parent.index()], lane)
        } else {
            let alone = alone.insert(Siblings::NONE);
            alone.set(0, &tree.root.bounds);
            (&*alone, 0)
        };
        Self { boxes, lanes: 1 << lane, first: id.0, step: 0 }
    }

    /// Returns the node in a lane.
    #[inline(always)]
    fn id(&self, lane: u32) -> NodeId {
        NodeId(self.first + lane * self.step)
    }
}

impl<V: BoxVisitor> Comparison<V> for TreePair<'_> {
    #[inline(always)]
    fn trees(&self) -> [&Tree<'_>; 2] {
        [self.a, self.b]
    }

    #[inline(always)]
    fn scale(&self) -> f32 {
        self.relative.scale()
    }

    #[inline(always)]
    fn put_near<S: Simd, F: Frontier>(
        &self,
        simd: S,
        Open { pair: NodePair { a, b }, .. }: Open,
        [whole_a, whole_b]: [bool; 2],
        frontier: &mut F,
        visitor: &mut V,
    ) -> (u32, Option<Open>) {
        let (mut alone_a, mut alone_b) = (None, None);
        let a = if whole_a { Side::whole(self.a, a, &mut alone_a) } else { Side::below(self.a, a) };
        let b = if whole_b { Side::whole(self.b, b, &mut alone_b) } else { Side::below(self.b, b) };
        let there = (a.lanes * 0x1111) & EACH_IN_FOUR[b.lanes as usize % LANES];
        let Near { mut lanes, most, shares, gaps, apart } =
            self.compare(simd, [a.boxes, b.boxes], there, V::NOTES_GAPS);
        let pair = |lane: u32| NodePair { a: a.id(lane % 4), b: b.id(lane / 4) };
        let mut next = None;
        if V::NOTES_GAPS {
            visitor.least_apart(apart);
        }
        if V::NOTES_PAIRS {
            let mut apart = there & !lanes;
            while apart != 0 {
                let lane = apart.trailing_zeros();
                apart &= apart - 1;
                visitor.apart(pair(lane), gaps[lane as usize % LANES]);
            }
        }
        if V::LOOKS_CLOSER {
            let mut most = MostUrgent::new();
            while lanes != 0 {
                let lane = lanes.trailing_zeros();
                lanes &= lanes - 1;
                let (pair, of) = (pair(lane), lane as usize % LANES);
                match visitor.urgency(pair, shares[of]) {
                    Some(key) => most.add(Open { pair, key }, frontier),
                    None => visitor.apart(pair, gaps[of]),
                }
            }
            next = most.finish(simd, frontier);
        } else if lanes == 0 {
            frontier.settle(simd);
        } else {
            let open = |lane: u32| Open { pair: pair(lane), key: shares[lane as usize % LANES] };
            lanes &= !(1 << most);
            while lanes != 0 {
                frontier.push(open(lanes.trailing_zeros()));
                lanes &= lanes - 1;
            }
            next = frontier.push_last(open(most));
        }
        (there.count_ones(), next)
    }
}

impl TreePair<'_> {
    /// Computes [`Relative::gap`] and [`Relative::overlap`] of all lanes, in the same order of
    /// operations.
    #[inline(always)]
    fn compare<S: Simd>(&self, simd: S, boxes: [&Siblings; 2], there: u32, notes_gaps: bool) -> Near<S> {
        common(
            simd,
            #[inline(always)]
            || self.compare_by(simd, boxes, there, notes_gaps),
        )
    }

    /// Does the same as [`Self::compare`], as part of the caller.
    #[inline(always)]
    fn compare_by<S: Simd>(&self, simd: S, [a, b]: [&Siblings; 2], there: u32, notes_gaps: bool) -> Near<S> {
        let boxes_a = a.boxes(simd).repeated();
        let boxes_b = self.relative.boxes_of_four(&b.boxes(simd)).spread();
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
        let there = mask32x16::from_bitmask(simd, u64::from(there));
        let near = gap.simd_le(self.reach) & there;
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
            // Without a finite gap, any lane serves.
            most: if most == 0 { lanes } else { most }.trailing_zeros(),
            shares: share.to_array(),
            gaps: gap,
            apart,
        }
    }
}

/// The near pairs among sixteen pairs of boxes. Lane 4j + i is child i of a and child j of b.
#[derive(Debug, Clone, Copy)]
struct Near<S: Simd> {
    /// The lanes of pairs that are near, as bits.
    lanes: u32,
    /// The near lane with the greatest overlap.
    most: u32,
    /// Distances of the centres, divided by the sum of the half extents; infinite for pairs that
    /// are not near.
    shares: [f32; LANES],
    gaps: f32x16<S>,
    /// The least gap of the pairs that are not near; infinite if not requested.
    apart: f32,
}

/// For each set of lanes of b, the lanes of its pairs.
const EACH_IN_FOUR: [u32; LANES] = {
    let mut each = [0; LANES];
    let mut lanes = 0;
    while lanes < LANES {
        let mut lane = 0;
        while lane < FAN {
            if lanes >> lane & 1 != 0 {
                each[lanes] |= 0xf << (FAN * lane);
            }
            lane += 1;
        }
        lanes += 1;
    }
    each
};

#[cfg(test)]
mod tests;
