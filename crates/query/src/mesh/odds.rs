//! Node pairs compared by overlap, the most probable collision first. Keys are the numbers of cells
//! that both surfaces are expected to fill, negated.

use std::ops::ControlFlow;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x4, f32x16, mask32x16};
use nearmiss_geometry::NodeId;
use nearmiss_hierarchy::{
    Boxes, Comparison, Frontier, NodePair, Open, PairVisitor, Relative, Tree, along_normals,
};
use nearmiss_lanes::wide::{Bits, bits, cube_root, repeated, spread};

use crate::pair::cell_table::expected;

const LANES: usize = 16;

/// The callbacks of a descent by probability ([`Odds`]).
pub(crate) trait OddsVisitor: PairVisitor {
    /// Returns the least number of cells that both surfaces are expected to fill in pairs that
    /// [`Self::likely`] is called with.
    fn least_expected(&self) -> f32;

    /// Called with the numbers of cells of the intersection of a pair's boxes that each surface fills
    /// well. Breaks if no further pair is of interest.
    fn likely(&mut self, filled: [f32; 2]) -> ControlFlow<()>;
}

/// Two trees under a relative pose, compared by the probability of a collision.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Odds<'a> {
    pub(crate) trees: [&'a Tree<'a>; 2],
    pub(crate) relative: &'a Relative,
    /// The well-filled cells of each node; empty if they were not counted.
    pub(crate) cells: [&'a [u8]; 2],
}

/// The count of filled cells of nodes whose cells were not counted: that of a sheet.
const UNCOUNTED: f32 = 16.0;

/// Volumes are increased by this much before a division, in the stored frame. Smaller boxes are
/// expected to fill no cells.
const TINY: f32 = 1e-30;

/// Boxes in lanes: those of a node's children, or of one node in all lanes.
struct Side<S: Simd> {
    boxes: Boxes<f32x4<S>>,
    nodes: [u32; 4],
    /// The lanes that are compared, as bits.
    lanes: u32,
    /// The numbers of well-filled cells.
    filled: f32x4<S>,
}

/// Sixteen pairs of boxes, a's in lanes 4j + i, b's i spread over lanes 4i to 4i + 3.
struct Overlaps<S: Simd> {
    /// The lanes of pairs whose boxes overlap, as bits.
    near: u32,
    /// The shares of the volumes of a's and of b's boxes that the intersections take up.
    shares: [f32x16<S>; 2],
}

impl Odds<'_> {
    #[inline(always)]
    fn side<S: Simd>(&self, simd: S, which: usize, id: NodeId, is_whole: bool) -> Side<S> {
        let tree = self.trees[which];
        let (boxes, nodes, lanes) = if is_whole {
            (Boxes::splat(simd, &tree.bounds(id)), [id.0; 4], 1)
        } else {
            let children = tree.topology().children(id);
            let [p, q, r, s] = children.lanes();
            (tree.boxes_of_children(simd, id), [p.0, q.0, r.0, s.0], (1 << children.len()) - 1)
        };
        let of = |id: u32| self.cells[which].get(id as usize).map_or(UNCOUNTED, |&count| f32::from(count));
        let [p, q, r, s] = nodes;
        Side { boxes, nodes, lanes, filled: f32x4::load_array(simd, [of(p), of(q), of(r), of(s)]) }
    }
}

/// Compares sixteen pairs of boxes.
///
/// The volume of an intersection is estimated from above, by the lesser of the volumes that the
/// extents of each box along the axes of the other cut out of it.
#[inline(always)]
fn overlaps<S: Simd>(simd: S, a: &Boxes<f32x4<S>>, b: &Boxes<f32x4<S>>, relative: &Relative) -> Overlaps<S> {
    let b = relative.boxes_of_four(b);
    let per_volume = [repeated(per_volume(simd, &a.half)), spread(per_volume(simd, &b.half))];
    let (a, b) = (a.repeated(), b.spread());
    let mut least = f32x16::splat(simd, f32::MAX);
    let mut volumes = [f32x16::splat(simd, 1.0); 2];
    let mut axis = 0;
    along_normals(
        &a,
        &b,
        #[inline(always)]
        |away, reach| {
            let (of, half) = if axis < 3 { (0, a.half[axis]) } else { (1, b.half[axis - 3]) };
            axis += 1;
            let (common, lesser) = (reach - away, half.min(reach - half));
            least = least.min(common);
            volumes[of] *= common.min(lesser + lesser);
        },
    );
    // Negative extents occur in lanes that are not near, or next to it.
    let volume = volumes[0].min(volumes[1]).max(0.0);
    let near = least.simd_ge(-relative.slack());
    Overlaps { near: bits(near), shares: [volume * per_volume[0], volume * per_volume[1]] }
}

/// The reciprocals of volumes, given half the edge lengths.
#[inline(always)]
fn per_volume<S: Simd>(simd: S, [x, y, z]: &[f32x4<S>; 3]) -> f32x4<S> {
    f32x4::splat(simd, 1.0) / (*x * *y * *z * 8.0 + TINY)
}

impl<V: OddsVisitor> Comparison<V> for Odds<'_> {
    #[inline(always)]
    fn trees(&self) -> [&Tree<'_>; 2] {
        self.trees
    }

    #[inline(always)]
    fn scale(&self) -> f32 {
        self.relative.scale()
    }

    #[inline(always)]
    fn put_near<S: Simd, F: Frontier>(
        &self,
        simd: S,
        open: Open,
        whole: [bool; 2],
        frontier: &mut F,
        visitor: &mut V,
    ) -> (u32, Option<Open>) {
        let a = self.side(simd, 0, open.pair.a, whole[0]);
        let b = self.side(simd, 1, open.pair.b, whole[1]);
        let mut lanes = 0;
        for j in Bits(b.lanes) {
            lanes |= a.lanes << (4 * j);
        }
        let Overlaps { near, shares } = overlaps(simd, &a.boxes, &b.boxes, self.relative);
        let compared = lanes.count_ones();
        let near = mask32x16::from_bitmask(simd, u64::from(near & lanes));
        let filled = [repeated(a.filled), spread(b.filled)];
        // Of the product of both shares, because one root takes less time than two.
        let mean = expected(filled) * cube_root(shares[0] * shares[1]);
        let keys = near.select(-mean, f32x16::splat(simd, f32::INFINITY));
        let likely = bits(keys.simd_le(-visitor.least_expected()));
        if likely != 0 {
            let filled_a = (filled[0] * cube_root(shares[0])).to_array();
            let filled_b = (filled[1] * cube_root(shares[1])).to_array();
            for lane in Bits(likely) {
                if visitor.likely([filled_a[lane % LANES], filled_b[lane % LANES]]).is_break() {
                    break;
                }
            }
        }
        let mut lanes = bits(near);
        if lanes == 0 {
            frontier.settle(simd);
            return (compared, None);
        }
        let most = bits(keys.simd_eq(keys.reduce_min())) & lanes;
        // Without a finite number, any lane serves.
        let most = if most == 0 { lanes } else { most }.trailing_zeros() as usize;
        let keys = keys.to_array();
        let open = |lane: usize| {
            let pair = NodePair { a: NodeId(a.nodes[lane % 4]), b: NodeId(b.nodes[lane / 4 % 4]) };
            Open { pair, key: keys[lane % LANES] }
        };
        lanes &= !(1 << most);
        for lane in Bits(lanes) {
            frontier.push(open(lane));
        }
        (compared, frontier.push_last(open(most)))
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::dispatch;
    use nearmiss_geometry::Pose;
    use nearmiss_hierarchy::OrientedBox;
    use nearmiss_lanes::vector::cross;
    use nearmiss_testdata::arbitrary::{point_in, rng, rotation};
    use nearmiss_testdata::instructions::levels;
    use rand::RngExt;

    use super::*;
    use crate::pair::cell_volume::filled_cells;

    type Random = rand_xoshiro::Xoshiro256PlusPlus;

    #[expect(clippy::cast_possible_truncation, reason = "single precision")]
    fn single(v: [f64; 3]) -> [f32; 3] {
        v.map(|x| x as f32)
    }

    /// Boxes that overlap, touch, contain each other, are flat, or are points.
    fn boxes(rng: &mut Random, round: usize) -> [OrientedBox; 4] {
        [(); 4].map(|()| {
            let pose = rotation(rng);
            let [u, v] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(|axis| single(pose.rotate(axis)));
            let size = [1.0, 0.1, 1e-4][rng.random_range(0..3)];
            let half = match round % 4 {
                0 => [size; 3],
                1 => [size, 0.3 * size, 1e-6],
                2 => [size, 0.7 * size, 0.4 * size],
                _ => [0.0; 3],
            };
            OrientedBox { centre: single(point_in(rng, 0.8)), half, axes: [u, v, cross(u, v)], reach: 0.0 }
        })
    }

    fn lanes<S: Simd>(simd: S, boxes: &[OrientedBox; 4]) -> Boxes<f32x4<S>> {
        let each = |of: &dyn Fn(&OrientedBox) -> f32| f32x4::load_array(simd, boxes.each_ref().map(of));
        Boxes {
            centre: [0, 1, 2].map(|k| each(&|bounds| bounds.centre[k])),
            half: [0, 1, 2].map(|k| each(&|bounds| bounds.half[k])),
            axes: [0, 1, 2].map(|i| [0, 1, 2].map(|k| each(&|bounds| bounds.axes[i][k]))),
        }
    }

    #[test]
    fn lanes_estimate_the_same_as_one_pair_by_any_instructions() {
        let rng = &mut rng(2243);
        let (mut near, mut apart) = (0, 0);
        for round in 0..400 {
            let scale = [1.0, 0.25, 3.0][round % 3];
            let pose = rotation(rng).with_scale(scale).with_translation(point_in(rng, 0.5));
            let pose: &Pose = &pose;
            let relative = Relative::new(pose, 4.0);
            let (a, b) = (boxes(rng, round), boxes(rng, round / 4));
            for level in levels() {
                let (bits, shares) = dispatch!(level, simd => {
                    let found = overlaps(simd, &lanes(simd, &a), &lanes(simd, &b), &relative);
                    (found.near, found.shares.map(|shares| cube_root(shares).to_array()))
                });
                for lane in 0..LANES {
                    let (own, other) = (&a[lane % 4], &b[lane / 4]);
                    let gap = relative.gap(own, other);
                    assert_eq!(bits >> lane & 1 != 0, gap <= relative.slack(), "{gap}");
                    if gap > -1e-6 {
                        apart += 1;
                        continue;
                    }
                    near += 1;
                    let expected = filled_cells([own, &relative.moved(other)], [1.0, 1.0]);
                    for side in 0..2 {
                        let (found, expected) = (shares[side][lane], expected[side]);
                        // A share is the difference of lengths that are off by roundings.
                        assert!((found - expected).abs() < 2e-2, "{own:?}, {other:?}: {found}, {expected}");
                    }
                }
            }
        }
        assert!(near > 1500 && apart > 1500, "{near} near, {apart} apart");
    }
}
