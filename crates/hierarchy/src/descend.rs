//! The descent of a pair of trees: one loop for every query, what differs is the visitor.

use std::ops::ControlFlow;

use nearmiss_geometry::NodeId;

use crate::split::id32;
use crate::topology::Node;

/// A node of either tree, still to be looked at together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NodePair {
    /// A node of the first tree.
    pub a: NodeId,
    /// A node of the second.
    pub b: NodeId,
}

/// What a query does with node pairs.
pub trait Visitor {
    /// How urgent the pair is, greater first; `None` when nothing below it can matter.
    fn admit(&mut self, pair: NodePair) -> Option<f32>;

    /// Two leaves that were admitted.
    fn leaves(&mut self, pair: NodePair) -> ControlFlow<()>;

    /// Whether to split the first tree's node, given that either could be.
    fn split_first(&self, pair: NodePair) -> bool;

    /// Called before each admitted pair is looked at; may end the descent.
    fn go_on(&mut self) -> ControlFlow<()>;
}

/// The pairs still to be looked at.
pub trait Frontier {
    /// Forgets all pairs.
    fn clear(&mut self);

    /// Adds the two pairs that a split gave and that were admitted, with their urgency.
    fn push(&mut self, pairs: [Option<(f32, NodePair)>; 2]);

    /// The pair to look at next.
    fn pop(&mut self) -> Option<NodePair>;

    /// The pairs still there with their urgency, most urgent first.
    fn open(&self) -> impl Iterator<Item = (f32, NodePair)>;
}

/// Depth first, the more urgent of two siblings first: for boolean questions and all hits.
#[derive(Debug, Clone, Default)]
pub struct Stack {
    pairs: Vec<(f32, NodePair)>,
}

impl Frontier for Stack {
    fn clear(&mut self) {
        self.pairs.clear();
    }

    #[inline]
    fn push(&mut self, pairs: [Option<(f32, NodePair)>; 2]) {
        match pairs {
            [Some(l), Some(r)] if l.0 >= r.0 => self.pairs.extend([r, l]),
            [l, r] => self.pairs.extend(l.into_iter().chain(r)),
        }
    }

    #[inline]
    fn pop(&mut self) -> Option<NodePair> {
        self.pairs.pop().map(|(_, pair)| pair)
    }

    fn open(&self) -> impl Iterator<Item = (f32, NodePair)> {
        self.pairs.iter().rev().copied()
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
    let root = NodePair {
        a: NodeId::ROOT,
        b: NodeId::ROOT,
    };
    frontier.push([visitor.admit(root).map(|urgency| (urgency, root)), None]);
    while let Some(pair) = frontier.pop() {
        visitor.go_on()?;
        let (node_a, node_b) = (&a[pair.a.index()], &b[pair.b.index()]);
        let children = match (node_a.is_leaf(), node_b.is_leaf()) {
            (true, true) => {
                visitor.leaves(pair)?;
                continue;
            }
            (true, false) => split_second(pair, node_b),
            (false, true) => split_first(pair, node_a),
            (false, false) if visitor.split_first(pair) => split_first(pair, node_a),
            (false, false) => split_second(pair, node_b),
        };
        frontier.push(children.map(|child| visitor.admit(child).map(|urgency| (urgency, child))));
    }
    ControlFlow::Continue(())
}

#[inline]
fn split_first(pair: NodePair, node: &Node) -> [NodePair; 2] {
    [NodeId(id32(pair.a.index()) + 1), NodeId(node.right)].map(|a| NodePair { a, ..pair })
}

#[inline]
fn split_second(pair: NodePair, node: &Node) -> [NodePair; 2] {
    [NodeId(id32(pair.b.index()) + 1), NodeId(node.right)].map(|b| NodePair { b, ..pair })
}
