//! The principal axes of all nodes, from the moments of their leaves: in O(n), where summing over
//! the points of every node takes O(n log n).

use fearless_simd::{Level, Simd, dispatch};
use nearmiss_geometry::NodeId;
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::{change_each, change_runs};
use nearmiss_lanes::vector::sub;
use nearmiss_surface::{EigenBlock, MatrixBlock, symmetric_eigen_batch};

use crate::bounds::boxes::{OrientedBox, to_axes};
use crate::tree::topology::Topology;

/// The moments of some points about their mean.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Spread {
    pub(crate) count: f64,
    pub(crate) mean: [f64; 3],
    /// The sums of the products of coordinates relative to the mean, as xx xy xz yy yz zz.
    pub(crate) second: [f64; 6],
}

#[inline(always)]
fn products([x, y, z]: [f64; 3]) -> [f64; 6] {
    [x * x, x * y, x * z, y * y, y * z, z * z]
}

impl Spread {
    /// The moments of `count` points with this mean. `second` holds the sums of the products of their
    /// coordinates relative to it.
    #[inline(always)]
    pub(crate) fn about(count: f32, mean: [f32; 3], second: [f32; 6]) -> Self {
        let [xx, xy, xz, yy, yz, zz] = second;
        let second = [xx.into(), xy.into(), xz.into(), yy.into(), yz.into(), zz.into()];
        Self { count: count.into(), mean: [mean[0].into(), mean[1].into(), mean[2].into()], second }
    }

    #[inline(always)]
    pub(crate) fn of(points: &[[f32; 3]]) -> Self {
        let (origin, mut first, mut second) = (points[0], [0.0; 3], [0.0; 6]);
        for p in points {
            let d = sub(*p, origin).map(f64::from);
            first = [first[0] + d[0], first[1] + d[1], first[2] + d[2]];
            let all = products(d);
            for k in 0..6 {
                second[k] += all[k];
            }
        }
        #[expect(clippy::cast_precision_loss, reason = "at most 64")]
        let count = points.len() as f64;
        let shift = first.map(|x| x / count);
        let moved = products(shift);
        for k in 0..6 {
            second[k] -= count * moved[k];
        }
        Self { count, mean: [0, 1, 2].map(|k| f64::from(origin[k]) + shift[k]), second }
    }

    /// The moments of both sets of points together.
    fn with(self, other: Self) -> Self {
        let count = self.count + other.count;
        let share = other.count / count;
        let apart = [0, 1, 2].map(|k| other.mean[k] - self.mean[k]);
        let between = products(apart);
        let mut second = [0.0; 6];
        for k in 0..6 {
            second[k] = self.second[k] + other.second[k] + self.count * share * between[k];
        }
        Self { count, mean: [0, 1, 2].map(|k| self.mean[k] + share * apart[k]), second }
    }
}

/// The number of nodes that a thread takes at once.
const AT_ONCE: usize = 64;

/// Sets the moments of all leaves.
pub(crate) fn spread_leaves(positions: &[[f32; 3]], topology: &Topology, leaves: &mut [Spread]) {
    let level = Level::new();
    change_each(leaves, AT_ONCE, |leaf, spread| {
        *spread = dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || Spread::of(&positions[topology.points_of_leaf(leaf)]),
        ));
    });
}

/// Sets the axes of all `boxes` to the principal axes of the points of their nodes, the greatest
/// variance first. Of `spreads`, the moments of all nodes, those of leaves are known.
pub(crate) fn principal_axes(topology: &Topology, boxes: &mut [OrientedBox], spreads: &mut [Spread]) {
    const WIDTH: usize = MatrixBlock::WIDTH;
    let (inner, level) = (topology.inner(), Level::new());
    // Children come after their parent.
    for id in (0..inner).rev() {
        let children = topology.children(NodeId(id32(id))).iter().map(|child| spreads[child.index()]);
        spreads[id] = children.reduce(Spread::with).unwrap_or_default();
    }
    let spreads: &[Spread] = spreads;
    change_runs(boxes, AT_ONCE, |number, boxes| {
        let spreads = &spreads[number * AT_ONCE..];
        for (boxes, spreads) in boxes.chunks_mut(WIDTH).zip(spreads.chunks(WIDTH)) {
            let (mut block, mut solved) = (MatrixBlock::default(), EigenBlock::default());
            for (lane, spread) in spreads.iter().enumerate() {
                block.put(lane, spread.second);
            }
            symmetric_eigen_batch(level, &[block], std::slice::from_mut(&mut solved));
            for (lane, bounds) in boxes.iter_mut().enumerate() {
                let [_, middle, long] = solved.get(lane).vectors;
                bounds.axes = to_axes([long, middle]);
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use nearmiss_testdata::arbitrary::{CloudKind, cloud};

    use super::*;
    use crate::tree::items::{Item, about};

    #[test]
    fn axes_from_moments_span_boxes_as_small_as_axes_from_points() {
        for kind in [CloudKind::Sphere, CloudKind::Random, CloudKind::Lattice, CloudKind::Clustered] {
            #[expect(clippy::cast_possible_truncation, reason = "stored in single precision")]
            let points: Vec<[f32; 3]> =
                cloud(kind, 900, 3).iter().map(|p| p.map(|x| x as f32 + 100.0)).collect();
            let items: Vec<Item> =
                (0..).zip(&points).map(|(index, p)| Item { position: *p, index }).collect();
            for leaf_size in [16, 10] {
                let topology = Topology::new(id32(points.len()), leaf_size);
                let of_points = |id| about(Level::new(), &items[topology.points(id)]);
                let boxes: Vec<OrientedBox> = topology.ids().map(of_points).collect();
                let mut found = boxes.clone();
                let mut spreads = vec![Spread::default(); topology.len()];
                spread_leaves(&points, &topology, &mut spreads[topology.inner()..]);
                principal_axes(&topology, &mut found, &mut spreads);
                for (id, (expected, found)) in boxes.iter().zip(&found).enumerate() {
                    // Axes of equal variance are arbitrary; the variances along them are not.
                    let variance = |axis: [f32; 3]| {
                        let own = &points[topology.points(NodeId(id32(id)))];
                        let along = |p: &[f32; 3]| (0..3).map(|k| f64::from(p[k]) * f64::from(axis[k])).sum();
                        let values: Vec<f64> = own.iter().map(along).collect();
                        let mean = values.iter().sum::<f64>() / values.len() as f64;
                        values.iter().map(|x| (x - mean).powi(2)).sum::<f64>()
                    };
                    let all: f64 = expected.axes.map(variance).iter().sum();
                    for k in 0..3 {
                        let (a, b) = (variance(expected.axes[k]), variance(found.axes[k]));
                        assert!((a - b).abs() <= 1e-5 * all, "{kind:?}, node {id}: {a}, {b}");
                    }
                }
            }
        }
    }
}
