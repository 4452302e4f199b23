//! Enclosures against the surface itself: zeros of f found by projection, each in the enclosure of every node that
//! holds its nearest point.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

use nearmiss_geometry::PointCloud;
use nearmiss_hierarchy::{BuildOptions, GatherScratch, OrientedBox, PointHierarchy};
use nearmiss_surface::{Bandwidth, Kernel, SurfaceOptions, project};
use nearmiss_testdata::arbitrary::{self, CloudKind};

/// How far `x` is outside the box, in double precision.
fn outside(bounds: &OrientedBox, x: [f64; 3]) -> f64 {
    let d = [0, 1, 2].map(|k| x[k] - f64::from(bounds.centre[k]));
    let along = |k: usize| (0..3).map(|i| f64::from(bounds.axes[k][i]) * d[i]).sum::<f64>();
    (0..3).map(|k| along(k).abs() - f64::from(bounds.half[k])).fold(f64::MIN, f64::max)
}

fn nearest(scan: &PointHierarchy, x: [f64; 3]) -> usize {
    let distance_sq = |p: &[f32; 3]| (0..3).map(|k| (f64::from(p[k]) - x[k]).powi(2)).sum::<f64>();
    let least = scan.positions().iter().map(distance_sq).enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
    least.unwrap().0
}

/// Projects `count` places near points of `scan`; how many surface points were found, all of them enclosed.
fn enclosed(scan: &PointHierarchy, count: usize, seed: u64) -> usize {
    let mut scratch = GatherScratch::default();
    let mut random = arbitrary::rng(seed);
    let enclosures: Vec<OrientedBox> = scan.enclosures().collect();
    let mut found = 0;
    for i in 0..count {
        let i = i % scan.len();
        let away = arbitrary::point_in(&mut random, 2.0 * f64::from(scan.radii()[i]));
        let start = [0, 1, 2].map(|k| f64::from(scan.positions()[i][k]) + away[k]);
        let foot = project(start, |x| scan.evaluate_with(x, &mut scratch));
        if !foot.converged {
            continue;
        }
        found += 1;
        let p = nearest(scan, foot.point);
        for (id, node) in scan.nodes().iter().enumerate() {
            if node.points().contains(&p) {
                let beyond = outside(&enclosures[id], foot.point);
                assert!(beyond <= 0.0, "{beyond} outside node {id}, near point {p}");
            }
        }
    }
    found
}

#[test]
fn surface_points_are_in_every_enclosure_of_their_nearest_point() {
    let options = [
        SurfaceOptions::default(),
        SurfaceOptions::default().with_kernel(Kernel::Wendland),
        SurfaceOptions::default().with_bandwidth(Bandwidth::Global),
        SurfaceOptions::default().with_horizon(5.0).with_threshold(1e-2),
    ];
    let mut found = 0;
    for kind in CloudKind::ALL {
        let points = arbitrary::cloud(kind, 400, 5);
        let Ok(cloud) = PointCloud::from_positions(&points) else { continue };
        for surface in options {
            let options = BuildOptions::default().with_surface(surface);
            let scan = PointHierarchy::build(&cloud, &options).unwrap();
            found += enclosed(&scan, 800, 7);
        }
    }
    assert!(found > 5000, "{found} surface points were found");
}

#[test]
fn an_enclosure_holds_the_box_of_its_node() {
    let cloud = PointCloud::from_positions(&arbitrary::cloud(CloudKind::Sphere, 2000, 1)).unwrap();
    let scan = PointHierarchy::build(&cloud, &BuildOptions::default()).unwrap();
    for (inner, outer) in scan.boxes().iter().zip(scan.enclosures()) {
        for k in 0..3 {
            let shift: f32 = (0..3).map(|i| outer.axes[k][i] * (inner.centre[i] - outer.centre[i])).sum();
            assert!(shift.abs() + inner.half[k] <= outer.half[k] * (1.0 + 1e-6));
        }
    }
}
