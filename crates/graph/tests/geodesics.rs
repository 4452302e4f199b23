//! Shortest paths and the map of close pairs against relaxing every edge until nothing changes.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod clouds;

use clouds::{Cloud, single};
use nearmiss_graph::{Adjacency, ClosePairs, GeodesicScratch, Network, Paths, edge_lengths};
use nearmiss_testdata::arbitrary::{CloudKind, cloud};
use nearmiss_testdata::shapes::torus;

/// Bellman and Ford's algorithm, in double precision and in the sums that ours is said to form.
fn relaxed(graph: &Adjacency, points: &[[f32; 3]], source: usize) -> Vec<(f64, f32)> {
    let mut known = vec![(f64::INFINITY, f32::INFINITY); points.len()];
    known[source] = (0.0, 0.0);
    loop {
        let before = known.clone();
        for i in 0..points.len() {
            for &j in graph.of(i) {
                let (p, q) = (points[i], points[j as usize]);
                let exact = known[i].0 + clouds::distance(&p, &q);
                let [x, y, z] = [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
                let edge = (x * x + y * y + z * z).sqrt();
                let single = (known[i].1 + edge).max(known[i].1.next_up());
                let to = &mut known[j as usize];
                *to = (to.0.min(exact), to.1.min(single));
            }
        }
        if before == known {
            return known;
        }
    }
}

fn small_clouds() -> Vec<Cloud> {
    let kinds = [
        CloudKind::Random,
        CloudKind::Clustered,
        CloudKind::Lattice,
        CloudKind::Rings,
        CloudKind::Collinear,
        CloudKind::OneVoxel,
        CloudKind::Duplicates,
        CloudKind::Huge,
        CloudKind::Tiny,
        CloudKind::Sphere,
    ];
    kinds
        .into_iter()
        .map(|kind| {
            let mut points = single(&cloud(kind, 300, 5));
            points.sort_unstable_by(|a, b| a.map(f32::to_bits).cmp(&b.map(f32::to_bits)));
            points.dedup();
            Cloud::new(points)
        })
        .collect()
}

#[test]
fn searches_find_what_relaxing_finds() {
    let mut scratch = GeodesicScratch::default();
    for cloud in small_clouds() {
        let network = Network::new(&cloud.graph, &cloud.lengths);
        for source in (0..cloud.points.len()).step_by(37) {
            let naive = relaxed(&cloud.graph, &cloud.points, source);
            let id = u32::try_from(source).unwrap();
            let whole = scratch.within(network, id, f32::MAX).to_vec();
            assert_eq!(whole.len(), naive.iter().filter(|d| d.0 < f64::INFINITY).count());
            for found in &whole {
                let (exact, single) = naive[found.point as usize];
                assert_eq!(found.distance.to_bits(), single.to_bits(), "{source} to {}", found.point);
                assert!((f64::from(found.distance) - exact).abs() <= 1e-5 * exact, "{single} for {exact}");
            }
            assert!(whole.windows(2).all(|two| {
                (two[0].distance.to_bits(), two[0].point) < (two[1].distance.to_bits(), two[1].point)
            }));
            let reach = 4.0 * cloud.radii[source];
            let some = scratch.within(network, id, reach).to_vec();
            assert_eq!(some, whole[..whole.partition_point(|found| found.distance <= reach)]);
        }
    }
}

#[test]
fn paths_are_as_long_as_said_and_go_along_edges() {
    let cloud = Cloud::of_form(torus(1.0, 0.4), 0.1, 0.0, 3);
    let network = Network::new(&cloud.graph, &cloud.lengths);
    let (mut scratch, mut path) = (GeodesicScratch::default(), Vec::new());
    for (a, b) in [(0, 700), (5, 5), (311, 17)] {
        let distance = scratch.path(network, a, b, &mut path).unwrap();
        assert_eq!((path[0], path[path.len() - 1]), (a, b));
        let long = path.windows(2).map(|two| {
            assert!(cloud.graph.of(two[0] as usize).contains(&two[1]), "{two:?} is no edge");
            clouds::distance(&cloud.points[two[0] as usize], &cloud.points[two[1] as usize])
        });
        let long: f64 = long.sum();
        assert!((long - f64::from(distance)).abs() < 1e-5, "{long} along a path of {distance}");
    }
    // Two points on their own.
    let graph = Adjacency::from_edges(4, &[[0, 1], [2, 3]]);
    let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0]];
    let lengths = edge_lengths(&graph, &points);
    let network = Network::new(&graph, &lengths);
    assert_eq!(scratch.path(network, 0, 3, &mut path), None);
    assert!(path.is_empty());
    assert_eq!(scratch.distance(network, 2, 3), Some(1.0));
}

#[test]
fn edges_that_vanish_beside_what_they_add_to_still_make_a_path() {
    // A long way, then points a billionth apart.
    let mut points = vec![[0.0, 0.0, 0.0], [1e3, 0.0, 0.0]];
    points.extend((1..40_u8).map(|i| [1e3, f32::from(i) * 1e-9, 0.0]));
    let edges: Vec<[u32; 2]> = (0..40).map(|i| [i, i + 1]).chain((2..40).map(|i| [i - 1, i + 1])).collect();
    let graph = Adjacency::from_edges(points.len(), &edges);
    let lengths = edge_lengths(&graph, &points);
    let network = Network::new(&graph, &lengths);
    for paths in [Paths::Rebuilt, Paths::Stored] {
        let pairs = ClosePairs::build(network, &vec![2e3; points.len()], paths);
        let mut path = Vec::new();
        let distance = pairs.path(&graph, &points, 40, 0, &mut path).unwrap();
        assert!((distance - 1e3).abs() < 0.01, "{distance}");
        assert_eq!((path[0], path[path.len() - 1]), (40, 0));
    }
}

#[test]
fn the_map_holds_every_pair_that_is_heard_and_no_other() {
    for cloud in small_clouds() {
        let network = Network::new(&cloud.graph, &cloud.lengths);
        for reach in [0.0, 3.0, 7.0] {
            let horizons: Vec<f32> = cloud.radii.iter().map(|r| reach * r).collect();
            let pairs = ClosePairs::build(network, &horizons, Paths::Rebuilt);
            let mut naive = vec![Vec::new(); cloud.points.len()];
            for j in 0..cloud.points.len() {
                for (i, &(_, d)) in relaxed(&cloud.graph, &cloud.points, j).iter().enumerate() {
                    if d <= horizons[j] {
                        naive[i].push((d.to_bits(), u32::try_from(j).unwrap()));
                    }
                }
            }
            for (i, list) in naive.iter_mut().enumerate() {
                list.sort_unstable();
                let found: Vec<(u32, u32)> =
                    pairs.of(i).iter().map(|close| (close.distance.to_bits(), close.point)).collect();
                assert_eq!(found, *list, "heard at {i} with {reach}");
            }
        }
    }
}

#[test]
fn stored_and_rebuilt_paths_are_the_same_and_shortest() {
    let shapes = [Cloud::of_form(torus(1.0, 0.4), 0.1, 0.2, 3), Cloud::of_form(torus(1.0, 0.4), 0.1, 0.0, 0)];
    for cloud in small_clouds().into_iter().chain(shapes) {
        let network = Network::new(&cloud.graph, &cloud.lengths);
        let horizons: Vec<f32> = cloud.radii.iter().map(|r| 3.0 * r).collect();
        let rebuilt = ClosePairs::build(network, &horizons, Paths::Rebuilt);
        let stored = ClosePairs::build(network, &horizons, Paths::Stored);
        assert_eq!(stored.paths(), Paths::Stored);
        let (mut a, mut b) = (Vec::new(), Vec::new());
        for i in (0..cloud.points.len()).step_by(3) {
            let id = u32::try_from(i).unwrap();
            for close in rebuilt.of(i) {
                let d = rebuilt.path(&cloud.graph, &cloud.points, id, close.point, &mut a).unwrap();
                assert_eq!(stored.path(&cloud.graph, &[], id, close.point, &mut b), Some(d));
                assert_eq!(a, b);
                assert_eq!((a[0], a[a.len() - 1]), (id, close.point));
                let long = a.windows(2).map(|two| {
                    clouds::distance(&cloud.points[two[0] as usize], &cloud.points[two[1] as usize])
                });
                let long: f64 = long.sum();
                assert!((long - f64::from(d)).abs() <= 1e-5 * long, "{long} along a path of {d}");
                assert_eq!(rebuilt.distance(id, close.point), Some(close.distance));
            }
        }
    }
}
