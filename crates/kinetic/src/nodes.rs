//! `Nodes`: the nodes of a tree, with the extremal points and certificates of each, and the leaves.
//!
//! The tree is its own event queue: each node knows the earliest event at or below it. An event
//! changes nodes on the way to the root only, and that way is also where the queue changes. It reads
//! one cache line for each node on it.

use bytemuck::{Pod, Zeroable};
use nearmiss_lanes::id32;

use crate::points::Side;
use crate::primitives::NONE;

/// The root. Node 1 is unused, because siblings are side by side.
pub(crate) const ROOT: u32 = 0;

/// The number of sides of a box.
pub(crate) const SIDES: usize = 6;

/// A flag of a node that it, or a node below it, must be refreshed.
pub(crate) const DIRTY: u32 = 1;

/// A flag of a node that all its sides must be computed.
pub(crate) const FRESH: u32 = 2;

/// The part of a node that the queue and the way to the root need.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub(crate) struct Link {
    /// The earliest failure of a certificate of this node, in seconds; infinite if none can fail.
    pub(crate) own: f64,
    /// The earliest failure at or below this node.
    pub(crate) first: f64,
    /// The node of that failure.
    pub(crate) first_at: u32,
    /// The node above; [`NONE`] for the root.
    pub(crate) parent: u32,
    /// The first of the two nodes below; 0 for a leaf.
    pub(crate) children: u32,
    /// The number of primitives below.
    pub(crate) size: u32,
}

impl Link {
    /// A leaf with nothing in it.
    const EMPTY: Self =
        Self { own: f64::INFINITY, first: f64::INFINITY, first_at: ROOT, parent: NONE, children: 0, size: 0 };

    /// Returns `true` if the node has no children.
    #[inline]
    pub(crate) const fn is_leaf(&self) -> bool {
        self.children == 0
    }
}

/// Two siblings in one cache line.
#[repr(C, align(64))]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub(crate) struct Siblings([Link; 2]);

/// The rest of a node: six extremal points and six certificates.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub(crate) struct Node {
    /// When the certificate of each side fails, in seconds; infinite if never.
    pub(crate) times: [f64; SIDES],
    /// The slot of the extremal point of each side; [`NONE`] in an empty tree.
    pub(crate) winners: [u32; SIDES],
    /// The slot of the point that overtakes it when the certificate fails.
    pub(crate) rivals: [u32; SIDES],
    /// The place of a leaf's lists.
    pub(crate) block: u32,
    /// [`DIRTY`] and [`FRESH`]; of a leaf, also four times its number of points.
    pub(crate) flags: u32,
}

impl Node {
    /// A leaf with nothing in it.
    pub(crate) const EMPTY: Self = Self {
        times: [f64::INFINITY; SIDES],
        winners: [NONE; SIDES],
        rivals: [NONE; SIDES],
        block: NONE,
        flags: 0,
    };

    /// Returns the side whose certificate fails first.
    #[inline]
    pub(crate) fn first_side(&self) -> Side {
        (1..SIDES).fold(0, |a, b| if self.times[b] < self.times[a] { b } else { a })
    }

    /// Returns the time at which it fails.
    #[inline]
    fn first_time(&self) -> f64 {
        self.times.iter().copied().fold(f64::INFINITY, f64::min)
    }
}

/// All nodes and leaves.
#[derive(Debug, Clone)]
pub(crate) struct Nodes {
    pub(crate) links: Vec<Siblings>,
    pub(crate) nodes: Vec<Node>,
    /// Pairs of siblings that are unused, by the first of them.
    pub(crate) free_pairs: Vec<u32>,
    /// The most primitives of a leaf.
    pub(crate) leaf_size: usize,
    /// The most points of a leaf.
    pub(crate) leaf_points: usize,
    /// The primitives of each leaf, `leaf_size` numbers each.
    pub(crate) primitives: Vec<u32>,
    /// The slots of the points of each leaf, each of them once, `leaf_points` numbers each.
    pub(crate) points: Vec<u32>,
    /// Blocks of leaves that are unused.
    pub(crate) free_blocks: Vec<u32>,
}

impl Nodes {
    pub(crate) fn new(leaf_size: usize, arity: usize) -> Self {
        let [free_pairs, primitives, points, free_blocks] = [const { Vec::new() }; 4];
        let leaf_points = leaf_size * arity;
        let (links, nodes) = (vec![Siblings([Link::EMPTY; 2])], vec![Node::EMPTY; 2]);
        Self { links, nodes, free_pairs, leaf_size, leaf_points, primitives, points, free_blocks }
    }

    #[inline]
    pub(crate) fn get(&self, node: u32) -> &Node {
        &self.nodes[node as usize]
    }

    #[inline]
    pub(crate) fn get_mut(&mut self, node: u32) -> &mut Node {
        &mut self.nodes[node as usize]
    }

    #[inline]
    pub(crate) fn link(&self, node: u32) -> &Link {
        &self.links[node as usize / 2].0[node as usize % 2]
    }

    #[inline]
    pub(crate) fn link_mut(&mut self, node: u32) -> &mut Link {
        &mut self.links[node as usize / 2].0[node as usize % 2]
    }

    /// Returns the primitives of a leaf.
    #[inline]
    pub(crate) fn primitives_of(&self, leaf: u32) -> &[u32] {
        let size = self.link(leaf).size as usize;
        if size == 0 {
            return &[];
        }
        let start = self.get(leaf).block as usize * self.leaf_size;
        &self.primitives[start..start + size]
    }

    /// Returns the slots of the points of a leaf, each of them once.
    #[inline]
    pub(crate) fn points_of(&self, leaf: u32) -> &[u32] {
        let node = self.get(leaf);
        let count = node.flags as usize / 4;
        if count == 0 {
            return &[];
        }
        let start = node.block as usize * self.leaf_points;
        &self.points[start..start + count]
    }

    /// Returns the block of a leaf, a new one if it has none.
    pub(crate) fn block_of(&mut self, leaf: u32) -> u32 {
        if self.get(leaf).block == NONE {
            let block = self.free_blocks.pop().unwrap_or_else(|| {
                let block = self.primitives.len() / self.leaf_size;
                self.primitives.resize((block + 1) * self.leaf_size, NONE);
                self.points.resize((block + 1) * self.leaf_points, NONE);
                id32(block)
            });
            self.get_mut(leaf).block = block;
        }
        self.get(leaf).block
    }

    /// Gives a leaf two children.
    pub(crate) fn split(&mut self, leaf: u32) -> u32 {
        self.free_block(leaf);
        let children = self.free_pairs.pop().unwrap_or_else(|| {
            self.nodes.extend([Node::EMPTY; 2]);
            self.links.push(Siblings([Link::EMPTY; 2]));
            id32(self.nodes.len() - 2)
        });
        for child in [children, children + 1] {
            *self.get_mut(child) = Node::EMPTY;
            *self.link_mut(child) = Link { parent: leaf, first_at: child, ..Link::EMPTY };
        }
        self.link_mut(leaf).children = children;
        children
    }

    /// Appends the primitives below a node, in the order of the leaves.
    pub(crate) fn list(&self, node: u32, found: &mut Vec<u32>) {
        let children = self.link(node).children;
        if children == 0 {
            return found.extend_from_slice(self.primitives_of(node));
        }
        self.list(children, found);
        self.list(children + 1, found);
    }

    /// Makes a leaf of a node, appending the primitives below it to `found`.
    pub(crate) fn gather(&mut self, node: u32, found: &mut Vec<u32>) {
        let children = self.link(node).children;
        if children == 0 {
            found.extend_from_slice(self.primitives_of(node));
            self.free_block(node);
        } else {
            self.gather(children, found);
            self.gather(children + 1, found);
            self.free_pairs.push(children);
            self.link_mut(node).children = 0;
        }
    }

    fn free_block(&mut self, leaf: u32) {
        let block = std::mem::replace(&mut self.get_mut(leaf).block, NONE);
        if block != NONE {
            self.free_blocks.push(block);
        }
        self.get_mut(leaf).flags &= DIRTY | FRESH;
    }

    /// Marks `node` and all nodes above it to be refreshed.
    pub(crate) fn mark(&mut self, node: u32, flags: u32) {
        self.get_mut(node).flags |= flags;
        let mut at = node;
        while at != NONE && self.get(at).flags & DIRTY == 0 {
            self.get_mut(at).flags |= DIRTY;
            at = self.link(at).parent;
        }
    }

    /// Notes that certificates of a node changed. [`Self::compare`] has to follow.
    #[inline]
    pub(crate) fn retime(&mut self, at: u32) {
        self.link_mut(at).own = self.get(at).first_time();
    }

    /// Compares the earliest event of a node again; returns `true` if it changed.
    #[inline]
    pub(crate) fn compare(&mut self, at: u32) -> bool {
        let link = self.link(at);
        let mut best = (link.own, at);
        if !link.is_leaf() {
            for child in &self.links[link.children as usize / 2].0 {
                if child.first < best.0 {
                    best = (child.first, child.first_at);
                }
            }
        }
        let link = self.link_mut(at);
        let is_new = (link.first, link.first_at) != best;
        (link.first, link.first_at) = best;
        is_new
    }

    /// Returns `true` if a node must be rebuilt: a child is empty or holds more than three
    /// quarters, or one small leaf would do. So the height is at most log n / log (4/3) and a
    /// constant.
    pub(crate) fn is_unbalanced(&self, node: u32) -> bool {
        let node = self.link(node);
        if node.is_leaf() {
            return node.size as usize > self.leaf_size;
        }
        let sizes = [node.children, node.children + 1].map(|child| self.link(child).size);
        let [least, most] = [sizes[0].min(sizes[1]), sizes[0].max(sizes[1])];
        least == 0 || 4 * u64::from(most) > 3 * u64::from(node.size) + 4 || self.fits_half_a_leaf(node.size)
    }

    const fn fits_half_a_leaf(&self, size: u32) -> bool {
        size as usize <= self.leaf_size / 2
    }

    /// Returns the number of nodes in use.
    pub(crate) const fn len(&self) -> usize {
        self.nodes.len() - 1 - 2 * self.free_pairs.len()
    }

    /// Returns the bytes in use.
    pub(crate) const fn bytes(&self) -> usize {
        let words =
            self.primitives.len() + self.points.len() + self.free_pairs.len() + self.free_blocks.len();
        self.nodes.len() * (size_of::<Node>() + size_of::<Link>()) + words * size_of::<u32>()
    }
}
