//! The tree: top-down, each node split so that its children's boxes are small.
//!
//! S0 §4.2 splits to minimise the volume of the children's bounding volumes. Here the candidates are the
//! medians along the node's three principal axes, and of those long enough to matter the one wins whose
//! children have the least summed volume of boxes along the same axes. A patch of surface is flat, so every
//! extent is taken larger by the mean spacing of the points; otherwise all volumes would vanish alike.

use nearmiss_surface::symmetric_eigen;

use crate::boxes::{OrientedBox, dot, to_axes};
use crate::topology::{Node, left_count, node_count};

/// A point on its way to its place.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Item {
    pub(crate) position: [f32; 3],
    /// Index in the cloud.
    pub(crate) index: u32,
}

/// Below this many points a task is not worth handing to another thread.
#[cfg(feature = "rayon")]
const TASK: usize = 4096;

/// An axis shorter than this share of the longest cannot give smaller children.
const WORTH_A_TRY: f32 = 0.5;

/// Splits need no more than this many points to tell which axis is better.
const JUDGED_BY: usize = 512;

/// Orders `items` into leaves and returns the nodes with their boxes about the points. O(n log n).
pub(crate) fn split(items: &mut [Item], leaf_size: usize) -> (Vec<Node>, Vec<OrientedBox>) {
    let count = node_count(items.len(), leaf_size);
    let mut nodes = vec![Node::default(); count];
    let mut boxes = vec![OrientedBox::default(); count];
    let place = Place { items, nodes: &mut nodes, boxes: &mut boxes, first: 0, id: 0 };
    place.split(leaf_size);
    (nodes, boxes)
}

/// A subtree: its points and the stretch of the arrays in which its nodes will stand.
struct Place<'a> {
    items: &'a mut [Item],
    nodes: &'a mut [Node],
    boxes: &'a mut [OrientedBox],
    first: usize,
    id: usize,
}

impl Place<'_> {
    fn split(self, leaf_size: usize) {
        let Place { items, nodes, boxes, first, id } = self;
        let count = items.len();
        let axes = principal_axes(items);
        let (low, high) = extents(items, &axes);
        boxes[0] = OrientedBox::spanned(axes, low, high, 0.0);
        if count <= leaf_size {
            items.sort_unstable_by_key(|item| item.index);
            nodes[0] = Node { first: id32(first), count: id32(count), right: 0 };
            return;
        }
        let left = left_count(count, leaf_size);
        let axis = best_axis(items, &boxes[0], left);
        partition(items, axis, left);
        let left_nodes = node_count(left, leaf_size);
        nodes[0] = Node { first: id32(first), count: id32(count), right: id32(id + 1 + left_nodes) };
        let (items_l, items_r) = items.split_at_mut(left);
        let (nodes_l, nodes_r) = nodes[1..].split_at_mut(left_nodes);
        let (boxes_l, boxes_r) = boxes[1..].split_at_mut(left_nodes);
        let l = Place { items: items_l, nodes: nodes_l, boxes: boxes_l, first, id: id + 1 };
        let r = Place {
            items: items_r,
            nodes: nodes_r,
            boxes: boxes_r,
            first: first + left,
            id: id + 1 + left_nodes,
        };
        #[cfg(feature = "rayon")]
        if count > TASK {
            rayon::join(|| l.split(leaf_size), || r.split(leaf_size));
            return;
        }
        l.split(leaf_size);
        r.split(leaf_size);
    }
}

/// Point and node numbers fit 32 bits: a cloud has at most 2³² − 1 points and half as many nodes.
#[expect(clippy::cast_possible_truncation, reason = "bounded by the cloud's size")]
pub(crate) fn id32(i: usize) -> u32 {
    i as u32
}

/// Principal axes of the points, the longest spread first.
fn principal_axes(items: &[Item]) -> [[f32; 3]; 3] {
    /// Lanes of the sums; a fixed order, whatever the machine.
    const LANES: usize = 4;
    let origin = items[0].position;
    let mut sums = [[0.0_f64; LANES]; 9];
    for chunk in items.chunks(LANES) {
        for (lane, item) in chunk.iter().enumerate() {
            let [x, y, z] = [0, 1, 2].map(|k| f64::from(item.position[k] - origin[k]));
            for (sum, v) in sums.iter_mut().zip([x, y, z, x * x, x * y, x * z, y * y, y * z, z * z]) {
                sum[lane] += v;
            }
        }
    }
    #[expect(clippy::cast_precision_loss, reason = "counts below 2^32 are exact")]
    let n = items.len() as f64;
    let [x, y, z, xx, xy, xz, yy, yz, zz] = sums.map(|lanes| lanes.iter().sum::<f64>() / n);
    let eigen = symmetric_eigen([xx - x * x, xy - x * y, xz - x * z, yy - y * y, yz - y * z, zz - z * z]);
    // Longest first; reversing two of three keeps the frame right-handed up to a sign, mended by the third.
    let [short, middle, long] = eigen.vectors;
    to_axes([long, middle, short.map(|c| -c)])
}

/// Least and greatest coordinate of the points along each axis.
fn extents(items: &[Item], axes: &[[f32; 3]; 3]) -> ([f32; 3], [f32; 3]) {
    let mut low = [f32::INFINITY; 3];
    let mut high = [f32::NEG_INFINITY; 3];
    for item in items {
        for k in 0..3 {
            let c = dot(axes[k], item.position);
            low[k] = low[k].min(c);
            high[k] = high[k].max(c);
        }
    }
    (low, high)
}

/// Moves the `left` points least along `axis` to the front; equal ones by their index.
fn partition(items: &mut [Item], axis: [f32; 3], left: usize) {
    let key = |item: &Item| dot(axis, item.position);
    items.select_nth_unstable_by(left, |a, b| key(a).total_cmp(&key(b)).then(a.index.cmp(&b.index)));
}

/// The principal axis whose median split leaves the least volume, judged on an even subset.
fn best_axis(items: &[Item], bounds: &OrientedBox, left: usize) -> [f32; 3] {
    let axes = &bounds.axes;
    let worth = |k: usize| bounds.half[k] >= WORTH_A_TRY * bounds.half[0];
    if !worth(1) && !worth(2) {
        return axes[0];
    }
    let stride = items.len().div_ceil(JUDGED_BY);
    let mut subset: Vec<Item> = items.iter().step_by(stride).copied().collect();
    let cut = (left * subset.len() / items.len()).clamp(1, subset.len() - 1);
    #[expect(clippy::cast_precision_loss, reason = "a rough figure")]
    let spacing = (4.0 * bounds.half[0] * bounds.half[1] / subset.len() as f32).sqrt();
    let mut volume = |k: usize| {
        partition(&mut subset, axes[k], cut);
        let (l, r) = subset.split_at(cut);
        [l, r]
            .into_iter()
            .map(|half| {
                let (low, high) = extents(half, axes);
                (0..3).map(|j| high[j] - low[j] + spacing).product::<f32>()
            })
            .sum::<f32>()
    };
    let mut best = (volume(0), 0);
    for k in 1..3 {
        if worth(k) {
            let v = volume(k);
            if v < best.0 {
                best = (v, k);
            }
        }
    }
    axes[best.1]
}
