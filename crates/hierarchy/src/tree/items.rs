//! Points during the construction of a tree: their boxes, and their partition along an axis.

use bytemuck::{Pod, Zeroable};
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x4, f32x16, f64x2, f64x4};
use nearmiss_lanes::order::ascending;
use nearmiss_lanes::vector::dot;
use nearmiss_lanes::wide::{along, greatest, least};
use nearmiss_surface::symmetric_eigen;

use crate::bounds::boxes::{OrientedBox, to_axes};

/// A point during construction.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Item {
    pub(crate) position: [f32; 3],
    /// A number that no other point has. It breaks ties between equally good orders.
    pub(crate) index: u32,
}

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
    pub(super) const NONE: Self = Self([[f32::INFINITY; LANES]; 2]);

    /// Returns the bounds of some points.
    pub(crate) fn of(points: &[[f32; 3]]) -> Self {
        let each = points.iter().map(|&[x, y, z]| Self([[x, y, z, 0.0], [-x, -y, -z, 0.0]]));
        each.fold(Self::NONE, |all, own| all.with(&own))
    }

    #[inline(always)]
    pub(super) fn with(mut self, other: &Self) -> Self {
        for (all, own) in self.0.iter_mut().zip(&other.0) {
            for k in 0..LANES {
                all[k] = if own[k] < all[k] { own[k] } else { all[k] };
            }
        }
        self
    }

    /// Returns the squared diagonal.
    pub(super) fn diagonal_sq(&self) -> f32 {
        let [low, negated] = &self.0;
        (0..3).map(|k| (low[k] + negated[k]).powi(2)).sum()
    }
}

/// Returns the box around some points along their principal axes.
pub(super) fn about(level: Level, items: &[Item]) -> OrientedBox {
    let axes = principal_axes(level, items);
    let (low, high) = extents(level, items, &axes);
    OrientedBox::spanned(axes, low, high, 0.0)
}

/// The number of lanes in which coordinates and their products are summed: fixed, so that the order
/// is the same on every machine.
pub(super) const LANES: usize = 4;

/// The number of items processed together, for the lanes of the widest registers.
pub(super) const WIDTH: usize = 16;

/// Returns up to sixteen items, padded with the first of all.
#[inline(always)]
pub(super) fn sixteen(items: &[Item], start: usize) -> [Item; WIDTH] {
    let mut some = [items[0]; WIDTH];
    let rest = &items[start..];
    match rest.first_chunk() {
        Some(full) => some = *full,
        None => some[..rest.len()].copy_from_slice(rest),
    }
    some
}

/// Returns the coordinates of sixteen items.
#[inline(always)]
pub(super) fn positions<S: Simd>(simd: S, items: &[Item; WIDTH]) -> [f32x16<S>; 3] {
    let (a, b) = (coordinates(simd, items, 0), coordinates(simd, items, 1));
    let (c, d) = (coordinates(simd, items, 2), coordinates(simd, items, 3));
    let mut all = [f32x16::splat(simd, 0.0); 3];
    for k in 0..3 {
        all[k] = a[k].combine(b[k]).combine(c[k].combine(d[k]));
    }
    all
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
        let all = positions(simd, &sixteen(items, start));
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
pub(super) fn partition(items: &mut [Item], axis: [f32; 3], left: usize) {
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

#[cfg(test)]
mod tests {
    use nearmiss_lanes::id32;
    use nearmiss_testdata::arbitrary::rng;
    use rand::RngExt;

    use super::*;

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
