//! The descent of a pair of trees: one loop for every query, what differs is the visitor.

use std::collections::BinaryHeap;
use std::ops::ControlFlow;

use nearmiss_geometry::NodeId;
use nearmiss_lanes::order::Near;
use serde::{Deserialize, Serialize};

use crate::topology::Node;

/// A node of either tree, still to be looked at together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct NodePair {
    /// A node of the first tree.
    pub a: NodeId,
    /// A node of the second.
    pub b: NodeId,
}

impl NodePair {
    /// What takes the place of either node when this pair is split, as `which` wants it if there is a choice;
    /// a node that is not split stands there twice. None for two leaves.
    #[inline]
    pub fn split(self, a: &Node, b: &Node, which: impl FnOnce() -> Split) -> Option<[[NodeId; 2]; 2]> {
        self.split_unless(a, b, [a.is_leaf(), b.is_leaf()], which)
    }

    /// As [`NodePair::split`], where a node is not split if it is a leaf or `whole` says so.
    #[inline]
    pub fn split_unless(
        self,
        a: &Node,
        b: &Node,
        whole: [bool; 2],
        which: impl FnOnce() -> Split,
    ) -> Option<[[NodeId; 2]; 2]> {
        let split = match (a.is_leaf() || whole[0], b.is_leaf() || whole[1]) {
            (true, true) => return None,
            (true, false) => Split::Second,
            (false, true) => Split::First,
            (false, false) => which(),
        };
        let of_a = if split == Split::Second { [self.a; 2] } else { a.children(self.a) };
        let of_b = if split == Split::First { [self.b; 2] } else { b.children(self.b) };
        Some([of_a, of_b])
    }
}

/// Which node of a pair to replace by its children.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Split {
    /// The first tree's.
    First,
    /// The second tree's.
    Second,
    /// Both.
    Both,
}

/// What a query does with node pairs.
pub trait Visitor {
    /// How urgent each pair of one of `a` with one of `b` is, greater first: (0, 0), (0, 1), (1, 0), (1, 1).
    /// `None` when nothing below the pair can matter. A node that is not split stands there twice; `count`
    /// pairs are meant (the doubles are ignored).
    fn admit(&mut self, a: [NodeId; 2], b: [NodeId; 2], count: u8) -> [Option<f32>; 4];

    /// Two leaves that were admitted, or nodes that are [whole](Visitor::whole).
    fn leaves(&mut self, pair: NodePair) -> ControlFlow<()>;

    /// Which node to split, given that either can be.
    fn split(&self, pair: NodePair) -> Split;

    /// Which nodes of the pair are not to be split although they are no leaves.
    #[inline]
    fn whole(&self, _pair: NodePair) -> [bool; 2] {
        [false; 2]
    }

    /// Called before each admitted pair is looked at; may end the descent.
    fn go_on(&mut self) -> ControlFlow<()>;
}

/// The pairs still to be looked at.
pub trait Frontier {
    /// Forgets all pairs.
    fn clear(&mut self);

    /// Adds the pairs that a split gave, with the urgency of those that were admitted.
    fn push(&mut self, pairs: [(Option<f32>, NodePair); 4]);

    /// The pair to look at next, with its urgency.
    fn pop(&mut self) -> Option<(f32, NodePair)>;

    /// The pairs still there with their urgency.
    fn open(&self) -> impl Iterator<Item = (f32, NodePair)>;
}

/// Depth first, of siblings the most urgent first: for boolean questions and all hits.
#[derive(Debug, Clone, Default)]
pub struct Stack {
    pairs: Vec<(f32, NodePair)>,
}

impl Frontier for Stack {
    fn clear(&mut self) {
        self.pairs.clear();
    }

    #[inline]
    fn push(&mut self, pairs: [(Option<f32>, NodePair); 4]) {
        // Sorting the others would cost what it saves.
        let mut most = (f32::NEG_INFINITY, None);
        for (urgency, pair) in pairs {
            let Some(urgency) = urgency else { continue };
            let entry = Some((urgency, pair));
            let below = if urgency > most.0 || most.1.is_none() {
                std::mem::replace(&mut most, (urgency, entry)).1
            } else {
                entry
            };
            self.pairs.extend(below);
        }
        self.pairs.extend(most.1);
    }

    #[inline]
    fn pop(&mut self) -> Option<(f32, NodePair)> {
        self.pairs.pop()
    }

    fn open(&self) -> impl Iterator<Item = (f32, NodePair)> {
        self.pairs.iter().rev().copied()
    }
}

/// The most urgent of all pairs first: for searches that a budget may end. Pairs equally urgent come in the
/// order of their nodes, so the order never depends on anything else.
#[derive(Debug, Clone, Default)]
pub struct Heap {
    /// By their urgency, negated.
    pairs: BinaryHeap<Near<NodePair>>,
}

impl Frontier for Heap {
    fn clear(&mut self) {
        self.pairs.clear();
    }

    fn push(&mut self, pairs: [(Option<f32>, NodePair); 4]) {
        self.pairs.extend(
            pairs.into_iter().filter_map(|(urgency, pair)| Some(Near { distance: -urgency?, item: pair })),
        );
    }

    fn pop(&mut self) -> Option<(f32, NodePair)> {
        self.pairs.pop().map(|near| (-near.distance, near.item))
    }

    fn open(&self) -> impl Iterator<Item = (f32, NodePair)> {
        self.pairs.iter().map(|near| (-near.distance, near.item))
    }
}

/// Visits the pairs of nodes of `a` and `b` that `visitor` admits, from the two roots down.
///
/// Returns whether the visitor ended it; the frontier then holds what was left. Ends for any nodes whose
/// children come after them.
pub fn descend<V: Visitor, F: Frontier>(
    a: &[Node],
    b: &[Node],
    visitor: &mut V,
    frontier: &mut F,
) -> ControlFlow<()> {
    frontier.clear();
    enter(visitor, frontier, [NodeId::ROOT; 2], [NodeId::ROOT; 2]);
    resume(a, b, visitor, frontier)
}

/// As [`descend`], from the pairs that the frontier holds.
pub fn resume<V: Visitor, F: Frontier>(
    a: &[Node],
    b: &[Node],
    visitor: &mut V,
    frontier: &mut F,
) -> ControlFlow<()> {
    while let Some((urgency, pair)) = frontier.pop() {
        let mut flow = visitor.go_on();
        if flow.is_continue() {
            let (node_a, node_b) = (&a[pair.a.index()], &b[pair.b.index()]);
            match pair.split_unless(node_a, node_b, visitor.whole(pair), || visitor.split(pair)) {
                Some([children_a, children_b]) => enter(visitor, frontier, children_a, children_b),
                None => flow = visitor.leaves(pair),
            }
        }
        if flow.is_break() {
            // It was not looked at, or not to the end, so it is still open.
            let none = (None, pair);
            frontier.push([(Some(urgency), pair), none, none, none]);
            return flow;
        }
    }
    ControlFlow::Continue(())
}

/// Puts those of the four combinations into the frontier that differ and are admitted.
#[inline]
fn enter<V: Visitor, F: Frontier>(visitor: &mut V, frontier: &mut F, a: [NodeId; 2], b: [NodeId; 2]) {
    let whole = [a[0] == a[1], b[0] == b[1]];
    let count = if whole[0] { 1 } else { 2 } * if whole[1] { 1 } else { 2 };
    let mut urgencies = visitor.admit(a, b, count);
    if whole[0] {
        urgencies[2..].fill(None);
    }
    if whole[1] {
        urgencies[1] = None;
        urgencies[3] = None;
    }
    let pair = |i: usize| (urgencies[i], NodePair { a: a[i >> 1], b: b[i & 1] });
    frontier.push([pair(0), pair(1), pair(2), pair(3)]);
}
