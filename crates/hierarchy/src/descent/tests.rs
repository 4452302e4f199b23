use std::collections::BTreeSet;

use nearmiss_geometry::{NodeId, PointCloud, Pose};
use nearmiss_lanes::id32;
use nearmiss_testdata::arbitrary::{point_in, rng, unit_vector};
use nearmiss_testdata::instructions::levels;

use super::*;
use crate::bounds::part::Part;
use crate::scan::build::PointHierarchy;
use crate::scan::options::BuildOptions;
use crate::tree::topology::Grandchildren;

/// A scan of `count` points in a ball that is scaled along y and z by `flat`.
fn scan(rng: &mut impl rand::Rng, count: usize, flat: [f64; 3], leaf_size: u32) -> PointHierarchy {
    let point = |_| {
        let p = point_in(rng, 1.0);
        [p[0], p[1] * flat[1], p[2] * flat[2]]
    };
    let points: Vec<[f64; 3]> = (0..count).map(point).collect();
    let cloud = PointCloud::from_positions(&points).unwrap();
    PointHierarchy::build(&cloud, &BuildOptions::default().with_leaf_size(leaf_size)).unwrap()
}

/// Records leaf pairs, and ends the descent after `most` of them.
#[derive(Default)]
struct All {
    leaves: Vec<[usize; 2]>,
    most: usize,
    compared: u64,
}

impl PairVisitor for All {
    fn compared(&mut self, pairs: u32) -> ControlFlow<()> {
        self.compared += u64::from(pairs);
        ControlFlow::Continue(())
    }

    fn leaf_pair(&mut self, leaves: [usize; 2], _: &Open) -> ControlFlow<()> {
        if self.leaves.len() == self.most {
            return ControlFlow::Break(());
        }
        self.leaves.push(leaves);
        ControlFlow::Continue(())
    }
}

impl BoxVisitor for All {}

/// Returns the points of a leaf, transformed by `place`.
fn points(scan: &PointHierarchy, leaf: usize, place: impl Fn([f32; 3]) -> [f32; 3]) -> Vec<[f32; 3]> {
    scan.topology().points_of_leaf(leaf).map(|i| place(scan.positions()[i])).collect()
}

#[test]
fn leaves_in_lanes_are_their_points() {
    let rng = &mut rng(3);
    for (count, leaf_size) in
        [(9, 16), (16, 16), (17, 16), (33, 16), (48, 16), (700, 16), (700, 5), (900, 40)]
    {
        let scan = scan(rng, count, [1.0; 3], leaf_size);
        let (topology, leaves) = (scan.topology(), scan.arrays().leaves);
        for number in 0..topology.leaves() {
            let bounds = scan.tree().bounds(topology.leaf(number));
            for (block, first, points) in leaves.blocks(number) {
                assert_eq!((block.centre, block.half, block.axes), (bounds.centre, bounds.half, bounds.axes));
                // Sixteen bits per number; all lanes at once equal one by one.
                let off = |x: [f32; 3], y: [f32; 3]| (0..3).fold(0.0_f32, |m, k| m.max((x[k] - y[k]).abs()));
                let step = bounds.radius() / 32767.0;
                for lane in 0..points {
                    let i = first + lane;
                    assert!(off(block.position(lane), scan.positions()[i]) <= 0.52 * step);
                    assert!(off(block.normal(lane), scan.arrays.normals[i]) <= 0.52 / 32767.0);
                    assert!((block.disc(lane) - scan.discs().get(i)).abs() <= 0.52 * step);
                }
                for level in levels() {
                    let (positions, normals, discs) = dispatch!(level, simd => simd.vectorize(
                        #[inline(always)]
                        || {
                            let ([x, y, z], [u, v, w]) = (block.positions(simd), block.normals(simd));
                            let rows = [x.to_array(), y.to_array(), z.to_array()];
                            (rows, [u.to_array(), v.to_array(), w.to_array()], block.discs(simd).to_array())
                        },
                    ));
                    for lane in 0..points {
                        assert_eq!(positions.map(|row| row[lane]), block.position(lane));
                        assert_eq!(normals.map(|row| row[lane]), block.normal(lane));
                        assert_eq!(discs[lane].to_bits(), block.disc(lane).to_bits());
                    }
                }
            }
            let counts = leaves.blocks(number).map(|(.., points)| points);
            assert_eq!(counts.sum::<usize>(), topology.points_of_leaf(number).len());
        }
    }
}

#[test]
fn sixteen_pairs_at_once_are_what_one_by_one_is() {
    let rng = &mut rng(4);
    let scans = [
        scan(rng, 900, [1.0, 1.0, 0.0], 16),
        scan(rng, 500, [1.0, 1.0, 1.0], 16),
        scan(rng, 60, [1.0, 0.0, 0.0], 16),
    ];
    let (mut near_ones, mut others) = (0, 0);
    for round in 0..3000 {
        let [a, b] = [&scans[round % 3], &scans[round / 3 % 3]].map(PointHierarchy::arrays);
        let scale = [1.0, 0.3, 7.0][round % 3];
        let turned = Pose::from_axis_angle(unit_vector(rng), 3.0);
        let relative = Relative::new(&turned.with_scale(scale).with_translation(point_in(rng, 1.0)), 8.0);
        let reach = [0.0, 0.1, 0.5][round % 3];
        let parents = [&a, &b].map(|scan| NodeId(id32(round * 7 % scan.tree.topology().inner())));
        let sides = [Side::below(&a.tree, parents[0]), Side::below(&b.tree, parents[1])];
        let (mut near, mut compared, mut most) = (0, 0, f32::NEG_INFINITY);
        let overlap = |lane: u32| {
            let [i, j] = [lane % 4, lane / 4];
            let is_there = sides[0].lanes >> i & 1 == 1 && sides[1].lanes >> j & 1 == 1;
            is_there.then(|| {
                let [of_a, of_b] = [sides[0].id(i), sides[1].id(j)];
                let (box_a, box_b) = (a.tree.bounds(of_a), b.tree.bounds(of_b));
                let overlap = relative.overlap(&box_a, &box_b, f32::MIN_POSITIVE);
                (relative.gap(&box_a, &box_b), overlap)
            })
        };
        let mut apart = f32::INFINITY;
        for (lane, (gap, overlap)) in (0..16).filter_map(|lane| Some((lane, overlap(lane)?))) {
            compared += 1;
            if gap <= reach {
                near |= 1 << lane;
                most = most.max(overlap);
            } else {
                apart = apart.min(gap);
            }
        }
        for level in levels() {
            let found = dispatch!(level, simd => simd.vectorize(
                #[inline(always)]
                || {
                    let pair = TreePair { a: &a.tree, b: &b.tree, relative: &relative, reach };
                    let there = (0..16).filter(|&lane| overlap(lane).is_some()).fold(0, |bits, lane| bits | 1 << lane);
                    assert_eq!(there, (sides[0].lanes * 0x1111) & EACH_IN_FOUR[sides[1].lanes as usize]);
                    let found = pair.compare(simd, [sides[0].boxes, sides[1].boxes], there, true);
                    (found.lanes, found.most, found.shares, found.apart, found.gaps.to_array())
                },
            ));
            let (lanes, first, shares, least, gaps) = found;
            assert_eq!(lanes, near, "round {round}, {level:?}");
            assert_eq!(least.to_bits(), apart.to_bits(), "round {round}, {level:?}");
            for (lane, expected) in (0..16).filter_map(|lane| Some((lane, overlap(lane)?))) {
                assert_eq!(gaps[lane as usize], expected.0, "round {round}, {level:?}");
                if near >> lane & 1 == 1 {
                    assert_eq!(1.0 - shares[lane as usize], expected.1, "{round}, {level:?}");
                }
            }
            if near != 0 {
                assert_eq!(overlap(first).map(|(_, overlap)| overlap), Some(most), "{round}, {level:?}");
            }
        }
        near_ones += near.count_ones();
        others += compared - near.count_ones();
    }
    assert!(near_ones > 2000 && others > 2000, "{near_ones} {others}");
}

#[test]
fn all_leaves_with_points_within_reach_are_found_and_none_twice() {
    let rng = &mut rng(5);
    let mut found_any = 0;
    for round in 0..60_usize {
        let leaf_size = [16, 16, 7, 33][round % 4];
        let a = scan(rng, [9, 40, 300, 800][round / 2 % 4], [1.0, 1.0, 0.1], leaf_size);
        let b = scan(rng, [300, 9, 700, 47][round / 3 % 4], [1.0, 0.7, 0.7], leaf_size);
        // Very different sizes, and leaves at different depths.
        let scale = [1.0, 0.05, 20.0][round % 3];
        let pose = Pose::from_axis_angle(unit_vector(rng), 2.0).with_scale(scale);
        let shift = point_in(rng, if round % 7 == 0 { 9.0 } else { 0.3 });
        let relative = Relative::new(&pose.with_translation(shift), 64.0);
        let reach = relative.slack() + [0.1, 0.3][round % 2];
        let mut visitor = All { most: usize::MAX, ..All::default() };
        let stack = &mut Stack::default();
        let pair = TreePair { a: &a.tree(), b: &b.tree(), relative: &relative, reach };
        let flow = descend(pair, Level::new(), stack, &mut visitor);
        assert!(flow.is_continue() && stack.iter().next().is_none());
        let found: BTreeSet<[usize; 2]> = visitor.leaves.iter().copied().collect();
        assert_eq!(found.len(), visitor.leaves.len(), "round {round}: some leaves twice");
        let leaves = |scan: &PointHierarchy| scan.len().div_ceil(leaf_size as usize);
        for leaf_a in 0..leaves(&a) {
            let of_a = points(&a, leaf_a, |p| p);
            for leaf_b in 0..leaves(&b) {
                let of_b = points(&b, leaf_b, |p| relative.point(p));
                let near = |p: &[f32; 3], q: &[f32; 3]| {
                    let d = [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
                    d[0] * d[0] + d[1] * d[1] + d[2] * d[2] <= (reach - relative.slack()).powi(2)
                };
                if of_a.iter().any(|p| of_b.iter().any(|q| near(p, q))) {
                    found_any += 1;
                    assert!(found.contains(&[leaf_a, leaf_b]), "round {round}: {leaf_a}, {leaf_b}");
                }
            }
        }
        // If a descent is interrupted and resumed from the open pairs, no pair is lost.
        let mut first = All { most: found.len() / 2, ..All::default() };
        let flow = descend(pair, Level::new(), stack, &mut first);
        assert_eq!(flow.is_break(), !found.is_empty());
        let open: Vec<NodePair> = stack.iter().collect();
        for &[leaf_a, leaf_b] in found.iter().filter(|leaves| !first.leaves.contains(leaves)) {
            let holds = |scan: &PointHierarchy, id: NodeId, leaf: usize| {
                let (points, node) = (scan.topology().points_of_leaf(leaf), scan.topology().points(id));
                node.start <= points.start && points.end <= node.end
            };
            let is_open = open.iter().any(|pair| holds(&a, pair.a, leaf_a) && holds(&b, pair.b, leaf_b));
            assert!(is_open, "round {round}: {leaf_a}, {leaf_b} is not open");
        }
        let mut rest = All { most: usize::MAX, ..All::default() };
        assert!(resume(&pair, Level::new(), stack, &mut rest).is_continue());
        let all: BTreeSet<[usize; 2]> = first.leaves.iter().chain(&rest.leaves).copied().collect();
        assert_eq!(all, found, "round {round}: gone on with");
        // The order does not matter.
        let mut best = All { most: usize::MAX, ..All::default() };
        assert!(descend(pair, Level::new(), &mut Heap::default(), &mut best).is_continue());
        let by_heap: BTreeSet<[usize; 2]> = best.leaves.iter().copied().collect();
        assert_eq!((by_heap, best.leaves.len()), (found.clone(), found.len()), "round {round}: by urgency");
    }
    assert!(found_any > 200, "{found_any}");
}

/// The near leaf pairs in the order of the descent, with one pair of boxes compared at a time.
fn plunged([a, b]: [&PointHierarchy; 2], relative: &Relative, reach: f32, mut turns: u32) -> Vec<[usize; 2]> {
    let is_leaf = |scan: &PointHierarchy, id: NodeId| scan.topology().is_leaf(id);
    let below = |scan: &PointHierarchy, id: NodeId| scan.topology().children(id).iter().collect::<Vec<_>>();
    let longest = |scan: &PointHierarchy, id: NodeId| {
        below(scan, id).into_iter().map(|id| scan.tree().bounds(id).half[0]).fold(0.0, f32::max)
    };
    let mut order = Vec::new();
    let mut open = vec![(NodeId::ROOT, NodeId::ROOT, 1.0)];
    while let Some((of_a, of_b, _)) = open.pop() {
        let leaves = [is_leaf(a, of_a), is_leaf(b, of_b)];
        let mut whole = leaves;
        if leaves == [true; 2] {
            order.push([a.topology().leaf_number(of_a), b.topology().leaf_number(of_b)]);
        } else if leaves == [false; 2] {
            let lengths = [longest(a, of_a), longest(b, of_b) * relative.scale()];
            whole = [lengths[1] > 2.0 * lengths[0], lengths[0] > 2.0 * lengths[1]];
        }
        let mut near = Vec::new();
        if leaves != [true; 2] {
            let split = |scan, id, whole: bool| if whole { vec![id] } else { below(scan, id) };
            for &b_id in &split(b, of_b, whole[1]) {
                for &a_id in &split(a, of_a, whole[0]) {
                    let (of_a, of_b) = (a.tree().bounds(a_id), b.tree().bounds(b_id));
                    if relative.gap(&of_a, &of_b) <= reach {
                        near.push((a_id, b_id, relative.overlap(&of_a, &of_b, f32::MIN_POSITIVE)));
                    }
                }
            }
        }
        // The first of the pairs with the greatest overlap.
        let best = |pairs: &[(NodeId, NodeId, f32)]| {
            (0..pairs.len()).rev().max_by(|&i, &j| pairs[i].2.total_cmp(&pairs[j].2))
        };
        if let Some(most) = best(&near) {
            let most = near.remove(most);
            open.extend(near);
            open.push(most);
        } else if let Some(most) = best(&open).filter(|_| turns > 0) {
            turns -= 1;
            let last = open.len() - 1;
            open.swap(most, last);
        }
    }
    order
}

#[test]
fn after_nothing_comes_what_overlaps_most_of_all_that_is_left() {
    let rng = &mut rng(6);
    let (mut pairs, mut turns) = (0, 0);
    for round in 0..40_usize {
        let leaf_size = [16, 7][round % 2];
        let a = scan(rng, [700, 60, 1500][round % 3], [1.0, 1.0, 0.1], leaf_size);
        let b = scan(rng, [900, 1100, 40][round / 3 % 3], [1.0, 0.7, 0.2], leaf_size);
        let pose = Pose::from_axis_angle(unit_vector(rng), 2.0).with_scale([1.0, 0.3, 4.0][round % 3]);
        let relative = Relative::new(&pose.with_translation(point_in(rng, 0.5)), 64.0);
        let wants_any = round % 4 != 0;
        let expected = plunged([&a, &b], &relative, 0.05, if wants_any { frontier::TURNS } else { 0 });
        for level in levels() {
            let mut visitor = All { most: usize::MAX, ..All::default() };
            let stack = &mut Stack::default();
            let trees = TreePair { a: &a.tree(), b: &b.tree(), relative: &relative, reach: 0.05 };
            let flow = if wants_any {
                descend(trees, level, &mut Plunging::new(stack), &mut visitor)
            } else {
                descend(trees, level, stack, &mut visitor)
            };
            assert!(flow.is_continue());
            assert_eq!(visitor.leaves, expected, "round {round}, {level:?}");
        }
        pairs += expected.len();
        turns += expected.windows(2).filter(|two| two[0][0].abs_diff(two[1][0]) > 8).count();
    }
    assert!(pairs > 2000 && turns > 200, "{pairs} {turns}");
}

#[test]
fn children_and_grandchildren_in_lanes_have_the_bounds_of_their_nodes() {
    let rng = &mut rng(6);
    for (count, leaf_size) in [(9, 16), (33, 16), (48, 16), (700, 5), (900, 40)] {
        let scan = scan(rng, count, [1.0, 1.0, 0.1], leaf_size);
        let (topology, tree) = (scan.topology(), scan.tree());
        for node in topology.ids() {
            let alone = tree.bounds_of(Part::Surface, node);
            assert_eq!((alone.centre, alone.axes), (tree.bounds(node).centre, tree.bounds(node).axes));
            if topology.is_leaf(node) {
                continue;
            }
            let children: Vec<NodeId> = topology.children(node).iter().collect();
            let grandchildren = topology.grandchildren(node);
            let Grandchildren { nodes: below, lanes, .. } = grandchildren;
            let expected = |lane: usize| tree.bounds_of(Part::Surface, children[lane]);
            for level in levels() {
                dispatch!(level, simd => {
                    let own = tree.bounds_of_children(simd, Part::Surface, node);
                    for lane in 0..children.len() {
                        assert_eq!(own.map(|row| row[lane]), expected(lane), "{node:?}, {lane}, {level:?}");
                    }
                    let own = tree.bounds_of_grandchildren(simd, Part::Surface, &grandchildren);
                    for lane in (0..LANES).filter(|lane| lanes >> lane & 1 != 0) {
                        let expected = tree.bounds_of(Part::Surface, below.id(lane));
                        assert_eq!(own.map(|row| row[lane]), expected, "{node:?}, {lane}, {level:?}");
                    }
                });
            }
            // Each child is represented by its own children, or by itself if it is a leaf.
            let found: Vec<NodeId> =
                (0..LANES).filter(|lane| lanes >> lane & 1 != 0).map(|lane| below.id(lane)).collect();
            let of_child = |&child: &NodeId| match topology.is_leaf(child) {
                true => vec![child],
                false => topology.children(child).iter().collect(),
            };
            assert_eq!(found, children.iter().flat_map(of_child).collect::<Vec<_>>());
        }
    }
}
