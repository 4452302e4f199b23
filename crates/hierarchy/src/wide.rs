//! The tree with four children a node, whose boxes stand side by side: sixteen pairs of boxes are compared in
//! one pass.
//!
//! Every other level of the binary tree is left out. What a boolean query costs is pairs of boxes, and with
//! sixteen in the lanes of a register a pair costs a sixth of what it costs four at a time; the boxes of a
//! level that is left out would have parted few (docs/decisions). Made from the binary tree whenever that is
//! made or loaded, in O(nodes): nothing of it is stored.

use nearmiss_geometry::NodeId;
use nearmiss_lanes::id32;

use crate::boxes::OrientedBox;
use crate::growth::Growth;
use crate::leaf_block::{Leaves, TreeParts};

/// Children of a node.
pub(crate) const WIDTH: usize = 4;

/// Pairs of children.
pub(crate) const LANES: usize = WIDTH * WIDTH;

pub(crate) type Lanes = [f32; WIDTH];

/// A node of a [`WideTree`]: a leaf by its number in the order of the points, or an inner node by its place
/// there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Child(u32);

impl Child {
    const LEAF: u32 = 1 << 31;
    pub(crate) const NONE: Self = Self(u32::MAX);

    pub(crate) fn leaf(number: u32) -> Self {
        Self(number | Self::LEAF)
    }

    /// Whether it is a leaf.
    #[inline]
    #[must_use]
    pub const fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    #[inline]
    pub(crate) const fn index(self) -> usize {
        (self.0 & !Self::LEAF) as usize
    }
}

/// The boxes of up to four children.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(64))]
pub(crate) struct Siblings {
    pub(crate) centre: [Lanes; 3],
    pub(crate) half: [Lanes; 3],
    pub(crate) axes: [[Lanes; 3]; 3],
    pub(crate) children: [Child; WIDTH],
}

impl Siblings {
    pub(crate) const NONE: Self = Self {
        centre: [[0.0; WIDTH]; 3],
        half: [[0.0; WIDTH]; 3],
        axes: [[[0.0; WIDTH]; 3]; 3],
        children: [Child::NONE; WIDTH],
    };

    pub(crate) fn set(&mut self, lane: usize, bounds: &OrientedBox, child: Child) {
        for k in 0..3 {
            self.centre[k][lane] = bounds.centre[k];
            self.half[k][lane] = bounds.half[k];
            for j in 0..3 {
                self.axes[k][j][lane] = bounds.axes[k][j];
            }
        }
        self.children[lane] = child;
    }

    /// The lanes that have a child, as bits: the first few.
    #[inline]
    pub(crate) fn lanes(&self) -> u32 {
        let there = |lane: usize| u32::from(self.children[lane] != Child::NONE) << lane;
        there(0) | there(1) | there(2) | there(3)
    }
}

/// What the enclosures of up to four children reach further than their boxes, as [`Growth::pairs`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(C, align(16))]
pub(crate) struct Growths(pub(crate) [[u32; WIDTH]; 3]);

impl Growths {
    pub(crate) fn set(&mut self, lane: usize, growth: &Growth) {
        for (row, pair) in self.0.iter_mut().zip(growth.pairs()) {
            row[lane] = pair;
        }
    }
}

/// The tree with four children a node.
#[derive(Debug, Clone, Default)]
pub struct WideTree {
    pub(crate) nodes: Vec<Siblings>,
    /// What the enclosures of the same children reach further, by [`crate::Part`].
    pub(crate) growths: [Vec<Growths>; 2],
    /// The id of each node in the binary tree.
    ids: Vec<u32>,
    /// What leaves are compared by.
    pub leaves: Leaves,
}

impl WideTree {
    /// Every other level of the tree of these nodes, level by level: what all queries look at stands
    /// together.
    pub(crate) fn of(scan: &TreeParts<'_>) -> Self {
        let TreeParts { nodes, boxes, growths, leaf_size, .. } = *scan;
        let is_leaf = |id: NodeId| nodes[id.index()].is_leaf();
        let children = |id: NodeId| nodes[id.index()].children(id);
        let mut ids: Vec<u32> = if nodes.len() > 1 { vec![0] } else { Vec::new() };
        let mut wide: Vec<Siblings> = Vec::with_capacity(nodes.len().div_ceil(WIDTH));
        let mut wide_growths = growths.map(|_| Vec::with_capacity(nodes.len().div_ceil(WIDTH)));
        while let Some(&id) = ids.get(wide.len()) {
            let mut siblings = Siblings::NONE;
            let mut grown = [Growths::default(); 2];
            let below = children(NodeId(id))
                .into_iter()
                .map(|child| if is_leaf(child) { [Some(child), None] } else { children(child).map(Some) });
            for (lane, id) in below.flatten().flatten().enumerate() {
                let child = if is_leaf(id) {
                    Child::leaf(nodes[id.index()].first / leaf_size)
                } else {
                    ids.push(id.0);
                    Child(id32(ids.len() - 1))
                };
                siblings.set(lane, &boxes[id.index()], child);
                for (grown, growths) in grown.iter_mut().zip(growths) {
                    grown.set(lane, &growths[id.index()]);
                }
            }
            wide.push(siblings);
            for (wide_growths, grown) in wide_growths.iter_mut().zip(grown) {
                wide_growths.push(grown);
            }
        }
        Self { nodes: wide, growths: wide_growths, ids, leaves: Leaves::of(scan) }
    }

    /// The root.
    #[must_use]
    pub fn root(&self) -> Child {
        if self.nodes.is_empty() { Child::leaf(0) } else { Child(0) }
    }

    /// The leaf with the `i`-th stored point.
    #[inline]
    #[must_use]
    pub fn leaf_of(&self, i: usize) -> Child {
        Child::leaf(id32(self.leaves.leaf_of(i)))
    }

    /// The id of a node in the binary tree.
    ///
    /// # Panics
    /// When there is no such node.
    #[inline]
    #[must_use]
    pub fn id(&self, child: Child) -> NodeId {
        NodeId(if child.is_leaf() { self.leaves.id(child.index()) } else { self.ids[child.index()] })
    }
}

impl WideTree {
    /// The children of an inner node: the first few of four.
    ///
    /// # Panics
    /// When there is no such node, or it is a leaf.
    #[inline]
    #[must_use]
    pub fn children(&self, node: Child) -> ([Child; WIDTH], usize) {
        let siblings = &self.nodes[node.index()];
        (siblings.children, siblings.lanes().count_ones() as usize)
    }

    /// The children of the children of an inner node, and those of its children that are leaves, in lanes;
    /// and the lanes that are taken, as bits.
    ///
    /// # Panics
    /// When there is no such node, or it is a leaf.
    #[inline]
    #[must_use]
    pub fn grandchildren(&self, node: Child) -> ([Child; LANES], u32) {
        let (mut below, mut taken) = ([Child::NONE; LANES], 0);
        for (group, (siblings, lanes)) in self.groups(node).into_iter().enumerate() {
            below[WIDTH * group..][..WIDTH].copy_from_slice(&self.nodes[siblings].children);
            taken |= lanes << (WIDTH * group);
        }
        (below, taken)
    }

    /// For each child of an inner node the siblings that hold what takes its place among the grandchildren,
    /// and their lanes: its own children, or itself.
    #[inline(always)]
    pub(crate) fn groups(&self, node: Child) -> [(usize, u32); WIDTH] {
        let own = node.index();
        let Siblings { children, .. } = &self.nodes[own];
        let mut groups = [(own, 0); WIDTH];
        for (lane, (group, child)) in groups.iter_mut().zip(children).enumerate() {
            if *child == Child::NONE {
                break;
            }
            *group = if child.is_leaf() {
                (own, 1 << lane)
            } else {
                (child.index(), self.nodes[child.index()].lanes())
            };
        }
        groups
    }
}

/// Which nodes of a pair that are not both leaves stay whole: leaves, and those that are less than half as
/// long as the other, of which lengths are `scale` times as long.
///
/// # Panics
/// When there are no such nodes.
#[inline]
#[must_use]
pub fn whole(trees: [&WideTree; 2], pair: [Child; 2], scale: f32) -> [bool; 2] {
    let [a, b] = pair.map(Child::is_leaf);
    if a || b {
        return [a, b];
    }
    let longest = |side: usize| {
        let [a, b, c, d] = trees[side].nodes[pair[side].index()].half[0];
        greater(greater(a, b), greater(c, d))
    };
    let (a, b) = (longest(0), longest(1) * scale);
    [b > 2.0 * a, a > 2.0 * b]
}

/// Of two numbers.
#[inline(always)]
fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
