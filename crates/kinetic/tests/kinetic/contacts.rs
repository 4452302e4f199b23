//! Separation lists against loops over all pairs of primitives.

use nearmiss_geometry::Aabb;
use nearmiss_kinetic::{FirstContact, FlightPlan, KineticTree, SelfSeparationList, SeparationList};
use nearmiss_testdata::arbitrary::{point_in, rng, unit_vector};
use rand::{Rng, RngExt};

use crate::model::{MOTIONS, Model};

/// By how much two boxes overlap; negative if they are apart.
fn depth(a: &Aabb, b: &Aabb) -> f64 {
    (0..3).map(|k| (a.max[k] - b.min[k]).min(b.max[k] - a.min[k])).fold(f64::INFINITY, f64::min)
}

/// Checks that a search among the `found` pairs ends at the one that is looked for.
fn check_any<T>(found: &[T], any_overlap: impl Fn(&mut dyn FnMut(u32, u32) -> bool) -> bool) {
    for most in [1, found.len() / 2, found.len() + 1] {
        let mut calls = 0;
        let has_found = any_overlap(&mut |_, _| {
            calls += 1;
            calls == most
        });
        assert_eq!(has_found, (1..=found.len()).contains(&most), "{most} of {}", found.len());
        assert_eq!(calls, if has_found { most } else { found.len() }, "none after the one that is found");
    }
}

#[test]
fn overlaps_are_those_of_loops() {
    let rng = &mut rng(21);
    for motion in MOTIONS {
        let [mut a, mut b] = [3, 1].map(|arity| Model::random(motion, 60, arity, rng));
        let start = a.tree.clock().max(b.tree.clock());
        for model in [&mut a, &mut b] {
            model.tree.advance(start).unwrap();
        }
        let mut list = SeparationList::new();
        for step in 0..12_u32 {
            let time = start + 0.25 * f64::from(step);
            list.advance(&mut a.tree, &mut b.tree, time).unwrap();
            let mut found = Vec::new();
            list.for_each_overlap(&a.tree, &b.tree, |i, j| found.push((i, j)));
            check_any(&found, |wanted| list.any_overlap(&a.tree, &b.tree, wanted));
            found.sort_unstable();
            let mut once = found.clone();
            once.dedup();
            assert_eq!(found, once, "{motion:?}: each pair once");
            for i in a.alive() {
                for j in b.alive() {
                    let depth = depth(&a.bounds(i), &b.bounds(j));
                    let is_found = found.binary_search(&(i, j)).is_ok();
                    assert!(
                        is_found || depth < 1e-11,
                        "{motion:?}: {i} and {j} missed, {depth} deep at {time}"
                    );
                    assert!(!is_found || depth > -1e-11, "{motion:?}: {i} and {j} found, {depth} at {time}");
                }
            }
        }
    }
}

#[test]
fn overlaps_of_one_tree_are_those_of_loops() {
    let rng = &mut rng(24);
    for motion in MOTIONS {
        let mut model = Model::random(motion, 80, 2, rng);
        let start = model.tree.clock();
        let mut list = SelfSeparationList::new();
        for step in 0..12_u32 {
            let time = start + 0.25 * f64::from(step);
            list.advance(&mut model.tree, time).unwrap();
            let mut found = Vec::new();
            list.for_each_overlap(&model.tree, |i, j| found.push([i.min(j), i.max(j)]));
            check_any(&found, |wanted| list.any_overlap(&model.tree, wanted));
            found.sort_unstable();
            let mut once = found.clone();
            once.dedup();
            assert_eq!(found, once, "{motion:?}: each pair once");
            let alive = model.alive();
            for (n, &i) in alive.iter().enumerate() {
                for &j in &alive[n + 1..] {
                    let depth = depth(&model.bounds(i), &model.bounds(j));
                    let is_found = found.binary_search(&[i.min(j), i.max(j)]).is_ok();
                    let is_right = if is_found { depth > -1e-11 } else { depth < 1e-11 };
                    assert!(is_right, "{motion:?}: {i} and {j}, {depth} deep at {time}: {is_found}");
                }
            }
        }
    }
}

#[test]
fn contacts_of_one_tree_are_the_earliest() {
    let rng = &mut rng(25);
    let mut hits = 0;
    for round in 0..30 {
        let (mut plans, mut pairs) = boxes(40, -1.3, rng);
        let (others, _) = boxes(40, 1.3, rng);
        pairs.extend((40..80_u32).map(|i| [2 * i, 2 * i + 1]));
        plans.extend(others);
        let mut tree = KineticTree::new(0.0, plans, &pairs).unwrap();
        // Boxes of the same half may overlap from the start; those count between the halves only.
        let across = |[i, j]: [u32; 2]| (i < 40) != (j < 40);
        let mut expected: Option<f64> = None;
        let mut late = tree.clone();
        for [from, to] in [[0.0, 2.0], [2.0, 5.0]] {
            late.advance(from).unwrap();
            for (i, j) in (0..40).flat_map(|i| (40..80).map(move |j| (i, j))) {
                let time = rigid([&late; 2], [i, j], [from, to]);
                expected = expected.into_iter().chain(time).reduce(f64::min);
            }
        }
        let mut list = SelfSeparationList::new();
        let narrow =
            |tree: &KineticTree, pair, span| if across(pair) { rigid([tree; 2], pair, span) } else { None };
        let found = list.next_contact(&mut tree, 5.0, narrow).unwrap();
        match (found, expected) {
            (Some(found), Some(expected)) => {
                hits += 1;
                assert!((found.time - expected).abs() < 1e-9, "{round}: {found:?}, {expected}");
                assert!(across(found.primitives), "{found:?}");
            }
            (found, expected) => assert!(found.is_none() && expected.is_none(), "{found:?}, {expected:?}"),
        }
    }
    assert!(hits > 10, "{hits}");
}

/// Rigid boxes in linear motion with knots: two corners each.
fn boxes<R: Rng>(count: usize, shift: f64, rng: &mut R) -> (Vec<FlightPlan>, Vec<[u32; 2]>) {
    let mut plans = Vec::new();
    for _ in 0..count {
        let [x, y, z] = point_in(rng, 1.0);
        let corner = [x + shift, y, z];
        let size = [0; 3].map(|_: i32| rng.random_range(0.01..0.05));
        let [first, second] = [0; 2].map(|_: i32| {
            let [u, v, w] = unit_vector(rng);
            [0.3 * u - 0.4 * shift, 0.3 * v, 0.3 * w]
        });
        for place in [corner, [0, 1, 2].map(|k| corner[k] + size[k])] {
            let plan = FlightPlan::linear(0.0, place, first).unwrap();
            let turn = FlightPlan::linear(2.0, plan.position(2.0), second).unwrap();
            plans.push(plan.then(turn).unwrap());
        }
    }
    let pairs = (0..u32::try_from(count).unwrap()).map(|i| [2 * i, 2 * i + 1]);
    (plans, pairs.collect())
}

/// When two rigid boxes in linear motion meet within an interval.
fn rigid(trees: [&KineticTree; 2], primitives: [u32; 2], [from, to]: [f64; 2]) -> Option<f64> {
    let corners = [0, 1].map(|k| trees[k].primitive(primitives[k]).unwrap());
    let place =
        |tree: usize, corner: usize, time| trees[tree].position_at(corners[tree][corner], time).unwrap();
    let [mut enter, mut exit] = [from, to];
    for k in 0..3 {
        // Both must be positive: how far each box reaches beyond the start of the other.
        for [ahead, behind] in [[0, 1], [1, 0]] {
            let reach = |time| place(ahead, 1, time)[k] - place(behind, 0, time)[k];
            let [start, rate] = [reach(from), reach(from + 1.0) - reach(from)];
            if rate == 0.0 && start < 0.0 {
                return None;
            }
            let root = from - start / rate;
            if rate > 0.0 {
                enter = enter.max(root);
            } else if rate < 0.0 {
                exit = exit.min(root);
            }
        }
    }
    (enter <= exit).then_some(enter)
}

#[test]
fn contacts_are_the_earliest() {
    let rng = &mut rng(22);
    let mut hits = 0;
    for round in 0..30 {
        let [(plans_a, boxes_a), (plans_b, boxes_b)] = [-1.3, 1.3].map(|shift| boxes(40, shift, rng));
        let mut a = KineticTree::new(0.0, plans_a, &boxes_a).unwrap();
        let mut b = KineticTree::new(0.0, plans_b, &boxes_b).unwrap();
        // The twin looks at all pairs, leg by leg.
        let mut expected: Option<f64> = None;
        let [mut late_a, mut late_b] = [a.clone(), b.clone()];
        for [from, to] in [[0.0, 2.0], [2.0, 5.0]] {
            late_a.advance(from).unwrap();
            late_b.advance(from).unwrap();
            for i in 0..40 {
                for j in 0..40 {
                    let time = rigid([&late_a, &late_b], [i, j], [from, to]);
                    expected = match (expected, time) {
                        (Some(x), Some(y)) => Some(x.min(y)),
                        (x, y) => x.or(y),
                    };
                }
            }
        }
        let mut list = SeparationList::new();
        let found = list.next_contact(&mut a, &mut b, 5.0, rigid).unwrap();
        match (found, expected) {
            (Some(FirstContact { time, primitives }), Some(expected)) => {
                hits += 1;
                assert!((time - expected).abs() < 1e-9, "round {round}: {time}, {expected}");
                assert_eq!(a.clock(), time, "the trees are at the contact");
                let [i, j] = primitives;
                let gap = depth(&a.primitive_bounds(i).unwrap(), &b.primitive_bounds(j).unwrap());
                assert!(gap.abs() < 1e-9, "round {round}: boxes {i} and {j} are {gap} deep");
            }
            (None, None) => {}
            _ => panic!("round {round}: expected {expected:?}, got {found:?}"),
        }
        let boxes_meet = list.next_contact(&mut a, &mut b, 9.0, |_, _, [from, _]| Some(from)).unwrap();
        assert!(found.is_none() || boxes_meet.is_some(), "boxes of leaves meet no later");
    }
    assert!(hits > 10, "{hits} contacts in 30 rounds");
}

#[test]
fn clocks_must_agree() {
    let [mut a, mut b] = [0.0, 1.0]
        .map(|start| KineticTree::of_points(start, [FlightPlan::at_rest(0.0, [0.0; 3]).unwrap()]).unwrap());
    let mut list = SeparationList::new();
    let message = list.advance(&mut a, &mut b, 2.0).unwrap_err().to_string();
    assert!(message.starts_with("expected two trees at the same time, got 0 s and 1 s"), "{message}");
    a.advance(1.0).unwrap();
    list.advance(&mut a, &mut b, 2.0).unwrap();
    assert_eq!(list.pair_counts(), [0, 1], "they meet");
    let empty = &mut KineticTree::of_points(2.0, []).unwrap();
    assert_eq!(SeparationList::new().next_contact(&mut a, empty, 3.0, rigid).unwrap(), None, "nothing");
}
