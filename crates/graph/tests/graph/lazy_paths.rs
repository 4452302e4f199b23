//! Lazy paths: complete paths are compared with the graph, and looks with complete paths.
use crate::clouds::Cloud;
use nearmiss_graph::{GeodesicScratch, LazyPath, Levels, Network, PathPoint};
use nearmiss_testdata::arbitrary::{CloudKind, cloud, rng};
use nearmiss_testdata::shapes::torus;
use rand::RngExt;

fn single(points: Vec<[f64; 3]>) -> Vec<[f32; 3]> {
    crate::clouds::single(&points)
}

/// Checks the ends, and that every step is an edge of the stated length.
fn check(network: Network<'_>, path: &[PathPoint], [a, b]: [u32; 2]) {
    assert_eq!([path[0].point, path[path.len() - 1].point], [a, b], "its ends");
    assert!(path[0].along.abs() < 1e-12, "{:?} is no beginning", path[0]);
    let whole = path[path.len() - 1].along;
    for two in path.windows(2) {
        let edge = network.edges(two[0].point as usize).find(|edge| edge.0 == two[1].point);
        let length = f64::from(edge.unwrap_or_else(|| panic!("{two:?} is no edge")).1);
        let found = two[1].along - two[0].along;
        assert!((found - length).abs() <= 1e-5 * whole, "{found} along an edge of {length}");
    }
}

#[test]
fn a_path_is_one_of_the_graph_and_a_look_finds_its_points() {
    let clouds = [
        Cloud::of_form(torus(1.0, 0.4), 0.04, 0.1, 3),
        Cloud::new(single(cloud(CloudKind::Sphere, 2000, 5))),
        Cloud::new(single(cloud(CloudKind::Clustered, 3000, 5))),
    ];
    let (mut random, mut scratch) = (rng(7), GeodesicScratch::default());
    let (mut lazy, mut twin) = (LazyPath::default(), LazyPath::default());
    let (mut longest, mut led, mut sum) = (0.0_f64, 0, 0.0);
    for cloud in clouds {
        let network = Network::new(&cloud.graph, &cloud.lengths);
        let levels = Levels::build(network, &cloud.radii);
        let n = u32::try_from(network.len()).unwrap();
        for _ in 0..200 {
            let ends = [random.random_range(0..n), random.random_range(0..n)];
            let shortest = scratch.distance(network, ends[0], ends[1]);
            assert_eq!(lazy.lead(&levels, network, &cloud.points, ends), shortest.is_some(), "{ends:?}");
            let Some(shortest) = shortest else {
                assert!(lazy.is_empty());
                continue;
            };
            led += 1;
            assert!(twin.lead(&levels, network, &cloud.points, ends));
            let whole: Vec<PathPoint> = twin.all(&levels).collect();
            check(network, &whole, ends);
            if shortest > 0.0 {
                sum += whole[whole.len() - 1].along / f64::from(shortest);
                longest = longest.max(whole[whole.len() - 1].along / f64::from(shortest));
            }
            // Looks at random positions return the nearer end of the edge there, and do not change
            // the path.
            for _ in 0..8 {
                let along = random.random_range(-0.1..=1.1) * whole[whole.len() - 1].along;
                let right = lazy.len() - 1;
                let found = lazy.look(&levels, 0, right, along);
                let inner = &whole[1..whole.len().max(2) - 1];
                let nearest = inner.iter().map(|p| (p.along - along).abs()).fold(f64::INFINITY, f64::min);
                match found {
                    None => assert!(inner.is_empty(), "{} points were not found", inner.len()),
                    Some(k) => {
                        let off = (lazy.point(k).along - along).abs();
                        assert!(off <= nearest + 1e-5 * along.abs().max(1.0), "{off} for {nearest}");
                    }
                }
            }
            let again: Vec<u32> = lazy.all(&levels).map(|p| p.point).collect();
            assert_eq!(again, whole.iter().map(|p| p.point).collect::<Vec<u32>>());
        }
    }
    // The paths are not shortest, but not much longer either.
    let mean = sum / f64::from(led);
    assert!(
        led > 300 && longest < 12.0 && mean < 1.6,
        "{led} paths, {longest} and {mean} times as long as the shortest"
    );
}
