//! Inserts, removes and moves points, and compares the graph with a search of all pairs.
use nearmiss_graph::{DynamicGraph, GraphError, GraphOptions};
use nearmiss_testdata::arbitrary::{CloudKind, cloud, rng};
use nearmiss_testdata::oracle::proximity;
use proptest::prelude::*;
use rand::RngExt;

type Point = [f32; 3];

#[expect(clippy::cast_possible_truncation, reason = "points are stored in single precision")]
fn points(kind: CloudKind, n: u32, seed: u64) -> Vec<Point> {
    cloud(kind, n, seed).iter().map(|p| p.map(|x| x as f32 + 0.0)).collect()
}

/// Compares every list and radius with those of a search of all pairs.
fn compare(graph: &DynamicGraph, ids: u32, r: usize, what: &str) {
    let there: Vec<u32> = (0..ids).filter(|&id| graph.position(id).is_some()).collect();
    let positions: Vec<Point> = there.iter().map(|&id| graph.position(id).unwrap()).collect();
    let twin = proximity(&positions, r, None);
    assert_eq!(graph.len(), there.len(), "{what}");
    let mut lists = vec![Vec::new(); there.len()];
    for [a, b] in twin.edges {
        lists[a as usize].push(there[b as usize]);
        lists[b as usize].push(there[a as usize]);
    }
    for (i, &id) in there.iter().enumerate() {
        lists[i].sort_unstable();
        assert_eq!(graph.of(id), lists[i], "{what}: point {id}");
        let radius = f64::from(graph.radius(id).unwrap());
        assert!((radius - twin.radii[i]).abs() <= 1e-7 * twin.radii[i], "{what}: radius of point {id}");
    }
}

/// Makes random updates and compares the graph after each.
fn play(kind: CloudKind, n: u32, seed: u64, r: u32) {
    let pool: Vec<Point> = points(kind, 3 * n, seed);
    let rng = &mut rng(seed);
    let mut used: Vec<Point> = Vec::new();
    for p in &pool[..n as usize] {
        if !used.contains(p) {
            used.push(*p);
        }
    }
    let options = GraphOptions::default().with_neighbours(r);
    let mut graph = DynamicGraph::new(&used, &options).unwrap();
    let mut ids = u32::try_from(used.len()).unwrap();
    for step in 0..40 {
        let id = rng.random_range(0..ids.max(1));
        let to = pool[rng.random_range(0..pool.len())];
        let free = (0..ids).all(|id| graph.position(id) != Some(to));
        let what = format!("{kind:?}, seed {seed}, r = {r}, step {step}");
        match rng.random_range(0..3) {
            0 if free => {
                let (new, touched) = graph.insert(to).unwrap();
                assert_eq!(new, ids, "{what}");
                assert!(touched.spheres >= 1 && touched.points >= touched.spheres, "{what}: {touched:?}");
                ids += 1;
            }
            1 => assert_eq!(graph.position(id).is_some(), graph.remove(id).is_some(), "{what}"),
            _ if free => {
                let there = graph.position(id).is_some();
                assert_eq!(graph.relocate(id, to).unwrap().is_some(), there, "{what}");
            }
            _ => {}
        }
        compare(&graph, ids, r as usize, &what);
    }
}

#[test]
fn after_every_update_the_graph_is_that_of_all_pairs() {
    for (seed, kind) in (0..).zip(CloudKind::ALL) {
        play(kind, 60, seed, 4);
        play(kind, 6, seed, 4);
    }
    play(CloudKind::Sphere, 1, 1, 4);
    play(CloudKind::Lattice, 40, 2, 1);
    play(CloudKind::Rings, 80, 3, 32);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn so_is_it_for_any_seed(kind in 0..CloudKind::ALL.len(), n in 1_u32..50, seed in any::<u64>(), r in 1_u32..9) {
        play(CloudKind::ALL[kind], n, seed, r);
    }
}

#[test]
fn what_is_not_there_is_told() {
    let mut graph = DynamicGraph::new(&[[0.0; 3], [1.0, 0.0, 0.0]], &GraphOptions::default()).unwrap();
    assert_eq!(graph.remove(2), None);
    assert!(graph.remove(1).is_some(), "it was there");
    assert_eq!((graph.remove(1), graph.position(1), graph.radius(1), graph.len()), (None, None, None, 1));
    assert_eq!(graph.of(1), [0_u32; 0]);
    let far = graph.insert([f32::NAN, 0.0, 0.0]);
    assert_eq!(far, Err(GraphError::Coordinate { index: 0 }));
    assert_eq!(graph.relocate(0, [2e18, 0.0, 0.0]), Err(GraphError::Coordinate { index: 0 }));
    assert_eq!(graph.position(0), Some([0.0; 3]), "it stays where it was");
}
