//! Node pairs compared by their distance, for proofs and distance queries.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x4, f32x16};
use nearmiss_hierarchy::{
    Comparison, Frontier, LaneNodes, MostUrgent, NodeBounds, NodePair, Open, PairVisitor, Part, Tree,
};
use nearmiss_lanes::wide::{common, repeated, spread};

use crate::pair::relative_pose::{Gaps, LANES, Limits, RelativePose};

/// The number of children of each node in a comparison of children with children.
const FAN: usize = 4;

/// The up to sixteen pairs that replace a node pair, one per lane: four children of each node, or
/// one node and the grandchildren of the other.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pairs {
    of_a: LaneNodes,
    of_b: LaneNodes,
    /// The lanes that hold a pair, as a bit mask.
    pub(crate) lanes: u32,
}

impl Pairs {
    /// The pair in this lane.
    #[inline]
    pub(crate) fn pair(&self, lane: usize) -> NodePair {
        NodePair { a: self.of_a.id(lane), b: self.of_b.id(lane) }
    }
}

/// The lanes of [`Pairs`] in use, as a bit mask, at `[i][j]` for i + 1 children of a and j + 1 of
/// b.
const FAN_LANES: [[u32; FAN]; FAN] = {
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

/// The callbacks of a descent by distance ([`Bounds`]).
pub(crate) trait BoundVisitor<K>: PairVisitor<K> {
    /// Returns the limits. Pairs beyond both are pruned.
    fn limits(&self) -> Limits;

    /// Returns `true` if `pairs` may replace their parent pair `above`; otherwise `above` stays
    /// open.
    fn may_split(&mut self, above: &Open<K>, pairs: &Pairs, gaps: &Gaps) -> bool {
        let _ = (above, pairs, gaps);
        true
    }

    /// Returns the key of a child pair of `above` with these gaps of its boxes and enclosures.
    /// `None` prunes the pair.
    fn key(&mut self, above: &Open<K>, pair: NodePair, boxes: f32, enclosures: f32) -> Option<K>;
}

/// Two trees under a relative pose, compared by the distances of boxes and enclosures.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bounds<'a> {
    pub(crate) trees: [&'a Tree<'a>; 2],
    pub(crate) relative_pose: &'a RelativePose,
    /// The part of each scan that the enclosures contain.
    pub(crate) part: Part,
}

impl Bounds<'_> {
    /// The gaps of a single node pair.
    pub(crate) fn of(&self, level: Level, pair: NodePair) -> Gaps {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.split_by(simd, pair, [true; 2], Limits::NONE).1,
        ))
    }

    /// Splits a node pair and computes the gaps of the resulting pairs. Nodes marked in `whole` are
    /// kept.
    #[inline(always)]
    fn split<S: Simd>(&self, simd: S, pair: NodePair, whole: [bool; 2], limits: Limits) -> (Pairs, Gaps) {
        common(
            simd,
            #[inline(always)]
            || self.split_by(simd, pair, whole, limits),
        )
    }

    /// Does the same as [`Self::split`], as part of the caller.
    #[inline(always)]
    fn split_by<S: Simd>(
        &self,
        simd: S,
        NodePair { a, b }: NodePair,
        whole: [bool; 2],
        limits: Limits,
    ) -> (Pairs, Gaps) {
        let (&Self { trees: [of_a, of_b], relative_pose, part }, alone_a, alone_b) =
            (self, LaneNodes::alone(a), LaneNodes::alone(b));
        let (pairs, bounds_a, bounds_b) = match whole {
            [true, true] => (
                Pairs { of_a: alone_a, of_b: alone_b, lanes: 1 },
                alone(simd, &of_a.bounds_of(part, a)),
                alone(simd, &relative_pose.moved(&of_b.bounds_of(part, b))),
            ),
            [true, false] => {
                let below = of_b.topology().grandchildren(b);
                let bounds = of_b.bounds_of_grandchildren(simd, part, &below);
                (
                    Pairs { of_a: alone_a, of_b: below.nodes, lanes: below.lanes },
                    alone(simd, &of_a.bounds_of(part, a)),
                    relative_pose.moved(&bounds),
                )
            }
            [false, true] => {
                let below = of_a.topology().grandchildren(a);
                (
                    Pairs { of_a: below.nodes, of_b: alone_b, lanes: below.lanes },
                    of_a.bounds_of_grandchildren(simd, part, &below),
                    alone(simd, &relative_pose.moved(&of_b.bounds_of(part, b))),
                )
            }
            [false, false] => {
                let (below_a, below_b) = (of_a.topology().children(a), of_b.topology().children(b));
                let lanes = FAN_LANES[below_a.len() - 1][below_b.len() - 1];
                let a = of_a.bounds_of_children(simd, part, a);
                let b = of_b.bounds_of_children(simd, part, b);
                (
                    Pairs { of_a: LaneNodes::spread(below_a), of_b: LaneNodes::repeated(below_b), lanes },
                    each_spread(&a),
                    all_repeated(&relative_pose.moved(&b)),
                )
            }
        };
        let mut gaps = relative_pose.gaps(simd, &bounds_a, &bounds_b, limits);
        gaps.near &= pairs.lanes;
        (pairs, gaps)
    }
}

impl<K: PartialOrd + Copy, V: BoundVisitor<K>> Comparison<V, K> for Bounds<'_> {
    #[inline(always)]
    fn trees(&self) -> [&Tree<'_>; 2] {
        self.trees
    }

    #[inline(always)]
    fn scale(&self) -> f32 {
        self.relative_pose.scale
    }

    #[inline(always)]
    fn put_near<S: Simd, F: Frontier<K>>(
        &self,
        simd: S,
        open: Open<K>,
        whole: [bool; 2],
        frontier: &mut F,
        visitor: &mut V,
    ) -> (u32, Option<Open<K>>) {
        let (pairs, gaps) = self.split(simd, open.pair, whole, visitor.limits());
        let compared = pairs.lanes.count_ones();
        if !visitor.may_split(&open, &pairs, &gaps) {
            frontier.push(open);
            return (compared, None);
        }
        let (mut near, mut most) = (gaps.near, MostUrgent::new());
        while near != 0 {
            let lane = near.trailing_zeros() as usize % LANES;
            near &= near - 1;
            let pair = pairs.pair(lane);
            if let Some(key) = visitor.key(&open, pair, gaps.boxes[lane], gaps.enclosures[lane]) {
                most.add(Open { pair, key }, frontier);
            }
        }
        (compared, most.finish(simd, frontier))
    }
}

/// Repeats each of four values four times: 0000 1111 2222 3333.
#[inline(always)]
fn each_spread<S: Simd>(four: &NodeBounds<f32x4<S>>) -> NodeBounds<f32x16<S>> {
    four.map(
        #[inline(always)]
        |four| spread(four),
    )
}

/// Repeats the sequence of four values four times: 0123 0123 0123 0123.
#[inline(always)]
fn all_repeated<S: Simd>(four: &NodeBounds<f32x4<S>>) -> NodeBounds<f32x16<S>> {
    four.map(
        #[inline(always)]
        |four| repeated(four),
    )
}

/// Copies one value to all lanes.
#[inline(always)]
fn alone<S: Simd>(simd: S, one: &NodeBounds<f32>) -> NodeBounds<f32x16<S>> {
    one.map(
        #[inline(always)]
        |one| f32x16::splat(simd, one),
    )
}

#[cfg(test)]
mod tests {
    use nearmiss_geometry::PointCloud;
    use nearmiss_hierarchy::{BuildOptions, PointHierarchy, whole};
    use nearmiss_testdata::arbitrary::{point_in, rng, rotation};
    use nearmiss_testdata::instructions::levels;
    use rand::RngExt;

    use super::*;

    /// A scan of `count` points in a slab of this size.
    fn scan(rng: &mut impl rand::Rng, count: usize, size: f64) -> PointHierarchy {
        let points: Vec<_> =
            (0..count).map(|_| point_in(rng, size)).map(|[x, y, z]| [x, y, 0.1 * z]).collect();
        PointHierarchy::build(&PointCloud::from_positions(&points).unwrap(), &BuildOptions::default())
            .unwrap()
    }

    #[test]
    fn pairs_that_take_the_place_of_a_pair_hold_its_points_once_and_have_the_gaps_of_each_by_itself() {
        let rng = &mut rng(82);
        let mut kinds = [0; 3];
        for (count, size) in [([900, 700], 1.0), ([1500, 40], 1.0), ([60, 1100], 0.3), ([17, 900], 4.0)] {
            let scans = [scan(rng, count[0], 1.0), scan(rng, count[1], size)];
            let pose = rotation(rng).with_scale(0.7).with_translation(point_in(rng, 3.0));
            let [a, b] = [scans[0].arrays(), scans[1].arrays()];
            let points = |pair: NodePair| {
                let [a, b] = [(&a, pair.a), (&b, pair.b)].map(|(scan, node)| {
                    let points = scan.tree.topology().points(node);
                    (points.start, points.end)
                });
                (a, b)
            };
            let product = |((a, b), (c, d)): ((usize, usize), (usize, usize))| (b - a) * (d - c);
            for level in levels() {
                let relative_pose = RelativePose::of_centred(&pose);
                let bounds =
                    Bounds { trees: [&a.tree, &b.tree], relative_pose: &relative_pose, part: Part::Obstacle };
                let mut open = vec![NodePair::ROOTS];
                while let Some(pair) = open.pop() {
                    let leaves = [a.tree.topology().is_leaf(pair.a), b.tree.topology().is_leaf(pair.b)];
                    let whole = whole(bounds.trees, pair, leaves, relative_pose.scale);
                    let (pairs, gaps) =
                        dispatch!(level, simd => bounds.split(simd, pair, whole, Limits::NONE));
                    assert_eq!(gaps.near, pairs.lanes);
                    let lanes = (0..LANES).filter(|lane| pairs.lanes >> lane & 1 != 0);
                    let below: Vec<_> = lanes.map(|lane| (lane, pairs.pair(lane))).collect();
                    let sum: usize = below.iter().map(|below| product(points(below.1))).sum();
                    assert_eq!(sum, product(points(pair)), "{pair:?}");
                    for (lane, below) in below {
                        let own = dispatch!(level, simd => {
                            let a = alone(simd, &a.tree.bounds_of(Part::Obstacle, below.a));
                            let b = relative_pose.moved(&b.tree.bounds_of(Part::Obstacle, below.b));
                            relative_pose.gaps(simd, &a, &alone(simd, &b), Limits::NONE)
                        });
                        assert_eq!(own.boxes[0], gaps.boxes[lane], "{below:?}, {level:?}");
                        assert_eq!(own.enclosures[0], gaps.enclosures[lane], "{below:?}, {level:?}");
                        if below != pair && rng.random_bool(0.05) {
                            open.push(below);
                        }
                    }
                    let is_whole =
                        [pairs.of_a == LaneNodes::alone(pair.a), pairs.of_b == LaneNodes::alone(pair.b)];
                    kinds[match is_whole {
                        [_, true] => 0,
                        [false, false] => 1,
                        [true, false] => 2,
                    }] += 1;
                }
            }
        }
        assert!(kinds.iter().all(|&count| count > 3), "{kinds:?}");
    }
}
