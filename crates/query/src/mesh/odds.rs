//! Node pairs compared by overlap, the most probable collision first. Keys are the numbers of cells
//! that both surfaces are expected to fill, negated.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x4, f32x16, mask32x16};
use nearmiss_geometry::NodeId;
use nearmiss_hierarchy::{
    Comparison, Frontier, NodeBounds, NodePair, Open, PairVisitor, Part, Relative, Tree,
};
use nearmiss_lanes::wide::{Bits, bits, cube_root, product, repeated, spread};

use crate::pair::cell_table::expected;

const LANES: usize = 16;

/// The callbacks of a descent by probability ([`Odds`]).
pub(crate) trait OddsVisitor: PairVisitor {
    /// Returns the least number of cells that both surfaces are expected to fill in pairs that
    /// [`Self::likely`] is called with.
    fn least_expected(&self) -> f32;

    /// Called with the numbers of cells of the intersection of a pair's boxes that each surface fills
    /// well.
    fn likely(&mut self, filled: [f32; 2]);
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

/// Boxes in lanes: those of a node's children, or of one node in lane 0.
struct Side<V> {
    bounds: NodeBounds<V>,
    nodes: [u32; 4],
    lanes: u32,
}

impl Odds<'_> {
    #[inline(always)]
    fn side<S: Simd>(&self, simd: S, which: usize, id: NodeId, is_whole: bool) -> Side<f32x4<S>> {
        let tree = self.trees[which];
        if is_whole {
            let bounds = tree.bounds_of(Part::Surface, id).map(
                #[inline(always)]
                |x| f32x4::splat(simd, x),
            );
            Side { bounds, nodes: [id.0; 4], lanes: 1 }
        } else {
            let children = tree.topology().children(id);
            let bounds = tree.bounds_of_children(simd, Part::Surface, id);
            Side { bounds, nodes: children.lanes().map(|child| child.0), lanes: (1 << children.len()) - 1 }
        }
    }

    /// The numbers of well-filled cells of four nodes.
    #[inline(always)]
    fn filled<S: Simd>(&self, simd: S, which: usize, nodes: [u32; 4]) -> f32x4<S> {
        let of = |id: u32| self.cells[which].get(id as usize).map_or(UNCOUNTED, |&count| f32::from(count));
        f32x4::load_array(simd, nodes.map(of))
    }

    /// The lanes of pairs whose boxes overlap, and the cube roots of the shares of the volumes of both
    /// that the intersection takes up.
    #[inline(always)]
    fn overlaps<S: Simd>(
        &self,
        simd: S,
        a: &NodeBounds<f32x4<S>>,
        b: &NodeBounds<f32x4<S>>,
    ) -> (u32, [f32x16<S>; 2]) {
        let relative = self.relative;
        let a = a.map(
            #[inline(always)]
            |four| repeated(four),
        );
        let scale = relative.scale();
        let centre = relative.points_of_four(b.centre);
        let half = [b.half[0] * scale, b.half[1] * scale, b.half[2] * scale];
        let axes = [
            relative.directions_of_four(b.axes[0]),
            relative.directions_of_four(b.axes[1]),
            relative.directions_of_four(b.axes[2]),
        ];
        let (centre, half) = (each_spread(centre), each_spread(half));
        let axes = [each_spread(axes[0]), each_spread(axes[1]), each_spread(axes[2])];
        let d = [centre[0] - a.centre[0], centre[1] - a.centre[1], centre[2] - a.centre[2]];
        let tiny = f32::MIN_POSITIVE;
        let one = f32x16::splat(simd, 1.0);
        let mut gap = f32x16::splat(simd, f32::MIN);
        let mut reach_b = [f32x16::splat(simd, 0.0); 3];
        let (mut share_a, mut share_b) = (one, one);
        let (mut volume_a, mut volume_b) = (one, one);
        for i in 0..3 {
            let mut reach = f32x16::splat(simd, 0.0);
            for j in 0..3 {
                let cosine = product(a.axes[i], axes[j]).abs();
                reach += half[j] * cosine;
                reach_b[j] += a.half[i] * cosine;
            }
            let away = product(a.axes[i], d).abs();
            let common = a.half[i] + reach - away;
            gap = gap.max(-common);
            let common = common.min(reach + reach) / (a.half[i] + a.half[i] + tiny);
            share_a *= common.min(one).max(0.0);
            volume_a *= a.half[i];
        }
        for j in 0..3 {
            let away = product(axes[j], d).abs();
            let common = half[j] + reach_b[j] - away;
            gap = gap.max(-common);
            let common = common.min(reach_b[j] + reach_b[j]) / (half[j] + half[j] + tiny);
            share_b *= common.min(one).max(0.0);
            volume_b *= half[j];
        }
        // The volume of the intersection, from above, as seen from either box.
        let common = (share_a * volume_a).min(share_b * volume_b);
        let (share_a, share_b) = ((common / (volume_a + tiny)), (common / (volume_b + tiny)));
        let near = gap.simd_le(relative.slack());
        (bits(near), [cube_root(share_a), cube_root(share_b)])
    }
}

#[inline(always)]
fn each_spread<S: Simd>([x, y, z]: [f32x4<S>; 3]) -> [f32x16<S>; 3] {
    [spread(x), spread(y), spread(z)]
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
        let (near, [of_a, of_b]) = self.overlaps(simd, &a.bounds, &b.bounds);
        let compared = lanes.count_ones();
        let near = mask32x16::from_bitmask(simd, u64::from(near & lanes));
        let filled_a = repeated(self.filled(simd, 0, a.nodes)) * of_a;
        let filled_b = spread(self.filled(simd, 1, b.nodes)) * of_b;
        let keys = near.select(-expected([filled_a, filled_b]), f32x16::splat(simd, f32::INFINITY));
        let likely = bits(keys.simd_le(-visitor.least_expected()));
        if likely != 0 {
            let (filled_a, filled_b) = (filled_a.to_array(), filled_b.to_array());
            for lane in Bits(likely) {
                visitor.likely([filled_a[lane % LANES], filled_b[lane % LANES]]);
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
