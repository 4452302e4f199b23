//! The least distance over all pairs of leaves, by branch and bound, nearest pair of nodes first.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use nearmiss_geometry::NodeId;
use nearmiss_hierarchy::{Node, NodePair, Split};

use crate::distance::bounds::{FAN, Motion};
use crate::posed::Posed;

/// A pair of nodes still to be looked at, and how near what is in them may be, in a's stored frame. Ordered so that the nearest is
/// greatest, and of equally near ones the first.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Open {
    bound: f64,
    pair: NodePair,
}

impl Ord for Open {
    #[inline]
    fn cmp(&self, other: &Self) -> Ordering {
        other.key().cmp(&self.key())
    }
}

impl PartialOrd for Open {
    #[inline]
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Open {
    fn eq(&self, other: &Self) -> bool {
        self.key() == other.key()
    }
}

impl Eq for Open {}

impl Open {
    /// Bounds are not negative, so their bits are in their order.
    #[inline]
    fn key(&self) -> u128 {
        u128::from(self.bound.to_bits()) << 64 | u128::from(self.pair.a.0) << 32 | u128::from(self.pair.b.0)
    }
}

/// The lanes of so many nodes of a, less one, with so many of b, less one.
const LANES: [[u32; FAN]; FAN] = {
    let mut lanes = [[0; FAN]; FAN];
    let mut i = 0;
    while i < FAN * FAN {
        let mut row = 0;
        while row <= i / FAN {
            let all_b = (1 << (i % FAN + 1)) - 1;
            lanes[i / FAN][i % FAN] |= all_b << (FAN * row);
            row += 1;
        }
        i += 1;
    }
    lanes
};

/// What stands for a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Volumes {
    /// The box about its points.
    Boxes,
    /// The box about its part of the surface.
    Enclosures,
}

/// A search through pairs of nodes. What is not open any more is at least `least` apart, or was looked at.
#[derive(Debug)]
pub(crate) struct Search<'s> {
    volumes: Volumes,
    open: &'s mut BinaryHeap<Open>,
    /// Nothing further apart than this, in a's stored frame, is looked at.
    pub(crate) least: f64,
    /// To be looked at next although it is not the nearest.
    front: Option<Open>,
    steps: u64,
}

impl<'s> Search<'s> {
    /// From the pair of the roots on.
    pub(crate) fn new(
        volumes: Volumes,
        open: &'s mut BinaryHeap<Open>,
        pair: &Posed<'_>,
        motion: &Motion,
    ) -> Self {
        open.clear();
        let mut search = Self { volumes, open, least: f64::INFINITY, front: None, steps: 0 };
        let roots = [NodeId::ROOT; FAN];
        let bound = search.bounds(pair, motion, roots, roots)[0];
        search.front = Some(Open { bound, pair: NodePair { a: NodeId::ROOT, b: NodeId::ROOT } });
        search
    }

    /// How near, in a's stored frame, what is open or at `least` may be.
    pub(crate) fn lower(&self) -> f64 {
        let of_front = self.front.map_or(f64::INFINITY, |o| o.bound);
        self.open.peek().map_or(self.least, |nearest| nearest.bound.min(self.least)).min(of_front)
    }

    /// Whether nothing nearer than `least` is left.
    pub(crate) fn is_over(&self) -> bool {
        self.front.is_none() && self.open.peek().is_none_or(|nearest| nearest.bound >= self.least)
    }

    /// Splits the nearest pair of nodes; if it is one of leaves takes it off, with its bound. None of either when the search is over.
    pub(crate) fn step(&mut self, pair: &mut Posed<'_>, motion: &Motion) -> Option<(f64, NodePair)> {
        self.steps += 1;
        let dives = self.front.is_some() || self.steps.is_power_of_two();
        let nearest =
            self.front.take().or_else(|| self.open.pop()).filter(|nearest| nearest.bound < self.least)?;
        let nodes = nearest.pair;
        let (a, b) = (&pair.a.nodes[nodes.a.index()], &pair.b.nodes[nodes.b.index()]);
        let split = match (a.is_leaf(), b.is_leaf()) {
            (true, true) => return Some((nearest.bound, nodes)),
            (true, false) => Split::Second,
            (false, true) => Split::First,
            (false, false) => pair.split(nodes),
        };
        let (a, count_a) =
            if split == Split::Second { ([nodes.a; FAN], 1) } else { below(pair.a.nodes, nodes.a) };
        let (b, count_b) =
            if split == Split::First { ([nodes.b; FAN], 1) } else { below(pair.b.nodes, nodes.b) };
        let bounds = self.bounds(pair, motion, a, b);
        pair.meter.spent.node_pairs += (count_a * count_b) as u64;
        let mut near = 0_u32;
        for (lane, bound) in bounds.iter().enumerate() {
            near |= u32::from(*bound < self.least) << lane;
        }
        near &= LANES[count_a - 1][count_b - 1];
        while near != 0 {
            let lane = near.trailing_zeros() as usize;
            near &= near - 1;
            // What is in its parents is no nearer than they are.
            let bound = bounds[lane].max(nearest.bound);
            let own = Open { bound, pair: NodePair { a: a[lane / FAN], b: b[lane % FAN] } };
            if !dives {
                self.open.push(own);
            } else if let Some(front) = self.front.take() {
                self.open.push(front.min(own));
                self.front = Some(front.max(own));
            } else {
                self.front = Some(own);
            }
        }
        None
    }

    fn bounds(
        &self,
        pair: &Posed<'_>,
        motion: &Motion,
        a: [NodeId; FAN],
        b: [NodeId; FAN],
    ) -> [f64; FAN * FAN] {
        match self.volumes {
            Volumes::Boxes => {
                let ([a0, a1, a2, a3], [b0, b1, b2, b3]) = (a, b);
                let (a, b) = (pair.a.boxes, pair.b.boxes);
                motion.distances(
                    [&a[a0.index()], &a[a1.index()], &a[a2.index()], &a[a3.index()]],
                    [&b[b0.index()], &b[b1.index()], &b[b2.index()], &b[b3.index()]],
                )
            }
            Volumes::Enclosures => {
                let [a0, a1, a2, a3] = a.map(|id| pair.a.enclosure(id.index()));
                let [b0, b1, b2, b3] = b.map(|id| pair.b.enclosure(id.index()));
                motion.distances([&a0, &a1, &a2, &a3], [&b0, &b1, &b2, &b3])
            }
        }
    }
}

/// The grandchildren of a node that is no leaf, children for those that are leaves; and how many they are.
#[inline]
fn below(nodes: &[Node], id: NodeId) -> ([NodeId; FAN], usize) {
    let mut found = [id; FAN];
    let mut count = 0;
    for child in nodes[id.index()].children(id) {
        let node = &nodes[child.index()];
        if node.is_leaf() {
            found[count] = child;
            count += 1;
        } else {
            let [left, right] = node.children(child);
            (found[count], found[count + 1]) = (left, right);
            count += 2;
        }
    }
    (found, count)
}
