//! Compares shortest paths and the map of close pairs with relaxing every edge until nothing
//! changes.
use crate::clouds::{Cloud, single};
use nearmiss_graph::{Adjacency, ClosePairs, GeodesicScratch, Network, Paths, edge_lengths};
use nearmiss_testdata::arbitrary::{CloudKind, cloud};
use nearmiss_testdata::shapes::torus;

/// The algorithm of Bellman and Ford, in double precision and with the documented sums of the
/// library.
fn relaxed(graph: &Adjacency, points: &[[f32; 3]], source: usize) -> Vec<(f64, f32)> {
    let mut known = vec![(f64::INFINITY, f32::INFINITY); points.len()];
    known[source] = (0.0, 0.0);
    loop {
        let before = known.clone();
        for i in 0..points.len() {
            for &j in graph.of(i) {
                let (p, q) = (points[i], points[j as usize]);
                let exact = known[i].0 + crate::clouds::distance(&p, &q);
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
            crate::clouds::distance(&cloud.points[two[0] as usize], &cloud.points[two[1] as usize])
        });
        let long: f64 = long.sum();
        assert!((long - f64::from(distance)).abs() < 1e-5, "{long} along a path of {distance}");
    }
    // Points 2 and 3 are not connected to points 0 and 1.
    let graph = Adjacency::from_edges(4, &[[0, 1], [2, 3]]);
    let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0]];
    let lengths = edge_lengths(&graph, &points);
    let network = Network::new(&graph, &lengths);
    assert_eq!(scratch.path(network, 0, 3, &mut path), None);
    assert!(path.is_empty());
    assert_eq!(scratch.distance(network, 2, 3), Some(1.0));
}

/// The paths in other maps have at most some hundred edges; these have thousands.
#[test]
fn edges_that_vanish_beside_what_they_add_to_still_make_a_path() {
    // A long edge, then points a billionth apart.
    for n in [40_u16, 4000] {
        let mut points = vec![[0.0, 0.0, 0.0], [1e3, 0.0, 0.0]];
        points.extend((1..n).map(|i| [1e3, f32::from(i) * 1e-9, 0.0]));
        let n = u32::from(n);
        let edges: Vec<[u32; 2]> = (0..n).map(|i| [i, i + 1]).collect();
        let graph = Adjacency::from_edges(points.len(), &edges);
        let lengths = edge_lengths(&graph, &points);
        let network = Network::new(&graph, &lengths);
        let mut support_radii = vec![0.0; points.len()];
        (support_radii[0], support_radii[n as usize]) = (2e3, 2e3);
        let mut path = Vec::new();
        for paths in [Paths::Rebuilt, Paths::Stored] {
            let pairs = ClosePairs::build(network, &support_radii, paths);
            for ends in [[n, 0], [0, n]] {
                let length = pairs.path(network, ends, &mut GeodesicScratch::default(), &mut path).unwrap();
                assert!((length - 1e3).abs() < 0.5, "{length}");
                assert_eq!([path[0], path[path.len() - 1]], ends);
                assert_eq!(path.len(), points.len());
            }
        }
    }
}

/// Relative rounding error of distances, and a little for sums.
const ROUNDED: f64 = 6.2e-5;

fn is_near(distance: f32, exact: f64, share: f64) -> bool {
    (f64::from(distance) - exact).abs() <= share * exact
}

#[test]
fn the_map_holds_every_pair_within_a_support_radius_and_no_other() {
    for cloud in small_clouds() {
        let network = Network::new(&cloud.graph, &cloud.lengths);
        for reach in [0.0, 3.0, 7.0] {
            let support_radii: Vec<f32> = cloud.radii.iter().map(|r| reach * r).collect();
            let pairs = ClosePairs::build(network, &support_radii, Paths::Rebuilt);
            let mut naive = vec![Vec::new(); cloud.points.len()];
            for j in 0..cloud.points.len() {
                for (i, &(_, d)) in relaxed(&cloud.graph, &cloud.points, j).iter().enumerate() {
                    if d <= support_radii[j] {
                        naive[i].push((d.to_bits(), u32::try_from(j).unwrap()));
                    }
                }
            }
            for (i, list) in naive.iter_mut().enumerate() {
                list.sort_unstable();
                let found = pairs.of(i);
                assert_eq!(found.len(), list.len(), "list of {i} with {reach}");
                assert!(found.clone().is_sorted_by(|a, b| a.distance <= b.distance), "at {i}");
                for (close, &(bits, point)) in found.zip(&*list) {
                    let exact = f32::from_bits(bits);
                    assert_eq!(close.point, point, "list of {i} with {reach}");
                    assert!(is_near(close.distance, exact.into(), ROUNDED), "{close:?} for {exact}");
                    let id = u32::try_from(i).unwrap();
                    assert_eq!(pairs.distance(id, point), Some(close.distance));
                }
                let deaf = (0..).find(|&j| list.iter().all(|&(_, point)| point != j)).unwrap();
                assert_eq!(pairs.distance(u32::try_from(i).unwrap(), deaf), None);
            }
        }
    }
}

/// Points along a line with gaps of all sizes, in an order that separates all neighbours.
#[test]
fn what_four_bytes_do_not_hold_is_as_right() {
    const COUNT: u32 = 70_001;
    let name = |k: u32| u64::from(k) * 35_017 % u64::from(COUNT);
    let gap = |k: u32| 10_f64.powi(i32::try_from(k % 7).unwrap() - 6);
    let ends = (0..COUNT).scan(0.0, |end, k| Some(std::mem::replace(end, *end + gap(k))));
    let along: Vec<f64> = ends.collect();
    let id = |k: u32| u32::try_from(name(k)).unwrap();
    let edges: Vec<[u32; 2]> = (1..COUNT).map(|k| [id(k - 1), id(k)]).collect();
    let graph = Adjacency::from_edges(COUNT as usize, &edges);
    // Lengths come from the gaps, because positions would round them away.
    let mut place = vec![0; COUNT as usize];
    for k in 0..COUNT {
        place[id(k) as usize] = k;
    }
    #[expect(clippy::cast_possible_truncation, reason = "lengths are single precision")]
    let lengths: Vec<f32> = (0..COUNT as usize)
        .flat_map(|i| graph.of(i).iter().map(move |&j| [i, j as usize]))
        .map(|[i, j]| gap(place[i].min(place[j])) as f32)
        .collect();
    let network = Network::new(&graph, &lengths);
    let support_radii = vec![1.5; COUNT as usize];
    let pairs = ClosePairs::build(network, &support_radii, Paths::Rebuilt);
    let stored = ClosePairs::build(network, &support_radii, Paths::Stored);
    assert!(pairs.byte_len() > 9 * pairs.pair_count(), "half of them stand beside");
    let (mut scratch, mut path) = (GeodesicScratch::default(), Vec::new());
    let mut counted = 0;
    for k in 0..COUNT {
        let i = id(k);
        let list = pairs.of(i as usize);
        counted += list.len();
        for (rank, close) in list.enumerate() {
            let exact = (along[k as usize] - along[place[close.point as usize] as usize]).abs();
            assert!(is_near(close.distance, exact, ROUNDED + 1e-5), "{close:?} for {exact}");
            if k % 97 == 0 {
                assert_eq!(pairs.distance(i, close.point), Some(close.distance));
                for map in [&pairs, &stored] {
                    let length = map.path(network, [i, close.point], &mut scratch, &mut path).unwrap();
                    assert!(is_near(length, exact, 1e-5), "{length} for {exact}");
                    assert_eq!(path.len(), 1 + place[close.point as usize].abs_diff(k) as usize, "{rank}");
                }
            }
        }
    }
    assert_eq!(counted, pairs.pair_count());
}

#[test]
fn stored_and_rebuilt_paths_are_shortest() {
    let shapes = [Cloud::of_form(torus(1.0, 0.4), 0.1, 0.2, 3), Cloud::of_form(torus(1.0, 0.4), 0.1, 0.0, 0)];
    for cloud in small_clouds().into_iter().chain(shapes) {
        let network = Network::new(&cloud.graph, &cloud.lengths);
        let support_radii: Vec<f32> = cloud.radii.iter().map(|r| 3.0 * r).collect();
        let rebuilt = ClosePairs::build(network, &support_radii, Paths::Rebuilt);
        let stored = ClosePairs::build(network, &support_radii, Paths::Stored);
        assert_eq!([rebuilt.paths(), stored.paths()], [Paths::Rebuilt, Paths::Stored]);
        let (mut scratch, mut search, mut path) =
            (GeodesicScratch::default(), GeodesicScratch::default(), Vec::new());
        for i in (0..cloud.points.len()).step_by(3) {
            let id = u32::try_from(i).unwrap();
            let mut shortest = vec![f32::INFINITY; cloud.points.len()];
            for found in search.within(network, id, f32::MAX) {
                shortest[found.point as usize] = found.distance;
            }
            for close in rebuilt.of(i) {
                let exact = f64::from(shortest[close.point as usize]);
                assert!(is_near(close.distance, exact, ROUNDED), "{close:?} for {exact}");
                for (map, longer) in [(&rebuilt, 1e-4), (&stored, 0.0)] {
                    let length = map.path(network, [id, close.point], &mut scratch, &mut path).unwrap();
                    assert_eq!([path[0], path[path.len() - 1]], [id, close.point]);
                    let edges = path.windows(2).map(|two| {
                        assert!(cloud.graph.of(two[0] as usize).contains(&two[1]), "{two:?} is no edge");
                        crate::clouds::distance(
                            &cloud.points[two[0] as usize],
                            &cloud.points[two[1] as usize],
                        )
                    });
                    let along: f64 = edges.sum();
                    assert!(is_near(length, along, 1e-5), "{along} along a path of {length}");
                    let over = f64::from(length) - exact;
                    assert!(over <= (longer + 2e-6) * exact, "{length} where {exact} is shortest");
                    assert!(over >= -2e-6 * exact, "{length} below {exact}");
                }
            }
        }
    }
}

/// Layers of points. Each point is joined to all of the next layer, by edges whose lengths differ
/// by less than the rounding of distances.
#[test]
fn paths_are_short_where_rounding_hides_which_way_is() {
    const WIDTH: u32 = 6;
    const LAYERS: u32 = 14;
    let count = WIDTH * LAYERS;
    let next = |i: u32| (i / WIDTH + 1) * WIDTH..((i / WIDTH + 2) * WIDTH).min(count);
    let edges: Vec<[u32; 2]> = (0..count).flat_map(|i| next(i).map(move |j| [i, j])).collect();
    let graph = Adjacency::from_edges(count as usize, &edges);
    let mut longer = 0;
    for seed in 0..8 {
        let length = |i: u32, j: u32| {
            let mixed = (i.min(j) * 1009 + i.max(j) * 131 + seed * 7).wrapping_mul(2_654_435_761) >> 8;
            #[expect(clippy::cast_precision_loss, reason = "24 bits")]
            let unit = mixed as f32 / 16_777_216.0;
            1.0 + 6e-4 * unit
        };
        let lengths: Vec<f32> =
            (0..count).flat_map(|i| graph.of(i as usize).iter().map(move |&j| length(i, j))).collect();
        let network = Network::new(&graph, &lengths);
        let pairs = ClosePairs::build(network, &vec![100.0; count as usize], Paths::Rebuilt);
        let (mut scratch, mut path) = (GeodesicScratch::default(), Vec::new());
        for [i, j] in (0..count).flat_map(|i| (0..count).map(move |j| [i, j])) {
            let exact = scratch.distance(network, i, j).unwrap();
            let found = pairs.path(network, [i, j], &mut scratch, &mut path).unwrap();
            assert!(found >= exact * (1.0 - 2e-6), "{found} below {exact}");
            assert!(found <= exact * (1.0 + 1.02e-4), "{found} where {exact} is shortest");
            longer += u32::from(found > exact * (1.0 + 2e-6));
        }
    }
    assert!(longer > 0, "some are not shortest");
}
