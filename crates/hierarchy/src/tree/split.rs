//! Construction of the tree: top-down, with each node split so that its children's boxes are small
//! ([`crate::tree::cut`]).

use std::sync::{Mutex, PoisonError};

use fearless_simd::Level;
use nearmiss_geometry::NodeId;
use nearmiss_lanes::parallel::both;

use crate::bounds::boxes::OrientedBox;
use crate::tree::cut::best_axis;
use crate::tree::items::{Item, Parts, about, partition};
use crate::tree::topology::{Half, Topology};

/// The minimum number of points for which another thread is used.
const TASK: usize = 4096;

/// Orders `items` into the leaves of `topology` and sets `boxes` to the boxes around the points of
/// all nodes, in the order of their ids. The first `dense` items, which must fill whole leaves
/// unless they are all, stay before the others. O(n log n).
pub(crate) fn split(
    items: &mut [Item],
    topology: &Topology,
    dense: usize,
    parts: Parts<'_>,
    boxes: &mut [OrientedBox],
) {
    let boxes = Mutex::new(boxes);
    Place { items, dense, half: Half::ALL, parts }.split(topology, &boxes);
}

/// The number of leaves that [`split_loose`] splits at most together.
const LEAVES_SPLIT: usize = 8;

/// Orders items that are in a good order for the most part, such as pixels along a curve: where the
/// points of a leaf `are_loose`, those of the up to eight leaves around it are split anew. The first
/// `dense` items stay before the others, as in [`split`].
pub(crate) fn split_loose(
    items: &mut [Item],
    topology: &Topology,
    dense: usize,
    are_loose: &(impl Fn(&[Item]) -> bool + Sync),
) {
    Place { items, dense, half: Half::ALL, parts: Parts::Points }.split_loose(topology, are_loose);
}

/// The points of some leaves.
struct Place<'a> {
    items: &'a mut [Item],
    /// The number of dense points, which come first.
    dense: usize,
    half: Half,
    parts: Parts<'a>,
}

impl<'a> Place<'a> {
    /// Orders the points into leaves and sets the boxes of their nodes.
    fn split(self, topology: &Topology, boxes: &Mutex<&mut [OrientedBox]>) {
        let mut found = Vec::new();
        if self.items.len() <= TASK {
            self.split_into(topology, &mut found);
        } else {
            let bounds = about(Level::new(), self.items);
            found.extend(topology.node_of(self.half).map(|id| (id, bounds)));
            let [left, right] = self.halve(topology, &bounds);
            both(|| left.split(topology, boxes), || right.split(topology, boxes));
        }
        let mut boxes = boxes.lock().unwrap_or_else(PoisonError::into_inner);
        for (id, bounds) in found {
            boxes[id.index()] = bounds;
        }
    }

    /// Splits the points of loose leaves and those around them.
    fn split_loose(self, topology: &Topology, are_loose: &(impl Fn(&[Item]) -> bool + Sync)) {
        let Place { items, dense, half, parts } = self;
        if topology.leaves_of(half).len() <= LEAVES_SPLIT {
            if items.chunks(topology.leaf_size()).any(are_loose) {
                Place { items, dense, half, parts }.split_into(topology, &mut Vec::new());
            }
            return;
        }
        let [left, right] = Place { items, dense, half, parts }.at_halves(topology);
        let (left, right) =
            (|| left.split_loose(topology, are_loose), || right.split_loose(topology, are_loose));
        if TASK < topology.leaves_of(half).len() * topology.leaf_size() {
            both(left, right);
        } else {
            left();
            right();
        }
    }

    /// Does the same on one thread, and adds the nodes with their boxes to `found`.
    fn split_into(self, topology: &Topology, found: &mut Vec<(NodeId, OrientedBox)>) {
        let bounds = about(Level::new(), self.items);
        found.extend(topology.node_of(self.half).map(|id| (id, bounds)));
        let leaves = topology.leaves_of(self.half);
        if leaves.len() == 1 {
            found.push((topology.leaf(leaves.start), bounds));
            self.items.sort_unstable_by_key(|item| item.index);
            return;
        }
        let [left, right] = self.halve(topology, &bounds);
        left.split_into(topology, found);
        right.split_into(topology, found);
    }

    /// Splits the points in two; `bounds` is the box around them. Dense points come first, so if
    /// there are both kinds only one of them has to be partitioned.
    fn halve(self, topology: &Topology, bounds: &OrientedBox) -> [Self; 2] {
        let Place { items, dense, half, parts } = self;
        let ([left, _], all) = (half.halves(), items.len());
        let count = topology.leaves_of(left).len() * topology.leaf_size();
        let of_one_sort = if count < dense { 0..dense } else { dense..items.len() };
        let (some, within) = (&mut items[of_one_sort.clone()], count - of_one_sort.start);
        if within > 0 && within < some.len() {
            let level = Level::new();
            let own = if dense == 0 || dense == all { *bounds } else { about(level, some) };
            let axis = best_axis(level, some, &own, within, parts);
            partition(some, axis, within);
        }
        Place { items, dense, half, parts }.at_halves(topology)
    }

    /// Divides the points, which are in order, in two.
    fn at_halves(self, topology: &Topology) -> [Self; 2] {
        let Place { items, dense, half, parts } = self;
        let [left, right] = half.halves();
        let (of_left, of_right) = items.split_at_mut(topology.leaves_of(left).len() * topology.leaf_size());
        let dense_left = dense.min(of_left.len());
        [
            Self { items: of_left, dense: dense_left, half: left, parts },
            Self { items: of_right, dense: dense - dense_left, half: right, parts },
        ]
    }
}
