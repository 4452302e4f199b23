//! Samples and coverings compared with their definitions.
use nearmiss_geometry::{NodeId, PointCloud};
use nearmiss_hierarchy::{BuildOptions, GatherScratch, OrientedBox, PointHierarchy};
use nearmiss_surface::{Status, project};
use nearmiss_testdata::arbitrary::{self, CloudKind};
use nearmiss_testdata::oracle::{Disc, Solid, covering_radius, to_nearest};

const OPTIONS: [(u32, u32); 4] = [(16, 16), (4, 32), (64, 8), (16, 24)];

/// Scans of all kinds of clouds, with several sizes of leaves and samples.
fn scans(points: u32) -> impl Iterator<Item = (CloudKind, PointHierarchy)> {
    let clouds = CloudKind::ALL.into_iter().zip(1_u64..).filter_map(move |(kind, seed)| {
        let cloud = PointCloud::from_positions(&arbitrary::cloud(kind, points, seed)).ok()?;
        Some((kind, cloud))
    });
    clouds.flat_map(|(kind, cloud)| {
        OPTIONS.map(|(leaf_size, samples)| {
            let options = BuildOptions::default().with_leaf_size(leaf_size).with_samples(samples);
            (kind, PointHierarchy::build(&cloud, &options).unwrap())
        })
    })
}

fn solid(b: &OrientedBox) -> Solid {
    Solid {
        centre: b.centre.map(f64::from),
        half: b.half.map(f64::from),
        axes: b.axes.map(|a| a.map(f64::from)),
    }
}

/// Returns the id of the node with an index.
fn id(node: usize) -> NodeId {
    NodeId(u32::try_from(node).unwrap())
}

/// Returns the samples of a node, in double precision.
fn centres(scan: &PointHierarchy, node: usize) -> Vec<[f64; 3]> {
    scan.arrays().samples(node).iter().map(|i| scan.positions()[i].map(f64::from)).collect()
}

/// Returns the enclosures of the leaves under a node.
fn leaves(scan: &PointHierarchy, node: usize) -> Vec<Solid> {
    let topology = scan.topology();
    let under = topology.leaves_under(id(node));
    under.map(|leaf| solid(&scan.arrays().enclosure(topology.leaf(leaf).index()))).collect()
}

#[test]
fn samples_are_distinct_points_of_their_node() {
    let mut lists = 0;
    for (kind, scan) in scans(600) {
        for node in scan.topology().ids() {
            let (id, points) = (node.index(), scan.topology().points(node));
            let samples: Vec<usize> = scan.arrays().samples(id).iter().collect();
            let most = scan.samples_a_node() as usize;
            let all = scan.topology().is_leaf(node) || points.len() <= most;
            assert_eq!(samples.len(), if all { points.len() } else { most }, "{kind:?}, node {id}");
            assert!(samples.is_sorted_by(|one, next| one < next), "{kind:?}, node {id}: {samples:?}");
            assert!(samples.iter().all(|i| points.contains(i)), "{kind:?}, node {id}: {samples:?}");
            lists += u32::from(!all);
        }
    }
    assert!(lists > 500, "{lists} lists");
}

/// Every position of status ok, zero of f or not, is in the coverings of all nodes above its
/// nearest point. Radii are no larger than those that cover the enclosures of leaves.
#[test]
fn coverings_contain_what_is_ok_and_are_no_larger_than_boxes_ask_for() {
    let (mut places, mut nodes, mut share) = (0, 0, 0.0);
    for (kind, scan) in scans(300) {
        let (mut scratch, mut random) = (GatherScratch::default(), arbitrary::rng(6));
        let mut x = [0.0; 3];
        for i in 0..4 * scan.len() {
            let i = i % scan.len();
            // Starts from the last position or from a point, so that some walks reach the rim.
            let reach = f64::from(scan.radii()[i]);
            let from = if i % 3 == 0 { scan.positions()[i].map(f64::from) } else { x };
            let away = arbitrary::point_in(&mut random, 1.2 * reach);
            x = [0, 1, 2].map(|k| from[k] + away[k]);
            if scan.evaluate_with(x, &mut scratch).status == Status::Ok {
                check_covered(kind, &scan, x);
                places += 1;
            }
        }
        for id in 0..scan.topology().len() {
            let [_, high] = covering_radius(&centres(&scan, id), &leaves(&scan, id), 1);
            let radius = f64::from(scan.arrays().covering_radius(id));
            assert!(radius <= 1.001 * high + 1e-18, "{kind:?}, node {id}: {radius}, but {high} suffice");
            assert!(radius >= f64::from(scan.arrays().sampling_radius_of(id)), "{kind:?}, node {id}");
            nodes += 1;
            share += radius / high;
        }
    }
    share /= f64::from(nodes);
    assert!(places > 10_000 && nodes > 2000 && share < 0.7, "{places} places, {nodes} nodes, {share}");
}

/// Asserts that `x` is in the balls of all nodes that contain its nearest point.
fn check_covered(kind: CloudKind, scan: &PointHierarchy, x: [f64; 3]) {
    let positions: Vec<[f64; 3]> = scan.positions().iter().map(|p| p.map(f64::from)).collect();
    let nearest = to_nearest(&positions, x);
    let p = (0..scan.len()).find(|&p| to_nearest(&positions[p..=p], x) <= nearest).unwrap();
    let topology = scan.topology();
    for id in topology.ids().filter(|&id| topology.points(id).contains(&p)).map(NodeId::index) {
        let beyond = to_nearest(&centres(scan, id), x) / f64::from(scan.arrays().covering_radius(id));
        assert!(beyond <= 1.0, "{kind:?}: {x:?} is {beyond} radii from node {id}");
    }
}

#[test]
fn surface_points_are_in_the_coverings_of_every_node_of_their_nearest_point() {
    let mut found = 0;
    for (kind, scan) in scans(400) {
        let (mut scratch, mut random) = (GatherScratch::default(), arbitrary::rng(5));
        for i in 0..scan.len() {
            let away = arbitrary::point_in(&mut random, 2.0 * f64::from(scan.radii()[i]));
            let start = [0, 1, 2].map(|k| f64::from(scan.positions()[i][k]) + away[k]);
            let foot = project(start, |x| scan.evaluate_with(x, &mut scratch));
            if !foot.converged {
                continue;
            }
            check_covered(kind, &scan, foot.point);
            found += 1;
        }
    }
    assert!(found > 5000, "{found} surface points");
}

/// Definition 4 as measured: each disc is in one ball, and the radius is no larger than discs with
/// their thickness, and balls, require.
#[test]
fn sampling_radii_equal_the_twin() {
    let (mut nodes, mut exact) = (0, 0);
    for (kind, scan) in scans(300) {
        // The least radius at which one ball contains the cylinder around a point.
        let radius_of = |i: usize, centres: &[[f64; 3]], across: f64, height: f64| {
            let [p, n] = [scan.positions()[i], scan.normals()[i]].map(|v| v.map(f64::from));
            let rims = [height, -height].map(|h| Disc {
                centre: [0, 1, 2].map(|k| p[k] + h * n[k]),
                normal: n,
                radius: across,
            });
            let far = centres.iter().map(|c| rims[0].furthest(*c).max(rims[1].furthest(*c)));
            far.fold(f64::INFINITY, f64::min)
        };
        for id in 0..scan.topology().len() {
            let centres = centres(&scan, id);
            let found = f64::from(scan.arrays().sampling_radius_of(id));
            let (mut low, mut high) = (0.0_f64, 0.0_f64);
            for i in scan.topology().points(self::id(id)) {
                let arrays = scan.arrays();
                let ball = f64::from(arrays.ball(i).max(arrays.obstacle_ball(i)));
                let disc = f64::from(scan.discs().get(i));
                let about = to_nearest(&centres, scan.positions()[i].map(f64::from)) + ball;
                low = low.max(radius_of(i, &centres, disc, 0.0)).max(about);
                high = high.max(radius_of(i, &centres, (1.05 * disc).max(ball), (0.05 * disc).max(ball)));
            }
            assert!(
                low <= found && found <= 1.003 * high,
                "{kind:?}, node {id}: {found}, not {low} to {high}"
            );
            exact += u32::from(found >= high);
            nodes += 1;
        }
    }
    assert!(nodes > 2000 && 10 * exact > 8 * nodes, "{exact} of {nodes} nodes");
}
