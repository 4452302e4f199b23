//! Construction of the tree: top-down, with each node split so that its children's boxes are small.
//!
//! Klein & Zachmann 2004, §4.2, minimise the volume of the children's bounding volumes. Here the
//! candidates are the medians along the node's three principal axes, and for triangles also along
//! those of the stored frame. Of the axes that are long enough to matter, the one wins whose children
//! are smallest, as [`Parts`] defines it.

use std::sync::{Mutex, PoisonError};

use bytemuck::{Pod, Zeroable};
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x4, f32x16, f64x2, f64x4};
use nearmiss_geometry::NodeId;
use nearmiss_lanes::id32;
use nearmiss_lanes::order::ascending;
use nearmiss_lanes::parallel::{both, change_each};
use nearmiss_lanes::vector::dot;
use nearmiss_lanes::wide::{along, greatest, least};
use nearmiss_surface::symmetric_eigen;

use crate::bounds::boxes::{OrientedBox, to_axes};
use crate::tree::topology::{Half, Topology};

/// A point during construction.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Item {
    pub(crate) position: [f32; 3],
    /// A number that no other point has. It breaks ties between equally good orders.
    pub(crate) index: u32,
}

/// The minimum number of points for which another thread is used.
const TASK: usize = 4096;

/// An axis shorter than this share of the longest is not a candidate for points, because it cannot
/// give smaller children.
const WORTH_A_TRY: f32 = 0.5;

/// The number of points from which the candidates are judged.
const JUDGED_BY: usize = 512;

/// The things that the items stand for. They decide which size of children a split keeps small.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Parts<'a> {
    /// Points of a surface. The size is the volume of the box along the principal axes. A patch of
    /// surface is flat, so the mean spacing of the points is added to every extent; otherwise all
    /// volumes would vanish alike.
    Points,
    /// The centres of triangles, whose bounds are given by index. The size is the squared diagonal of
    /// the bounds of all. By volume, parts of long triangles are long as well, and near many others.
    Triangles(&'a [Bounds]),
}

/// Least coordinates and negated greatest ones along the axes of the stored frame, each with a
/// fourth number that means nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bounds([[f32; LANES]; 2]);

impl Bounds {
    const NONE: Self = Self([[f32::INFINITY; LANES]; 2]);

    /// Returns the bounds of some points.
    pub(crate) fn of(points: &[[f32; 3]]) -> Self {
        let each = points.iter().map(|&[x, y, z]| Self([[x, y, z, 0.0], [-x, -y, -z, 0.0]]));
        each.fold(Self::NONE, |all, own| all.with(&own))
    }

    #[inline(always)]
    fn with(mut self, other: &Self) -> Self {
        for (all, own) in self.0.iter_mut().zip(&other.0) {
            for k in 0..LANES {
                all[k] = if own[k] < all[k] { own[k] } else { all[k] };
            }
        }
        self
    }

    /// Returns the squared diagonal.
    fn diagonal_sq(&self) -> f32 {
        let [low, negated] = &self.0;
        (0..3).map(|k| (low[k] + negated[k]).powi(2)).sum()
    }
}

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

/// Sets `boxes` to the boxes around the points of all nodes, whose order stays. O(n log n).
pub(crate) fn bound_in_order(items: &[Item], topology: &Topology, boxes: &mut [OrientedBox]) {
    const AT_ONCE: usize = 16;
    let level = Level::new();
    change_each(boxes, AT_ONCE, |id, bounds| {
        *bounds = about(level, &items[topology.points(NodeId(id32(id)))]);
    });
}

/// Returns the box around some points along their principal axes.
fn about(level: Level, items: &[Item]) -> OrientedBox {
    let axes = principal_axes(level, items);
    let (low, high) = extents(level, items, &axes);
    OrientedBox::spanned(axes, low, high, 0.0)
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

/// The number of lanes in which coordinates and their products are summed: fixed, so that the order
/// is the same on every machine.
const LANES: usize = 4;

/// The number of items processed together, for the lanes of the widest registers.
const WIDTH: usize = 16;

/// Returns up to sixteen items, padded with the first of all.
#[inline(always)]
fn sixteen(items: &[Item], start: usize) -> [Item; WIDTH] {
    let mut some = [items[0]; WIDTH];
    let rest = &items[start..];
    match rest.first_chunk() {
        Some(full) => some = *full,
        None => some[..rest.len()].copy_from_slice(rest),
    }
    some
}

/// Returns the coordinates of four of the items.
#[inline(always)]
fn coordinates<S: Simd>(simd: S, items: &[Item; WIDTH], four: usize) -> [f32x4<S>; 3] {
    let floats: &[f32] = bytemuck::cast_slice(&items[four * LANES..][..LANES]);
    let [x, y, z, _] = f32x4::load_four_interleaved(simd, floats);
    [x, y, z]
}

/// Returns the principal axes of the points, the greatest variance first.
fn principal_axes(level: Level, items: &[Item]) -> [[f32; 3]; 3] {
    let sums = dispatch!(level, simd => simd.vectorize(
        #[inline(always)]
        || sums(simd, items),
    ));
    #[expect(clippy::cast_precision_loss, reason = "counts below 2^32 are exact")]
    let n = items.len() as f64;
    let [x, y, z, xx, xy, xz, yy, yz, zz] = sums.map(|lanes| lanes.iter().sum::<f64>() / n);
    let eigen = symmetric_eigen([xx - x * x, xy - x * y, xz - x * z, yy - y * y, yz - y * z, zz - z * z]);
    let [_, middle, long] = eigen.vectors;
    to_axes([long, middle])
}

/// Returns the sums of x y z xx xy xz yy yz zz of the points relative to the first, in lanes.
#[inline(always)]
fn sums<S: Simd>(simd: S, items: &[Item]) -> [[f64; LANES]; 9] {
    let origin = items[0].position;
    let mut sums = [f64x4::splat(simd, 0.0); 9];
    let mut start = 0;
    while start < items.len() {
        let some = sixteen(items, start);
        for four in 0..WIDTH / LANES {
            let [x, y, z] = coordinates(simd, &some, four);
            let double = |(low, high): (f64x2<S>, f64x2<S>)| low.combine(high);
            let x = double(simd.widen_f32x4(x - origin[0]));
            let y = double(simd.widen_f32x4(y - origin[1]));
            let z = double(simd.widen_f32x4(z - origin[2]));
            let products = [x, y, z, x * x, x * y, x * z, y * y, y * z, z * z];
            for k in 0..9 {
                sums[k] += products[k];
            }
        }
        start += WIDTH;
    }
    let mut lanes = [[0.0; LANES]; 9];
    for k in 0..9 {
        lanes[k] = sums[k].to_array();
    }
    lanes
}

/// Returns the least and greatest coordinate of the points along each axis.
fn extents(level: Level, items: &[Item], axes: &[[f32; 3]; 3]) -> ([f32; 3], [f32; 3]) {
    dispatch!(level, simd => simd.vectorize(
        #[inline(always)]
        || extents_by(simd, items, axes),
    ))
}

#[inline(always)]
fn extents_by<S: Simd>(simd: S, items: &[Item], axes: &[[f32; 3]; 3]) -> ([f32; 3], [f32; 3]) {
    let mut low = [f32x16::splat(simd, f32::INFINITY); 3];
    let mut high = [f32x16::splat(simd, f32::NEG_INFINITY); 3];
    let mut start = 0;
    while start < items.len() {
        let some = sixteen(items, start);
        let (a, b) = (coordinates(simd, &some, 0), coordinates(simd, &some, 1));
        let (c, d) = (coordinates(simd, &some, 2), coordinates(simd, &some, 3));
        let mut all = [low[0]; 3];
        for k in 0..3 {
            all[k] = a[k].combine(b[k]).combine(c[k].combine(d[k]));
        }
        for k in 0..3 {
            let at = along(all, axes[k]);
            (low[k], high[k]) = (at.min(low[k]), at.max(high[k]));
        }
        start += WIDTH;
    }
    let (mut least_of, mut greatest_of) = ([0.0; 3], [0.0; 3]);
    for k in 0..3 {
        least_of[k] = least(low[k], f32::INFINITY);
        greatest_of[k] = greatest(high[k], f32::NEG_INFINITY);
    }
    (least_of, greatest_of)
}

/// The maximum number of points whose coordinates [`partition`] stores beside them.
const KEYED: usize = 1 << 16;

/// Moves the `left` points with the least coordinates along `axis` to the front; ties go to the
/// lower index.
fn partition(items: &mut [Item], axis: [f32; 3], left: usize) {
    let key = |item: &Item| u64::from(ascending(dot(axis, item.position))) << 32 | u64::from(item.index);
    if items.len() > KEYED {
        items.select_nth_unstable_by_key(left, key);
        return;
    }
    let mut keyed: Vec<(u64, Item)> = items.iter().map(|item| (key(item), *item)).collect();
    keyed.select_nth_unstable_by_key(left, |(key, _)| *key);
    for (item, (_, ordered)) in items.iter_mut().zip(keyed) {
        *item = ordered;
    }
}

/// Returns the axis whose median split gives the smallest children, judged on an evenly spaced subset.
fn best_axis(level: Level, items: &[Item], bounds: &OrientedBox, left: usize, parts: Parts<'_>) -> [f32; 3] {
    let axes = &bounds.axes;
    let tried: Vec<[f32; 3]> = match parts {
        Parts::Points => {
            let worth = |k: &usize| bounds.half[*k] >= WORTH_A_TRY * bounds.half[0];
            (0..3).filter(worth).map(|k| axes[k]).collect()
        }
        // Large triangles reach far beyond their centres.
        Parts::Triangles(_) => [*axes, UPRIGHT].concat(),
    };
    if tried.len() < 2 {
        return axes[0];
    }
    let stride = items.len().div_ceil(JUDGED_BY);
    let mut subset: Vec<Item> = items.iter().step_by(stride).copied().collect();
    let cut = (left * subset.len() / items.len()).clamp(1, subset.len() - 1);
    #[expect(clippy::cast_precision_loss, reason = "a rough figure")]
    let spacing = (4.0 * bounds.half[0] * bounds.half[1] / subset.len() as f32).sqrt();
    let size = |part: &[Item]| match parts {
        Parts::Points => {
            let (low, high) = extents(level, part, axes);
            (0..3).map(|k| high[k] - low[k] + spacing).product()
        }
        Parts::Triangles(each) => {
            let own = part.iter().map(|item| &each[item.index as usize]);
            own.fold(Bounds::NONE, Bounds::with).diagonal_sq()
        }
    };
    let mut best = (f32::INFINITY, axes[0]);
    for axis in tried {
        partition(&mut subset, axis, cut);
        let (l, r) = subset.split_at(cut);
        let sizes: f32 = size(l) + size(r);
        if sizes < best.0 {
            best = (sizes, axis);
        }
    }
    best.1
}

/// The axes of the stored frame.
pub(crate) const UPRIGHT: [[f32; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

#[cfg(test)]
mod tests {
    use nearmiss_testdata::arbitrary::rng;
    use rand::RngExt;

    use super::*;

    /// Points of a bowl, so that the parts of a median split are curved in different ways, and
    /// triangles at them.
    fn bowl(rng: &mut impl RngExt) -> (Vec<Item>, Vec<[[f32; 3]; 3]>) {
        let [wide, deep] = [rng.random_range(0.6..1.0_f32), rng.random_range(0.2..2.0_f32)];
        let place = |[x, y]: [f32; 2]| [x, wide * y, deep * (x * x - 0.5 * y * y * y)];
        let triangles: Vec<[[f32; 3]; 3]> = (0..200)
            .map(|_| {
                let middle = [(); 2].map(|()| rng.random_range(-1.0..1.0_f32));
                let long = rng.random_range(0.01..0.4_f32);
                [(); 3].map(|()| place(middle.map(|x| x + rng.random_range(-long..long))))
            })
            .collect();
        let centre = |t: &[[f32; 3]; 3]| [0, 1, 2].map(|k| (t[0][k] + t[1][k] + t[2][k]) / 3.0);
        let item = |(index, t): (u32, _)| Item { position: centre(t), index };
        ((0..).zip(&triangles).map(item).collect(), triangles)
    }

    #[test]
    fn the_axis_is_that_of_the_smallest_children() {
        let mut rng = rng(6);
        let (mut chosen, mut upright) = ([0; 3], 0);
        let spread = |all: &mut dyn Iterator<Item = f32>| {
            let (low, high) = all.fold((f32::MAX, f32::MIN), |(low, high), x| (low.min(x), high.max(x)));
            high - low
        };
        for _ in 0..300 {
            let (items, triangles) = bowl(&mut rng);
            let bounds = about(Level::new(), &items);
            let cut = 112;
            let spacing = (4.0 * bounds.half[0] * bounds.half[1] / 200.0).sqrt();
            let least = |axes: &[[f32; 3]], size: &dyn Fn(&[Item]) -> f32| {
                let sum = |axis: &[f32; 3]| {
                    let mut sorted = items.clone();
                    sorted.sort_by(|a, b| dot(*axis, a.position).total_cmp(&dot(*axis, b.position)));
                    let (left, right) = sorted.split_at(cut);
                    size(left) + size(right)
                };
                *axes.iter().min_by(|a, b| sum(a).total_cmp(&sum(b))).unwrap()
            };
            let long = bounds.half.iter().filter(|half| **half >= 0.5 * bounds.half[0]).count();
            let volume = least(&bounds.axes[..long], &|part| {
                let along =
                    |axis: [f32; 3]| spread(&mut part.iter().map(|item| dot(axis, item.position))) + spacing;
                bounds.axes.map(along).iter().product()
            });
            let diagonal = least(&[bounds.axes, UPRIGHT].concat(), &|part| {
                let corners: Vec<[f32; 3]> =
                    part.iter().flat_map(|item| triangles[item.index as usize]).collect();
                (0..3).map(|k| spread(&mut corners.iter().map(|p| p[k])).powi(2)).sum()
            });
            let each: Vec<Bounds> = triangles.iter().map(|t| Bounds::of(t)).collect();
            let best = |parts| best_axis(Level::new(), &items, &bounds, cut, parts);
            assert_eq!(best(Parts::Points), volume, "by volume");
            assert_eq!(best(Parts::Triangles(&each)), diagonal, "by diagonal");
            chosen[bounds.axes.iter().position(|axis| *axis == volume).unwrap()] += 1;
            upright += usize::from(!bounds.axes.contains(&diagonal));
        }
        assert!(chosen.iter().all(|&count| count > 0), "{chosen:?}");
        assert!((50..250).contains(&upright), "{upright}");
    }

    #[test]
    fn a_partition_is_that_of_sorted_points_with_and_without_stored_keys() {
        let mut rng = rng(5);
        for count in [2, 17, 600, KEYED, KEYED + 1] {
            // Few places, also -0 beside 0, so that many points are level.
            let place = |x: u32| [-1.0, -0.0, 0.0, 1.0][x as usize % 4];
            let items: Vec<Item> = (0..id32(count))
                .map(|index| Item { position: [(); 3].map(|()| place(rng.random())), index: index ^ 1 })
                .collect();
            for axis in [[1.0, 0.0, 0.0], [0.6, -0.48, 0.64]] {
                let left = rng.random_range(1..count);
                let mut expected = items.clone();
                let key = |item: &Item| dot(axis, item.position);
                expected.sort_by(|a, b| key(a).total_cmp(&key(b)).then(a.index.cmp(&b.index)));
                let mut found = items.clone();
                partition(&mut found, axis, left);
                let indices = |items: &[Item]| {
                    let mut indices: Vec<u32> = items.iter().map(|item| item.index).collect();
                    indices.sort_unstable();
                    indices
                };
                assert_eq!(indices(&found[..left]), indices(&expected[..left]), "{count} points");
                assert_eq!(indices(&found[left..]), indices(&expected[left..]), "{count} points");
            }
        }
    }
}
