//! Frontiers: the open node pairs, and the order in which they are visited.

use std::collections::BinaryHeap;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, mask32x16};
use nearmiss_lanes::order::Near;
use nearmiss_lanes::wide::bits;

use crate::tree::topology::NodePair;

/// A pair of nodes whose boxes are near each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Open<K = f32> {
    /// The nodes.
    pub pair: NodePair,
    /// The priority, the lowest first. Unless the visitor chooses another, the distance of the
    /// centres divided by the sum of the half extents.
    pub key: K,
}

impl Open {
    fn near(self) -> Near<NodePair> {
        Near { distance: self.key, item: self.pair }
    }

    fn of(near: Near<NodePair>) -> Self {
        Self { pair: near.item, key: near.distance }
    }
}

/// The open node pairs.
pub trait Frontier<K = f32> {
    /// Adds a pair. The most urgent of siblings is added last.
    fn push(&mut self, open: Open<K>);

    /// Removes and returns the next pair.
    fn pop(&mut self) -> Option<Open<K>>;

    /// Adds the most urgent of some siblings, after all others, or returns it if it is next.
    #[inline(always)]
    fn push_last(&mut self, open: Open<K>) -> Option<Open<K>> {
        Some(open)
    }

    /// Called when nothing is left below the pair that was visited last.
    #[inline(always)]
    fn settle<S: Simd>(&mut self, simd: S) {
        let _ = simd;
    }
}

/// Depth-first order, with the most urgent of siblings first. For queries that visit all near
/// pairs.
#[derive(Debug, Clone, Default)]
pub struct Stack {
    pairs: Vec<NodePair>,
    /// The keys of the pairs, in an array of their own because all of them are scanned.
    keys: Vec<f32>,
}

impl Stack {
    /// Removes all pairs.
    pub fn clear(&mut self) {
        self.pairs.clear();
        self.keys.clear();
    }

    /// Removes all pairs and returns them, the first pushed first.
    pub fn drain(&mut self) -> impl Iterator<Item = Open> {
        self.pairs.drain(..).zip(self.keys.drain(..)).map(|(pair, key)| Open { pair, key })
    }

    /// Returns the remaining pairs, the next first.
    pub fn iter(&self) -> impl Iterator<Item = NodePair> {
        self.pairs.iter().rev().copied()
    }

    /// Returns the index of the least key, the first of equals; 0 if no key is finite.
    #[inline(always)]
    fn most_urgent<S: Simd>(&self, simd: S) -> usize {
        const LANES: usize = 16;
        let (some, rest) = self.keys.as_chunks::<LANES>();
        let mut least = f32x16::splat(simd, f32::INFINITY);
        for keys in some {
            least = f32x16::load_array_ref(simd, keys).min(least);
        }
        let least = rest.iter().fold(least.reduce_min(), |least, &key| if key < least { key } else { least });
        for (chunk, keys) in some.iter().enumerate() {
            let found: mask32x16<S> = f32x16::load_array_ref(simd, keys).simd_eq(least);
            let found = bits(found);
            if found != 0 && least < f32::INFINITY {
                return chunk * LANES + found.trailing_zeros() as usize;
            }
        }
        let found = rest.iter().position(|&key| key == least && least < f32::INFINITY);
        found.map_or(0, |place| some.len() * LANES + place)
    }
}

impl Frontier for Stack {
    #[inline(always)]
    fn push(&mut self, open: Open) {
        self.pairs.push(open.pair);
        self.keys.push(open.key);
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<Open> {
        let (pair, key) = (self.pairs.pop()?, self.keys.pop()?);
        Some(Open { pair, key })
    }
}

/// The number of times a descent continues with the best open pair.
pub(super) const TURNS: u32 = 64;

/// Depth-first order that continues with the most urgent of all open pairs whenever nothing is left
/// below a pair. For queries that stop at the first contact.
///
/// Next to leaves without contact there is seldom one. Branch and bound calls this plunging
/// (docs/decisions/0018-plunging.md). After 64 such turns the order is purely depth first: a
/// contact would have been found by then, and searching for the best pair would take longer than
/// visiting all.
#[derive(Debug)]
pub struct Plunging<'s> {
    stack: &'s mut Stack,
    turns: u32,
}

impl<'s> Plunging<'s> {
    /// Creates a frontier in the memory of a stack.
    #[inline]
    pub fn new(stack: &'s mut Stack) -> Self {
        Self { stack, turns: TURNS }
    }
}

impl Frontier for Plunging<'_> {
    #[inline(always)]
    fn push(&mut self, open: Open) {
        self.stack.push(open);
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<Open> {
        self.stack.pop()
    }

    /// Brings the most urgent pair (the first of equals) to the top, unless all turns are used up.
    #[inline(always)]
    fn settle<S: Simd>(&mut self, simd: S) {
        let Some(left) = self.turns.checked_sub(1) else { return };
        self.turns = left;
        if let Some(last) = self.stack.pairs.len().checked_sub(1) {
            let best = self.stack.most_urgent(simd);
            self.stack.pairs.swap(best, last);
            self.stack.keys.swap(best, last);
        }
    }
}

/// Best-first order, for searches that a budget may end. Equally urgent pairs come in the order of
/// their nodes, so the order is deterministic.
#[derive(Debug, Clone, Default)]
pub struct Heap {
    pairs: BinaryHeap<Near<NodePair>>,
}

impl Heap {
    /// Removes all pairs.
    pub fn clear(&mut self) {
        self.pairs.clear();
    }

    /// Adds several pairs at once.
    pub fn extend(&mut self, pairs: impl Iterator<Item = Open>) {
        self.pairs.extend(pairs.map(Open::near));
    }

    /// Returns the most urgent pair.
    #[must_use]
    pub fn peek(&self) -> Option<Open> {
        self.pairs.peek().copied().map(Open::of)
    }

    /// Removes all pairs and returns them in no particular order.
    pub fn drain(&mut self) -> impl Iterator<Item = Open> {
        self.pairs.drain().map(Open::of)
    }

    /// Returns the remaining pairs: the most urgent first, the others in no particular order.
    pub fn iter(&self) -> impl Iterator<Item = NodePair> {
        self.pairs.iter().map(|near| near.item)
    }
}

impl Frontier for Heap {
    fn push(&mut self, open: Open) {
        self.pairs.push(open.near());
    }

    fn pop(&mut self) -> Option<Open> {
        self.pairs.pop().map(Open::of)
    }

    fn push_last(&mut self, open: Open) -> Option<Open> {
        self.push(open);
        None
    }
}
