//! The nodes of a tree and the points under each. All of it is arithmetic; nothing is stored.
//!
//! Points are in leaf order, and every leaf but the last is full. The leaves are halved repeatedly:
//! at binary depth d, part j of 2ᵈ has the leaves from ⌈j m / 2ᵈ⌉ to ⌈(j + 1) m / 2ᵈ⌉ of m. Every
//! other depth is kept, counted from the bottom. Nodes therefore have four children, with two
//! exceptions: nodes of the lowest level have two to four leaves, and the root has two children if
//! the number of depths is even. Nodes are numbered level by level; the children of a node have
//! consecutive ids.

use std::ops::Range;

use nearmiss_geometry::NodeId;
use nearmiss_lanes::id32;
use serde::{Deserialize, Serialize};

/// The maximum number of points in a leaf. Queries reserve memory for this many.
pub const MOST_LEAF_POINTS: usize = 64;

/// The number of children of a node.
pub(crate) const FAN: usize = 4;

/// Stack size for a depth-first descent of one tree. On each level three children wait while the
/// fourth is visited; trees of 2³² points have 16 levels of four children and a root.
pub(crate) const TREE_STACK: usize = 64;

/// One node of each tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct NodePair {
    /// A node of the first tree.
    pub a: NodeId,
    /// A node of the second tree.
    pub b: NodeId,
}

impl NodePair {
    /// The pair of roots.
    pub const ROOTS: Self = Self { a: NodeId::ROOT, b: NodeId::ROOT };
}

/// Nodes in sixteen lanes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LaneNodes {
    /// The first node of each group of four lanes.
    starts: [u32; FAN],
    /// Mask of the bits of a lane's index that give the offset of its node from the first.
    mask: u32,
}

impl LaneNodes {
    /// Returns one node in all lanes.
    #[inline]
    #[must_use]
    pub const fn alone(id: NodeId) -> Self {
        Self { starts: [id.0; FAN], mask: 0 }
    }

    /// Returns child k in lanes 4k to 4k + 3.
    #[inline]
    #[must_use]
    pub const fn spread(children: Children) -> Self {
        let first = children.first;
        Self { starts: [first, first + 1, first + 2, first + 3], mask: 0 }
    }

    /// Returns child k in lanes k, 4 + k, 8 + k and 12 + k.
    #[inline]
    #[must_use]
    pub const fn repeated(children: Children) -> Self {
        Self { starts: [children.first; FAN], mask: 3 }
    }

    /// Returns the node in a lane, of sixteen.
    #[inline]
    #[must_use]
    pub fn id(&self, lane: usize) -> NodeId {
        NodeId(self.starts[lane / FAN % FAN] + (id32(lane) & self.mask))
    }
}

/// The children of the children of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Grandchildren {
    /// The children of child k from lane 4k on. If the children are leaves, child k itself in lane
    /// 5k.
    pub nodes: LaneNodes,
    /// The lanes in use, as bits.
    pub lanes: u32,
    /// For each group of four lanes, the node whose children have the boxes of these lanes.
    pub(crate) parents: [NodeId; FAN],
}

/// The nodes of a tree. Ids count inner nodes first, from the root, then leaves in the order of
/// their points. The children of a node have consecutive ids.
#[derive(Debug, Clone, Copy, Eq)]
pub struct Topology {
    points: u32,
    leaf_size: u32,
    inner: u32,
    leaves: u32,
    /// The first node whose children are leaves.
    bottom: u32,
    /// Binary depth of the nodes whose children are leaves.
    depth: u32,
}

/// Everything else follows from the numbers of points, in total and in a leaf.
impl PartialEq for Topology {
    #[inline]
    fn eq(&self, other: &Self) -> bool {
        self.points == other.points && self.leaf_size == other.leaf_size
    }
}

/// The children of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Children {
    /// The first child.
    pub(crate) first: u32,
    pub(crate) count: u32,
}

impl Children {
    /// Returns the number of children: one to four.
    #[inline(always)]
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "an inner node has children")]
    pub const fn len(self) -> usize {
        self.count as usize
    }

    /// Returns the ids of the children, ascending.
    #[inline]
    pub fn iter(self) -> impl DoubleEndedIterator<Item = NodeId> + ExactSizeIterator {
        (self.first..self.first + self.count).map(NodeId)
    }

    /// Returns the ids of the children, followed by other ids up to four.
    #[inline(always)]
    #[must_use]
    pub const fn lanes(self) -> [NodeId; FAN] {
        let first = self.first;
        [NodeId(first), NodeId(first + 1), NodeId(first + 2), NodeId(first + 3)]
    }
}

impl Topology {
    /// Creates the tree of `points` points, which must not be zero.
    pub(crate) fn new(points: u32, leaf_size: u32) -> Self {
        let leaves = points.div_ceil(leaf_size);
        // At the lowest binary depth each node has two to four leaves.
        let depth = leaves.div_ceil(4).next_power_of_two().ilog2();
        let bottom = Self::level_start(depth % 2, depth.div_ceil(2));
        let inner = if leaves > 1 { bottom + (1 << depth) } else { 0 };
        Self { points, leaf_size, inner, leaves, bottom, depth }
    }

    /// Returns the first node of a level: a third of the level's size, rounded. `is_odd` is 1 if
    /// the root has only two children.
    const fn level_start(is_odd: u32, level: u32) -> u32 {
        if is_odd == 0 || level == 0 {
            ((1 << (2 * level)) - 1) / 3
        } else {
            1 + 2 * (((1 << (2 * level - 2)) - 1) / 3)
        }
    }

    /// Returns 1 if the root has only two children, otherwise 0.
    #[inline(always)]
    const fn is_odd(&self) -> u32 {
        self.depth % 2
    }

    /// Returns the leaves of part `j` at a binary depth.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "at most the number of leaves")]
    fn leaves_at(&self, depth: u32, j: u32) -> Range<u32> {
        let leaves = u64::from(self.leaves);
        let parts = u64::from(j) * leaves + (1 << depth) - 1;
        (parts >> depth) as u32..((parts + leaves) >> depth) as u32
    }

    /// Returns the number of nodes, leaves included.
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "a tree has a root")]
    pub const fn len(&self) -> usize {
        (self.inner + self.leaves) as usize
    }

    /// Returns all nodes.
    #[must_use]
    pub fn ids(&self) -> impl DoubleEndedIterator<Item = NodeId> + ExactSizeIterator + use<> {
        (0..self.inner + self.leaves).map(NodeId)
    }

    /// Returns the number of nodes that have children.
    #[inline]
    #[must_use]
    pub const fn inner(&self) -> usize {
        self.inner as usize
    }

    /// Returns the number of leaves.
    #[inline]
    #[must_use]
    pub const fn leaves(&self) -> usize {
        self.leaves as usize
    }

    /// Returns the number of points in a full leaf.
    #[inline]
    #[must_use]
    pub const fn leaf_size(&self) -> usize {
        self.leaf_size as usize
    }

    /// Returns `true` if the node has no children.
    #[inline(always)]
    #[must_use]
    pub const fn is_leaf(&self, id: NodeId) -> bool {
        id.0 >= self.inner
    }

    /// Returns `true` if there is such a node.
    #[inline]
    #[must_use]
    pub const fn has(&self, id: NodeId) -> bool {
        id.0 < self.inner + self.leaves
    }

    /// Returns the leaf with this number.
    #[inline(always)]
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "leaves are counted in 32 bits")]
    pub const fn leaf(&self, number: usize) -> NodeId {
        NodeId(self.inner + number as u32)
    }

    /// Returns the number of a leaf.
    #[inline(always)]
    #[must_use]
    pub const fn leaf_number(&self, leaf: NodeId) -> usize {
        (leaf.0 - self.inner) as usize
    }

    /// Returns the leaf of a point.
    #[inline]
    #[must_use]
    pub const fn leaf_of(&self, point: usize) -> NodeId {
        self.leaf(point / self.leaf_size as usize)
    }

    /// Returns the points of a leaf, by its number.
    #[inline(always)]
    #[must_use]
    pub fn points_of_leaf(&self, number: usize) -> Range<usize> {
        let first = number * self.leaf_size();
        first..(self.points as usize).min(first + self.leaf_size())
    }

    /// Returns the children of an inner node.
    #[inline(always)]
    #[must_use]
    pub fn children(&self, id: NodeId) -> Children {
        if id.0 >= self.bottom {
            let leaves = self.leaves_at(self.depth, id.0 - self.bottom);
            return Children { first: self.inner + leaves.start, count: leaves.end - leaves.start };
        }
        match (id.0, self.is_odd()) {
            (0, 1) => Children { first: 1, count: 2 },
            (id, is_odd) => Children { first: 4 * id + 1 - 2 * is_odd, count: 4 },
        }
    }

    /// Returns the grandchildren of an inner node.
    #[inline(always)]
    #[must_use]
    pub fn grandchildren(&self, id: NodeId) -> Grandchildren {
        /// The lanes of children that are leaves.
        const DIAGONAL: u32 = 0b1000_0100_0010_0001;
        let children = self.children(id);
        let Children { first, count } = children;
        if self.is_leaf(NodeId(first)) {
            let lanes = DIAGONAL & ((1 << (5 * count - 4)) - 1);
            return Grandchildren { nodes: LaneNodes::repeated(children), lanes, parents: [id; FAN] };
        }
        let (starts, lanes) = if first < self.bottom {
            // They are consecutive, as their parents are.
            let next = self.children(NodeId(first)).first;
            ([next, next + 4, next + 8, next + 12], (1 << (4 * count)) - 1)
        } else {
            let (mut starts, mut lanes) = ([first; FAN], 0);
            for (k, start) in (0..count).zip(&mut starts) {
                let children = self.children(NodeId(first + k));
                *start = children.first;
                lanes |= ((1 << children.count) - 1) << (4 * k);
            }
            (starts, lanes)
        };
        let nodes = LaneNodes { starts, mask: id32(FAN) - 1 };
        let last = first + count - 1;
        let parent = |k: u32| NodeId(last.min(first + k));
        Grandchildren { nodes, lanes, parents: [parent(0), parent(1), parent(2), parent(3)] }
    }

    /// Returns the parent of a node and the node's position among its children; `None` for the
    /// root.
    #[inline]
    #[must_use]
    pub fn parent(&self, id: NodeId) -> Option<(NodeId, usize)> {
        if id == NodeId::ROOT {
            return None;
        }
        if self.is_leaf(id) {
            let number = id.0 - self.inner;
            #[expect(clippy::cast_possible_truncation, reason = "no more than there are nodes")]
            let j = ((u64::from(number) << self.depth) / u64::from(self.leaves)) as u32;
            return Some((NodeId(self.bottom + j), (number - self.leaves_at(self.depth, j).start) as usize));
        }
        let place = id.0 - 1 + 2 * self.is_odd();
        // If the root has two children, they are the last two of four positions.
        let lane = if place < 4 { place - 2 * self.is_odd() } else { place % 4 };
        Some((NodeId(place / 4), lane as usize))
    }

    /// Returns the numbers of the leaves under a node.
    #[inline]
    #[must_use]
    pub fn leaves_under(&self, id: NodeId) -> Range<usize> {
        if self.is_leaf(id) {
            let number = self.leaf_number(id);
            return number..number + 1;
        }
        if id == NodeId::ROOT {
            return 0..self.leaves();
        }
        let (is_odd, number, id) = (self.is_odd(), id.0, u64::from(id.0));
        let level =
            if is_odd == 0 { (3 * id + 1).ilog2() / 2 } else { (3 * (id - 1) / 2 + 1).ilog2() / 2 + 1 };
        let leaves = self.leaves_at(2 * level - is_odd, number - Self::level_start(is_odd, level));
        leaves.start as usize..leaves.end as usize
    }

    /// Returns the nodes that are this many levels below an inner node, by their ids, or the lowest inner
    /// nodes under it if those are nearer.
    pub(crate) fn inner_below(&self, id: NodeId, mut levels: u32) -> Range<usize> {
        let (mut first, mut last) = (id.0, id.0);
        while levels > 0 && first < self.bottom {
            levels -= 1;
            let children = self.children(NodeId(last));
            (first, last) = (self.children(NodeId(first)).first, children.first + children.count - 1);
        }
        first as usize..last as usize + 1
    }

    /// Returns the first node whose children are leaves.
    pub(crate) const fn first_bottom(&self) -> usize {
        self.bottom as usize
    }

    /// Returns the points under a node.
    #[inline]
    #[must_use]
    pub fn points(&self, id: NodeId) -> Range<usize> {
        let leaves = self.leaves_under(id);
        leaves.start * self.leaf_size()..(self.points as usize).min(leaves.end * self.leaf_size())
    }

    /// Returns the leaves of a half.
    pub(crate) fn leaves_of(&self, half: Half) -> Range<usize> {
        let leaves = self.leaves_at(half.depth, half.j);
        leaves.start as usize..leaves.end as usize
    }

    /// Returns the inner node that corresponds to a half, if there is one.
    pub(crate) fn node_of(&self, Half { depth, j }: Half) -> Option<NodeId> {
        let level = depth.div_ceil(2);
        let is_kept = depth == 0 || depth <= self.depth && depth % 2 == self.depth % 2;
        (is_kept && self.inner > 0).then(|| NodeId(Self::level_start(self.is_odd(), level) + j))
    }
}

/// One of the parts into which repeated halving divides the leaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Half {
    depth: u32,
    j: u32,
}

impl Half {
    /// All leaves.
    pub(crate) const ALL: Self = Self { depth: 0, j: 0 };

    /// Returns the two halves of this half.
    pub(crate) fn halves(self) -> [Self; 2] {
        [0, 1].map(|k| Self { depth: self.depth + 1, j: 2 * self.j + k })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trees() -> impl Iterator<Item = Topology> {
        let sizes = (1..300).chain([1000, 4095, 4096, 4097, 70_000, 1_000_003]);
        sizes.flat_map(|points| [4, 5, 16, 64].map(|leaf_size| Topology::new(points, leaf_size)))
    }

    #[test]
    fn every_node_but_the_root_is_the_child_of_its_parent_alone() {
        for tree in trees().filter(|tree| tree.len() < 3000) {
            let mut seen = vec![0; tree.len()];
            for id in tree.ids().filter(|&id| !tree.is_leaf(id)) {
                for (lane, child) in tree.children(id).iter().enumerate() {
                    seen[child.index()] += 1;
                    assert_eq!(tree.parent(child), Some((id, lane)), "{tree:?}");
                }
            }
            assert_eq!(tree.parent(NodeId::ROOT), None);
            assert!(seen[0] == 0 && seen[1..].iter().all(|&count| count == 1), "{tree:?}: {seen:?}");
        }
    }

    #[test]
    fn children_share_the_points_of_their_parent_in_order() {
        for tree in trees().filter(|tree| tree.len() < 3000) {
            assert_eq!(tree.points(NodeId::ROOT), 0..tree.points as usize, "{tree:?}");
            for id in tree.ids().filter(|&id| !tree.is_leaf(id)) {
                let (own, mut next) = (tree.points(id), tree.points(id).start);
                for child in tree.children(id).iter() {
                    let points = tree.points(child);
                    assert!(points.start == next && !points.is_empty(), "{tree:?}, {id:?}");
                    next = points.end;
                }
                assert_eq!(next, own.end, "{tree:?}, {id:?}");
            }
        }
    }

    #[test]
    fn the_inner_nodes_of_a_level_under_a_node_share_its_leaves() {
        for tree in trees().filter(|tree| tree.len() < 3000 && tree.inner() > 0) {
            for id in tree.ids().filter(|&id| !tree.is_leaf(id)) {
                for levels in [0, 1, 2, 32] {
                    let below = tree.inner_below(id, levels);
                    let leaves = below.clone().map(|node| tree.leaves_under(NodeId(id32(node))));
                    assert!(leaves.flatten().eq(tree.leaves_under(id)), "{tree:?}, {id:?}, {levels}");
                    assert!(levels < 32 || below.start >= tree.first_bottom(), "{tree:?}, {id:?}");
                    assert!(below.len() <= 4_usize.saturating_pow(levels), "{tree:?}, {id:?}, {levels}");
                }
            }
        }
    }

    #[test]
    fn inner_nodes_are_at_most_two_thirds_as_many_as_leaves() {
        for tree in trees() {
            assert!(3 * tree.inner() <= 2 * tree.leaves() + 6, "{tree:?}");
            let lowest = tree.ids().filter(|&id| !tree.is_leaf(id)).filter(|&id| {
                id != NodeId::ROOT && tree.children(id).iter().all(|child| tree.is_leaf(child))
            });
            assert!(lowest.into_iter().all(|id| tree.children(id).len() >= 2), "{tree:?}");
        }
    }

    #[test]
    fn halves_that_are_nodes_have_their_leaves() {
        for tree in trees().filter(|tree| tree.len() < 3000) {
            let mut seen = vec![false; tree.len()];
            seen[0] = true;
            let mut open = vec![Half::ALL];
            while let Some(half) = open.pop() {
                let leaves = tree.leaves_of(half);
                if let Some(id) = tree.node_of(half) {
                    assert_eq!(tree.leaves_under(id), leaves, "{tree:?}, {half:?}");
                    seen[id.index()] = true;
                }
                if leaves.len() > 1 {
                    open.extend(half.halves());
                } else {
                    seen[tree.leaf(leaves.start).index()] = true;
                }
            }
            assert!(seen.iter().all(|&seen| seen), "{tree:?}");
        }
    }

    #[test]
    fn the_greatest_scan_has_a_tree() {
        let tree = Topology::new(u32::MAX, 4);
        let last = tree.leaf(tree.leaves() - 1);
        assert_eq!(tree.points(last).end, u32::MAX as usize);
        let (mut id, mut depth) = (NodeId::ROOT, 0);
        while !tree.is_leaf(id) {
            id = tree.children(id).iter().next_back().unwrap();
            depth += 1;
        }
        assert_eq!(id, last);
        assert!(3 * depth + FAN < TREE_STACK, "{depth}");
    }
}
