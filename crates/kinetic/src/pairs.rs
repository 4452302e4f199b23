//! `Pairs`: the node pairs of two trees that a collision test would visit, with their certificates.

use crate::motion::{State, later};
use crate::nodes::{ROOT, SIDES};
use crate::points::Side;
use crate::primitives::NONE;
use crate::queue::Queue;
use crate::tree::KineticTree;

/// The pair of the roots. Pair 1 is unused, because siblings are side by side.
const ROOTS: u32 = 0;

/// Two trees at one time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct View<'a> {
    pub(crate) trees: [&'a KineticTree; 2],
    pub(crate) now: f64,
}

impl View<'_> {
    /// Returns the coordinate that must stay above, and the one below it, for the boxes to be apart
    /// on a side: sides 0 to 2 mean that the first box is above the second one.
    fn bounds(&self, nodes: [u32; 2], side: Side) -> [State; 2] {
        let state = |tree: usize| {
            let winner = self.trees[tree].nodes.get(nodes[tree]).winners[winner_side(tree, side)];
            self.trees[tree].points.state(winner, 3 + side % 3, self.now)
        };
        if side < 3 { [state(0), state(1)] } else { [state(1), state(0)] }
    }

    fn is_empty(&self, nodes: [u32; 2]) -> bool {
        (0..2).any(|k| self.trees[k].nodes.link(nodes[k]).size == 0)
    }

    fn is_leaf(&self, tree: usize, nodes: [u32; 2]) -> bool {
        self.trees[tree].nodes.link(nodes[tree]).is_leaf()
    }

    /// Returns `true` if the pair with child `k` of a node of an own pair, that of `tree`, is an own pair
    /// too; `None` if it is left out. Of two nodes beside each other, the first one comes first in a pair.
    fn own_below(&self, tree: usize, nodes: [u32; 2], k: u32) -> Option<bool> {
        if tree == 0 {
            return Some(true);
        }
        let parent = |node: u32| self.trees[0].nodes.link(node).parent;
        let mut above = nodes[0];
        while parent(above) != nodes[1] {
            above = parent(above);
        }
        let own = above - self.trees[1].nodes.link(nodes[1]).children;
        if k == own { Some(true) } else { (k > own).then_some(false) }
    }

    /// Returns the tree whose node a pair splits: the one with more primitives.
    fn splits(&self, nodes: [u32; 2]) -> Option<usize> {
        let size = |tree: usize| self.trees[tree].nodes.link(nodes[tree]).size;
        match [0, 1].map(|tree| self.is_leaf(tree, nodes)) {
            [true, true] => None,
            [false, true] => Some(0),
            [true, false] => Some(1),
            [false, false] => Some(usize::from(size(1) > size(0))),
        }
    }
}

/// Returns the side of a tree's box that a side of a pair depends on.
const fn winner_side(tree: usize, side: Side) -> Side {
    (side + 3 * tree) % SIDES
}

/// Two nodes, one of each tree.
///
/// A tree can also be compared with itself. Then the second node of an *own* pair is the first one or
/// above it, so their boxes never part.
#[derive(Debug, Clone, Copy)]
struct NodePair {
    /// The nodes; [`NONE`] in an unused pair.
    nodes: [u32; 2],
    /// The first of the two pairs below this one; 0 for a pair of leaves.
    children: u32,
    /// The side on which the boxes are apart, or that will part first.
    side: Side,
    /// The boxes have a point in common.
    meets: bool,
    is_own: bool,
    /// The pairs after and before this one with the same node, for each tree.
    next: [u32; 2],
    before: [u32; 2],
}

const UNUSED: NodePair = NodePair {
    nodes: [NONE; 2],
    children: 0,
    side: 0,
    meets: false,
    is_own: false,
    next: [NONE; 2],
    before: [NONE; 2],
};

/// The pairs that a test of the trees from the roots visits now: those below pairs that meet.
#[derive(Debug, Clone, Default)]
pub(crate) struct Pairs {
    pairs: Vec<NodePair>,
    free: Vec<u32>,
    /// When each pair meets, or parts.
    queue: Queue,
    /// The first pair of each node, for each tree.
    heads: [Vec<u32>; 2],
    /// Leaf pairs that came to meet and were not taken yet.
    fresh: Vec<u32>,
    /// Pairs to compare again, reused.
    touched: Vec<u32>,
}

impl Pairs {
    /// Starts again from the roots. `is_own` tells that both trees are the same one.
    pub(crate) fn restart(&mut self, view: View<'_>, is_own: bool) {
        self.pairs.clear();
        self.pairs.resize(2, UNUSED);
        self.free.clear();
        self.queue.clear();
        self.fresh.clear();
        for (heads, tree) in self.heads.iter_mut().zip(view.trees) {
            heads.clear();
            heads.resize(tree.nodes.nodes.len(), NONE);
        }
        self.enter(ROOTS, [ROOT; 2], is_own);
        self.settle(ROOTS, view);
    }

    /// Returns the time at which the next pair meets or parts; infinite if no pair ever will.
    pub(crate) fn next_time(&self) -> f64 {
        self.queue.first().map_or(f64::INFINITY, |(time, _)| time)
    }

    /// Processes the pair that meets or parts now.
    pub(crate) fn step(&mut self, view: View<'_>) {
        let Some((_, pair)) = self.queue.first() else { return };
        let NodePair { nodes, side, meets, .. } = self.pairs[pair as usize];
        // The certificate decides about its own side, whatever rounding makes of the positions.
        let sides =
            (0..SIDES).filter(|&other| if other == side { meets } else { is_apart(view, nodes, other) });
        match last_to_meet(view, nodes, sides) {
            Some((side, time)) => self.part(pair, side, time),
            None => self.meet(pair, view),
        }
    }

    /// Compares the pairs of a node whose extremal points, or their plans, changed on some sides.
    pub(crate) fn node_changed(&mut self, tree: usize, node: u32, sides: u8, view: View<'_>) {
        let mut touched = std::mem::take(&mut self.touched);
        touched.clear();
        let mut at = self.heads[tree][node as usize];
        while at != NONE {
            let pair = &self.pairs[at as usize];
            if !pair.is_own && (pair.meets || sides & 1 << winner_side(tree, pair.side) != 0) {
                touched.push(at);
            }
            at = pair.next[tree];
        }
        for &pair in &touched {
            // A pair above may have parted meanwhile.
            if self.pairs[pair as usize].nodes[0] != NONE {
                self.settle(pair, view);
            }
        }
        self.touched = touched;
    }

    /// Compares the boxes of a pair.
    fn settle(&mut self, pair: u32, view: View<'_>) {
        let NodePair { nodes, is_own, .. } = self.pairs[pair as usize];
        if view.is_empty(nodes) {
            return;
        }
        if is_own {
            return self.meet(pair, view);
        }
        let sides = (0..SIDES).filter(|&side| is_apart(view, nodes, side));
        match last_to_meet(view, nodes, sides) {
            Some((side, time)) => self.part(pair, side, time),
            None => self.meet(pair, view),
        }
    }

    /// Notes that a pair is apart on a side until `time`. The pairs below it are dropped.
    fn part(&mut self, pair: u32, side: Side, time: f64) {
        self.drop_below(pair);
        let found = &mut self.pairs[pair as usize];
        (found.side, found.meets) = (side, false);
        self.queue.set(pair, time);
    }

    /// Notes that a pair meets, and compares those below it.
    fn meet(&mut self, pair: u32, view: View<'_>) {
        let NodePair { nodes, meets, is_own, .. } = self.pairs[pair as usize];
        let (side, time) = if is_own { (0, f64::INFINITY) } else { first_to_part(view, nodes) };
        let found = &mut self.pairs[pair as usize];
        (found.side, found.meets) = (side, true);
        self.queue.set(pair, time);
        if meets {
            return;
        }
        let Some(tree) = view.splits(nodes) else { return self.fresh.push(pair) };
        let children = self.free.pop().unwrap_or_else(|| {
            self.pairs.extend([UNUSED; 2]);
            nearmiss_lanes::id32(self.pairs.len() - 2)
        });
        self.pairs[pair as usize].children = children;
        let first = view.trees[tree].nodes.link(nodes[tree]).children;
        for k in 0..2 {
            let mut below = nodes;
            below[tree] = first + k;
            let within = if is_own { view.own_below(tree, nodes, k) } else { Some(false) };
            if let Some(is_own) = within {
                self.enter(children + k, below, is_own);
                self.settle(children + k, view);
            }
        }
    }

    /// Enters a pair into the lists of its nodes.
    fn enter(&mut self, pair: u32, nodes: [u32; 2], is_own: bool) {
        self.pairs[pair as usize] = NodePair { nodes, is_own, ..UNUSED };
        for tree in 0..2 {
            let head = std::mem::replace(&mut self.heads[tree][nodes[tree] as usize], pair);
            self.pairs[pair as usize].next[tree] = head;
            if head != NONE {
                self.pairs[head as usize].before[tree] = pair;
            }
        }
    }

    fn drop_below(&mut self, pair: u32) {
        let children = std::mem::replace(&mut self.pairs[pair as usize].children, 0);
        if children == 0 {
            return;
        }
        for child in [children, children + 1] {
            if self.pairs[child as usize].nodes[0] == NONE {
                continue;
            }
            self.drop_below(child);
            self.queue.set(child, f64::INFINITY);
            let NodePair { nodes, next, before, .. } =
                std::mem::replace(&mut self.pairs[child as usize], UNUSED);
            for tree in 0..2 {
                match before[tree] {
                    NONE => self.heads[tree][nodes[tree] as usize] = next[tree],
                    other => self.pairs[other as usize].next[tree] = next[tree],
                }
                if next[tree] != NONE {
                    self.pairs[next[tree] as usize].before[tree] = before[tree];
                }
            }
        }
        self.free.push(children);
    }

    /// Takes the leaf pairs that came to meet since they were taken last, and still do.
    pub(crate) fn take_fresh(&mut self, found: &mut Vec<[u32; 2]>) {
        found.clear();
        let mut fresh = std::mem::take(&mut self.fresh);
        // A pair may have parted and met again.
        fresh.sort_unstable();
        fresh.dedup();
        for &pair in &fresh {
            let NodePair { nodes, meets, children, .. } = self.pairs[pair as usize];
            if meets && children == 0 {
                found.push(nodes);
            }
        }
        fresh.clear();
        self.fresh = fresh;
    }

    /// Makes all leaf pairs that meet fresh.
    pub(crate) fn refresh_all(&mut self) {
        self.fresh.clear();
        let meeting = |pair: &NodePair| pair.meets && pair.children == 0;
        let all = (0_u32..).zip(&self.pairs);
        self.fresh.extend(all.filter(|(_, pair)| meeting(pair)).map(|(i, _)| i));
    }

    /// Forgets which leaf pairs came to meet.
    pub(crate) fn forget_fresh(&mut self) {
        self.fresh.clear();
    }

    /// Calls `visit` with the nodes of each pair without pairs below it, and with `true` if it
    /// meets.
    pub(crate) fn for_each(&self, mut visit: impl FnMut([u32; 2], bool)) {
        for pair in self.pairs.iter().filter(|pair| pair.nodes[0] != NONE && pair.children == 0) {
            visit(pair.nodes, pair.meets);
        }
    }
}

/// Returns `true` if the boxes are apart on a side now.
fn is_apart(view: View<'_>, nodes: [u32; 2], side: Side) -> bool {
    let [above, below] = view.bounds(nodes, side);
    above.0[0] > below.0[0]
}

/// Returns the one of `sides` on which the boxes stay apart longest, and until when.
fn last_to_meet(view: View<'_>, nodes: [u32; 2], sides: impl Iterator<Item = Side>) -> Option<(Side, f64)> {
    let until = |side| {
        let [above, below] = view.bounds(nodes, side);
        (side, later(view.now, above.overtaken_in(&below)))
    };
    sides.map(until).reduce(|a, b| if b.1 > a.1 { b } else { a })
}

/// Returns the side on which boxes that meet part first, and when.
fn first_to_part(view: View<'_>, nodes: [u32; 2]) -> (Side, f64) {
    let when = |side| {
        let [above, below] = view.bounds(nodes, side);
        (side, later(view.now, below.overtaken_in(&above)))
    };
    (1..SIDES).map(when).fold(when(0), |a, b| if b.1 < a.1 { b } else { a })
}
