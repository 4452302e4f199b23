//! The pairs of nodes still to be looked at, and which of them comes next.

use std::collections::BinaryHeap;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, mask32x16};
use nearmiss_lanes::order::Near;
use nearmiss_lanes::wide::bits;

use crate::tree::topology::NodePair;

/// A pair whose boxes are near each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Open<K = f32> {
    /// The nodes.
    pub pair: NodePair,
    /// The less the more urgent: the distance of the centres as a share of how far the boxes reach, unless
    /// the visitor says otherwise.
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

/// The pairs still to be looked at.
pub trait Frontier<K = f32> {
    /// Adds a pair. Of siblings the most urgent comes last.
    fn push(&mut self, open: Open<K>);

    /// The pair to look at next.
    fn pop(&mut self) -> Option<Open<K>>;

    /// Adds the most urgent of some siblings, after all others, or returns it if it comes next.
    #[inline(always)]
    fn push_last(&mut self, open: Open<K>) -> Option<Open<K>> {
        Some(open)
    }

    /// Nothing is left below the pair that was looked at last.
    #[inline(always)]
    fn settle<S: Simd>(&mut self, simd: S) {
        let _ = simd;
    }
}

/// Depth first, of siblings the most urgent first: for all pairs that are near.
#[derive(Debug, Clone, Default)]
pub struct Stack {
    pairs: Vec<NodePair>,
    /// Of the same pairs, apart from them, for all are looked at.
    keys: Vec<f32>,
}

impl Stack {
    /// Forgets all pairs.
    pub fn clear(&mut self) {
        self.pairs.clear();
        self.keys.clear();
    }

    /// The pairs still there, the next first.
    pub fn iter(&self) -> impl Iterator<Item = NodePair> {
        self.pairs.iter().rev().copied()
    }

    /// The place of the least key, the first of equals; 0 if none is less than infinite.
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

/// How often a descent turns to the best pair of all.
pub(super) const TURNS: u32 = 64;

/// Depth first, but where nothing is found below a pair the next is the most urgent of all that are left: for
/// any pair that meets.
///
/// The neighbours of leaves that do not meet seldom do (plunging, as branch and bound calls it;
/// docs/decisions). After so many turns, the others are looked at depth first: what meets would have been
/// found, and looking for the best would take longer than looking at all.
#[derive(Debug)]
pub struct Plunging<'s> {
    stack: &'s mut Stack,
    turns: u32,
}

impl<'s> Plunging<'s> {
    /// In the memory of a stack.
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

    /// Brings the most urgent pair to the top, of several the first, if there are turns left.
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

/// The most urgent of all pairs first: for searches that a budget may end. Pairs equally urgent come in the
/// order of their nodes, so the order never depends on anything else.
#[derive(Debug, Clone, Default)]
pub struct Heap {
    pairs: BinaryHeap<Near<NodePair>>,
}

impl Heap {
    /// Forgets all pairs.
    pub fn clear(&mut self) {
        self.pairs.clear();
    }

    /// Adds pairs, all at once.
    pub fn extend(&mut self, pairs: impl Iterator<Item = Open>) {
        self.pairs.extend(pairs.map(Open::near));
    }

    /// The most urgent pair.
    #[must_use]
    pub fn peek(&self) -> Option<Open> {
        self.pairs.peek().copied().map(Open::of)
    }

    /// Takes all pairs out, in no order.
    pub fn drain(&mut self) -> impl Iterator<Item = Open> {
        self.pairs.drain().map(Open::of)
    }

    /// The pairs still there, the most urgent first, and then in no order.
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
