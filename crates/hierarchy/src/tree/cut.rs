//! The axis along which the points of a node are cut in two.
//!
//! Klein & Zachmann 2004, §4.2, minimise the volume of the children's bounding volumes. Here the
//! candidates are the medians along the node's three principal axes, and for triangles also along
//! those of the stored frame. Of the axes that are long enough to matter, the one wins whose children
//! are smallest, as [`Parts`] defines it.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16};
use nearmiss_lanes::order::ascending;
use nearmiss_lanes::wide::{along, greatest, least};

use crate::bounds::boxes::OrientedBox;
use crate::tree::items::{Bounds, Item, Parts, WIDTH, partition, positions, sixteen};

/// An axis shorter than this share of the longest is not a candidate for points, because it cannot
/// give smaller children.
const WORTH_A_TRY: f32 = 0.5;

/// The number of points from which the candidates are judged.
const JUDGED_BY: usize = 512;

/// The axes of the stored frame.
pub(crate) const UPRIGHT: [[f32; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Returns the axis whose median split gives the smallest children, judged on an evenly spaced subset.
/// `left` points are on one side of the cut.
pub(super) fn best_axis(
    level: Level,
    items: &[Item],
    bounds: &OrientedBox,
    left: usize,
    parts: Parts<'_>,
) -> [f32; 3] {
    let stride = items.len().div_ceil(JUDGED_BY);
    let subset = || items.iter().step_by(stride).copied().collect::<Vec<Item>>();
    let cut = |count: usize| (left * count / items.len()).clamp(1, count - 1);
    match parts {
        Parts::Points => {
            let worth = |k: &usize| bounds.half[*k] >= WORTH_A_TRY * bounds.half[0];
            if (0..3).filter(worth).count() < 2 {
                return bounds.axes[0];
            }
            let subset = subset();
            let cut = cut(subset.len());
            #[expect(clippy::cast_precision_loss, reason = "a rough figure")]
            let spacing = (4.0 * bounds.half[0] * bounds.half[1] / subset.len() as f32).sqrt();
            let sides = Sides::new(level, &subset, bounds.axes);
            let sizes = |k| (sides.cut(level, k, cut, spacing), bounds.axes[k]);
            smallest((0..3).filter(worth).map(sizes)).unwrap_or(bounds.axes[0])
        }
        // Large triangles reach far beyond their centres.
        Parts::Triangles(each) => {
            let mut subset = subset();
            let cut = cut(subset.len());
            let sizes = |axis| {
                partition(&mut subset, axis, cut);
                let size = |part: &[Item]| {
                    let own = part.iter().map(|item| &each[item.index as usize]);
                    own.fold(Bounds::NONE, Bounds::with).diagonal_sq()
                };
                let (left, right) = subset.split_at(cut);
                (size(left) + size(right), axis)
            };
            smallest(bounds.axes.into_iter().chain(UPRIGHT).map(sizes)).unwrap_or(bounds.axes[0])
        }
    }
}

/// Returns the first axis with the least size.
fn smallest(sizes: impl Iterator<Item = (f32, [f32; 3])>) -> Option<[f32; 3]> {
    let mut best = (f32::INFINITY, None);
    for (size, axis) in sizes {
        if size < best.0 {
            best = (size, Some(axis));
        }
    }
    best.1
}

/// Points by their coordinates along three axes, sixteen side by side, to measure the sides of a cut
/// without moving the points.
struct Sides<'a> {
    items: &'a [Item],
    rows: Vec<[[f32; WIDTH]; 3]>,
}

impl<'a> Sides<'a> {
    fn new(level: Level, items: &'a [Item], axes: [[f32; 3]; 3]) -> Self {
        let rows = dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || {
                let mut rows = Vec::with_capacity(items.len().div_ceil(WIDTH));
                for start in (0..items.len()).step_by(WIDTH) {
                    let all = positions(simd, &sixteen(items, start));
                    rows.push([
                        along(all, axes[0]).to_array(),
                        along(all, axes[1]).to_array(),
                        along(all, axes[2]).to_array(),
                    ]);
                }
                rows
            },
        ));
        Self { items, rows }
    }

    /// Returns the volume of both sides of the cut along axis `k` with `left` points on one side, each
    /// extent longer by `spacing`. The sides are those of [`partition`].
    fn cut(&self, level: Level, k: usize, left: usize, spacing: f32) -> f32 {
        let key = |i: usize| {
            let at = self.rows[i / WIDTH][k][i % WIDTH];
            u64::from(ascending(at)) << 32 | u64::from(self.items[i].index)
        };
        let count = self.items.len();
        let mut keys: Vec<u64> = (0..count).map(key).collect();
        let first_right = *keys.select_nth_unstable(left).1;
        let lanes = |block: usize| {
            let own = block * WIDTH..count.min((block + 1) * WIDTH);
            own.fold([0, 0], |[left, right], i| {
                let bit = 1 << (i % WIDTH);
                if key(i) < first_right { [left | bit, right] } else { [left, right | bit] }
            })
        };
        let [left, right] = dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || extents(simd, &self.rows, lanes),
        ));
        let volume = |extents: [f32; 3]| extents.iter().map(|extent| extent + spacing).product::<f32>();
        volume(left) + volume(right)
    }
}

/// Returns the extents of points along three axes on either side of a cut. `lanes` returns the lanes of
/// a block on each side, as bits.
#[inline(always)]
fn extents<S: Simd>(simd: S, rows: &[[[f32; WIDTH]; 3]], lanes: impl Fn(usize) -> [u64; 2]) -> [[f32; 3]; 2] {
    let (most, none) = (f32x16::splat(simd, f32::INFINITY), f32x16::splat(simd, f32::NEG_INFINITY));
    let (mut low, mut high) = ([[most; 3]; 2], [[none; 3]; 2]);
    for (block, rows) in rows.iter().enumerate() {
        let sides = lanes(block);
        for side in 0..2 {
            let inside = mask32x16::from_bitmask(simd, sides[side]);
            for k in 0..3 {
                let at = f32x16::load_array_ref(simd, &rows[k]);
                low[side][k] = low[side][k].min(simd.select_f32x16(inside, at, most));
                high[side][k] = high[side][k].max(simd.select_f32x16(inside, at, none));
            }
        }
    }
    let mut extents = [[0.0; 3]; 2];
    for side in 0..2 {
        for k in 0..3 {
            extents[side][k] =
                greatest(high[side][k], f32::NEG_INFINITY) - least(low[side][k], f32::INFINITY);
        }
    }
    extents
}

#[cfg(test)]
mod tests {
    use nearmiss_lanes::vector::dot;
    use nearmiss_testdata::arbitrary::rng;
    use rand::RngExt;

    use super::*;
    use crate::tree::items::about;

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
}
