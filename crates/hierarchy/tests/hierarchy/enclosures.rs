//! Enclosures compared with the surface itself. Zeros of f are found by projection; positions of
//! status ok are moved outwards as long as they stay ok. Each must be in the enclosures of all
//! nodes that contain its nearest point.
use nearmiss_geometry::PointCloud;
use nearmiss_hierarchy::{BuildOptions, GatherScratch, OrientedBox, PointHierarchy};
use nearmiss_surface::{Bandwidth, Kernel, Status, SurfaceOptions, project};
use nearmiss_testdata::arbitrary::{self, CloudKind};

/// Returns the distance by which `x` is outside the box, in double precision.
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

/// Asserts that `x` is in the enclosures of all nodes that contain its nearest point.
fn check_enclosed(scan: &PointHierarchy, enclosures: &[OrientedBox], x: [f64; 3]) {
    let p = nearest(scan, x);
    for id in scan.topology().ids() {
        if scan.topology().points(id).contains(&p) {
            let beyond = outside(&enclosures[id.index()], x);
            assert!(beyond <= 0.0, "{x:?} is {beyond} outside node {id:?}, near point {p}");
        }
    }
}

/// Starts at `count` positions near points of `scan`, and takes steps that lead further out of the
/// leaf's enclosure while the status stays ok. Returns the number of starts with status ok.
fn driven_outwards(scan: &PointHierarchy, count: usize, seed: u64) -> usize {
    let mut scratch = GatherScratch::default();
    let mut random = arbitrary::rng(seed);
    let enclosures: Vec<OrientedBox> = scan.enclosures().collect();
    let leaf_of = |p: usize| scan.topology().leaf_of(p).index();
    let mut starts = 0;
    for i in 0..count {
        let i = i % scan.len();
        let r = f64::from(scan.radii()[i]);
        let step = |from: [f64; 3], by: f64, random: &mut _| {
            let d = arbitrary::point_in(random, by);
            [0, 1, 2].map(|k| from[k] + d[k])
        };
        let mut x = step(scan.positions()[i].map(f64::from), 1.2 * r, &mut random);
        if scan.evaluate_with(x, &mut scratch).status != Status::Ok {
            continue;
        }
        starts += 1;
        let mut fill = outside(&enclosures[leaf_of(nearest(scan, x))], x);
        for round in 0..40 {
            let to = step(x, r * 0.8_f64.powi(round), &mut random);
            if scan.evaluate_with(to, &mut scratch).status == Status::Ok {
                let reached = outside(&enclosures[leaf_of(nearest(scan, to))], to);
                if reached > fill {
                    (x, fill) = (to, reached);
                }
            }
        }
        check_enclosed(scan, &enclosures, x);
    }
    starts
}

/// Returns a grid with a hole in the plane across the given axis; its borders are along the other
/// axes.
fn flat_grid(axis: usize, n: i32) -> Vec<[f64; 3]> {
    let mut points = Vec::new();
    for i in 0..2 * n {
        for j in 0..n {
            if (i - n).abs() + (j - n / 2).abs() > n / 4 {
                let mut p = [0.0; 3];
                p[(axis + 1) % 3] = f64::from(i);
                p[(axis + 2) % 3] = f64::from(j);
                points.push(p);
            }
        }
    }
    points
}

#[test]
fn all_that_is_ok_is_enclosed() {
    let options = [
        SurfaceOptions::default(),
        SurfaceOptions::default().with_kernel(Kernel::Wendland).with_support_radius(4.0),
        SurfaceOptions::default().with_bandwidth(Bandwidth::Global).with_support_min(3),
        SurfaceOptions::default().with_support_radius(2.0).with_threshold(0.1).with_support_min(3),
    ];
    let grids = [0, 1, 2].map(|axis| flat_grid(axis, 8));
    let clouds = CloudKind::ALL.map(|kind| arbitrary::cloud(kind, 250, 6));
    let mut starts = 0;
    for points in grids.iter().chain(&clouds) {
        let Ok(cloud) = PointCloud::from_positions(points) else { continue };
        for (n, surface) in (0_u64..).zip(options) {
            let options = BuildOptions::default().with_surface(surface).with_leaf_size(8);
            let scan = PointHierarchy::build(&cloud, &options).unwrap();
            starts += driven_outwards(&scan, 250, n);
        }
    }
    assert!(starts > 3000, "{starts} starts");
}

/// Projects `count` positions near points of `scan`, and asserts that the surface points found are
/// enclosed. Returns their number.
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
        check_enclosed(scan, &enclosures, foot.point);
    }
    found
}

#[test]
fn surface_points_are_in_every_enclosure_of_their_nearest_point() {
    let options = [
        SurfaceOptions::default(),
        SurfaceOptions::default().with_kernel(Kernel::Wendland),
        SurfaceOptions::default().with_bandwidth(Bandwidth::Global),
        SurfaceOptions::default().with_support_radius(5.0).with_threshold(1e-2),
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
    for (inner, outer) in scan.boxes().zip(scan.enclosures()) {
        for k in 0..3 {
            let shift: f32 = (0..3).map(|i| outer.axes[k][i] * (inner.centre[i] - outer.centre[i])).sum();
            assert!(shift.abs() + inner.half[k] <= outer.half[k] * (1.0 + 1e-6));
        }
    }
}
