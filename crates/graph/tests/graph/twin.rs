//! Compares the graph with a search of all pairs of points.

use nearmiss_graph::{GraphOptions, PointGraph, Prune};
use nearmiss_testdata::arbitrary::{CloudKind, cloud};
use nearmiss_testdata::oracle::proximity;

type Point = [f32; 3];

/// The distinct points of a cloud, in arbitrary order.
#[expect(clippy::cast_possible_truncation, reason = "points are stored in single precision")]
fn points(kind: CloudKind, n: u32, seed: u64, scale: f64) -> Vec<Point> {
    let mut points: Vec<Point> =
        cloud(kind, n, seed).iter().map(|p| p.map(|x| (scale * x) as f32 + 0.0)).collect();
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])).then(a[2].total_cmp(&b[2])));
    points.dedup();
    points
}

fn compare(points: &[Point], options: &GraphOptions, what: &str) {
    let graph = PointGraph::build(points, options).expect(what);
    let k = if let Prune::Quartiles(k) = options.prune { Some(k) } else { None };
    let twin = proximity(points, options.neighbours as usize, k);
    #[expect(clippy::cast_possible_truncation, reason = "radii are stored in single precision")]
    let radii: Vec<f32> = twin.radii.iter().map(|&d| d as f32).collect();
    assert_eq!(graph.radii(), radii, "{what}: radii");
    assert!(graph.edges().edges().eq(twin.edges.iter().copied()), "{what}: edges");
    assert!(graph.virtual_edges().edges().eq(twin.virtual_edges.iter().copied()), "{what}: virtual edges");
    assert_eq!(graph.components(), twin.components, "{what}: components");
    let counts = graph.counts();
    assert_eq!(
        (counts.points, counts.edges, counts.virtual_edges),
        (points.len(), twin.edges.len(), twin.virtual_edges.len()),
        "{what}"
    );
    let roots = (0_u32..).zip(&twin.components).filter(|(i, label)| i == *label).count();
    assert_eq!(counts.components, roots, "{what}: components");
    for (i, &reach) in graph.reaches().iter().enumerate() {
        let length = |j: &u32| {
            let d = [0, 1, 2].map(|k| points[i][k] - points[*j as usize][k]);
            d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
        };
        let longest = graph.edges().of(i).iter().map(length).fold(0.0, f32::max).sqrt();
        assert!((reach - longest).abs() <= 1e-6 * longest, "{what}: reach of point {i}");
    }
}

#[test]
fn graphs_are_those_of_all_pairs() {
    let options = GraphOptions::default();
    for kind in CloudKind::ALL {
        for (n, seed) in [(1, 1), (2, 2), (5, 3), (17, 4), (600, 5)] {
            let points = points(kind, n, seed, 1.0);
            compare(&points, &options, &format!("{kind:?}, {n}"));
            compare(&points, &options.with_prune(Prune::Never), &format!("{kind:?}, {n}, unpruned"));
        }
        let points = points(kind, 300, 6, 1.0);
        for neighbours in [1, 3, 32] {
            compare(&points, &options.with_neighbours(neighbours), &format!("{kind:?}, r = {neighbours}"));
        }
    }
    for scale in [1e-15, 1e15] {
        compare(&points(CloudKind::Clustered, 300, 7, scale), &options, &format!("times {scale}"));
    }
    compare(&[], &options, "no points");
}

#[test]
fn a_lone_point_beside_a_dense_cluster_joins_its_nearest() {
    let mut points = points(CloudKind::OneVoxel, 900, 8, 1.0);
    points.push([100.0, 100.0, 105.0]);
    compare(&points, &GraphOptions::default(), "a lone point");
}
