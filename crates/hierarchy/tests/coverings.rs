//! Samples and coverings against their definitions.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

use nearmiss_geometry::PointCloud;
use nearmiss_hierarchy::{BuildOptions, GatherScratch, OrientedBox, PointHierarchy};
use nearmiss_surface::project;
use nearmiss_testdata::arbitrary::{self, CloudKind};
use nearmiss_testdata::oracle::{Disc, Solid, covering_radius, to_nearest};

const OPTIONS: [(u32, u32); 4] = [(16, 16), (4, 32), (64, 8), (16, 24)];

/// The scans of all kinds of clouds, with several sizes of leaves and samples.
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

/// The samples of a node, in double precision.
fn centres(scan: &PointHierarchy, node: usize) -> Vec<[f64; 3]> {
    scan.slices().samples(node).iter().map(|i| scan.positions()[i].map(f64::from)).collect()
}

/// The enclosures of the leaves under a node.
fn leaves(scan: &PointHierarchy, node: usize) -> Vec<Solid> {
    let range = scan.nodes()[node].points();
    let all = scan.nodes().iter().enumerate();
    let under = all.filter(|(_, leaf)| leaf.is_leaf() && range.contains(&(leaf.first as usize)));
    under.map(|(id, _)| solid(&scan.slices().enclosure(id))).collect()
}

#[test]
fn samples_are_distinct_points_of_their_node() {
    let mut lists = 0;
    for (kind, scan) in scans(600) {
        for (id, node) in scan.nodes().iter().enumerate() {
            let samples: Vec<usize> = scan.slices().samples(id).iter().collect();
            let all = node.is_leaf() || node.count <= scan.samples_a_node();
            let expected = if all { node.count } else { scan.samples_a_node() };
            assert_eq!(samples.len(), expected as usize, "{kind:?}, node {id}");
            assert!(samples.is_sorted_by(|one, next| one < next), "{kind:?}, node {id}: {samples:?}");
            assert!(samples.iter().all(|i| node.points().contains(i)), "{kind:?}, node {id}: {samples:?}");
            lists += u32::from(!all);
        }
    }
    assert!(lists > 1000, "{lists} lists");
}

/// The certificate: no point of a leaf's enclosure is further from all samples than the radius; and the radius is not much
/// larger than that asks for.
#[test]
fn coverings_contain_the_enclosures_and_are_tight() {
    let (mut nodes, mut over) = (0, 0.0);
    for (kind, scan) in scans(300) {
        for id in 0..scan.nodes().len() {
            let [low, high] = covering_radius(&centres(&scan, id), &leaves(&scan, id), 6);
            let radius = f64::from(scan.slices().covering_radius(id));
            assert!(radius >= low * (1.0 - 1e-7), "{kind:?}, node {id}: {radius}, but {low} are needed");
            assert!(radius <= 1.06 * high + 1e-18, "{kind:?}, node {id}: {radius}, but {high} suffice");
            nodes += 1;
            over += radius / low;
        }
    }
    let mean = over / f64::from(nodes);
    assert!(nodes > 2000 && mean < 1.12, "{nodes} nodes, radii {mean} times what is needed at least");
}

#[test]
fn surface_points_are_in_the_coverings_of_every_node_of_their_nearest_point() {
    let mut found = 0;
    for (kind, scan) in scans(400) {
        let (mut scratch, mut random) = (GatherScratch::default(), arbitrary::rng(5));
        let positions: Vec<[f64; 3]> = scan.positions().iter().map(|p| p.map(f64::from)).collect();
        for i in 0..scan.len() {
            let away = arbitrary::point_in(&mut random, 2.0 * f64::from(scan.radii()[i]));
            let start = [0, 1, 2].map(|k| positions[i][k] + away[k]);
            let foot = project(start, |x| scan.evaluate_with(x, &mut scratch));
            if !foot.converged {
                continue;
            }
            let nearest = to_nearest(&positions, foot.point);
            let p = (0..scan.len()).find(|&p| to_nearest(&positions[p..=p], foot.point) <= nearest).unwrap();
            for (id, _) in scan.nodes().iter().enumerate().filter(|(_, node)| node.points().contains(&p)) {
                let beyond = to_nearest(&centres(&scan, id), foot.point)
                    / f64::from(scan.slices().covering_radius(id));
                assert!(beyond <= 1.0, "{kind:?}: {:?} is {beyond} radii from node {id}", foot.point);
            }
            found += 1;
        }
    }
    assert!(found > 5000, "{found} surface points");
}

/// Definition 4 as it is measured: on discs, moved to the foot points.
#[test]
fn sampling_radii_equal_the_twin() {
    let mut nodes = 0;
    for (kind, scan) in scans(300) {
        let discs = (0..scan.len()).map(|i| {
            let p = scan.positions()[i].map(f64::from);
            let at = scan.evaluate(p);
            let centre = [0, 1, 2].map(|k| p[k] + at.f * at.normal[k]);
            Disc { centre, normal: scan.normals()[i].map(f64::from), radius: f64::from(scan.discs()[i]) }
        });
        let discs: Vec<Disc> = discs.collect();
        for (id, node) in scan.nodes().iter().enumerate() {
            let centres = centres(&scan, id);
            let radii = discs[node.points()].iter().map(|disc| {
                let far = centres.iter().map(|c| disc.furthest(*c));
                far.fold(f64::INFINITY, f64::min)
            });
            let expected = radii.fold(0.0, f64::max).min(f64::from(scan.slices().covering_radius(id)));
            let found = f64::from(scan.slices().sampling_radius_of(id));
            // The way across is a root of a difference; foot points have the digits of single precision, far from
            // the origin too.
            let reach = centres.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
            let error = (found - expected).abs();
            assert!(error <= 5e-4 * expected + 2e-7 * reach, "{kind:?}, node {id}: {found}, not {expected}");
            nodes += 1;
        }
    }
    assert!(nodes > 2000, "{nodes} nodes");
}
