//! Points in balls against brute force, and parts of scans.

use nearmiss_geometry::PointCloud;
use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
use nearmiss_surface::{Bandwidth, SurfaceOptions};
use nearmiss_testdata::arbitrary::{self, CloudKind};
use rand::RngExt;

fn prepared(kind: CloudKind, n: u32, seed: u64, options: &BuildOptions) -> PointHierarchy {
    let points = arbitrary::cloud(kind, n, seed);
    PointHierarchy::build(&PointCloud::from_positions(&points).unwrap(), options).unwrap()
}

#[test]
fn points_in_a_ball_are_those_of_brute_force() {
    let mut rng = arbitrary::rng(5);
    let mut found = 0;
    for (seed, kind) in
        (0..).zip([CloudKind::Sphere, CloudKind::Random, CloudKind::Lattice, CloudKind::Coplanar])
    {
        let scan = prepared(kind, 700, seed, &BuildOptions::default());
        for round in 0..200 {
            let centre = scan.positions()[rng.random_range(0..scan.len())].map(f64::from);
            let size = f64::from(scan.root_box().radius());
            let radius = [0.0, 0.01, 0.2, 3.0][round % 4] * size;
            let square = |p: [f32; 3]| (0..3).map(|k| (f64::from(p[k]) - centre[k]).powi(2)).sum::<f64>();
            let expected: Vec<u32> = (0..)
                .zip(scan.positions())
                .filter(|(_, p)| square(**p) <= radius * radius)
                .map(|(i, _)| i)
                .collect();
            assert!(!expected.is_empty(), "the centre itself");
            assert_eq!(scan.points_in_ball(centre, radius, 700).unwrap(), expected, "{kind:?} {radius}");
            assert_eq!(scan.points_in_ball(centre, radius, expected.len()).unwrap(), expected);
            assert_eq!(scan.points_in_ball(centre, radius, expected.len() - 1), None, "too many");
            found += expected.len();
        }
    }
    assert!(found > 100_000, "{found}");
}

#[test]
fn a_part_equals_the_scan_away_from_its_border() {
    let global = SurfaceOptions::default().with_bandwidth(Bandwidth::Global);
    for options in [BuildOptions::default(), BuildOptions::default().with_surface(global).with_leaf_size(8)] {
        let scan = prepared(CloudKind::Sphere, 3000, 2, &options);
        let centre = scan.positions()[1234].map(f64::from);
        let radius = 12.0 * scan.sampling_radius() / scan.frame().scale;
        let points = scan.points_in_ball(centre, radius, scan.len()).unwrap();
        let part = scan.part(&points).unwrap();
        assert!(part.len() == points.len() && part.len() < scan.len() / 2, "{}", part.len());
        assert_eq!((part.frame(), part.leaf_size()), (scan.frame(), scan.leaf_size()));
        assert_eq!(part.reach(), scan.reach());
        let mut compared = 0;
        for i in 0..part.len() {
            let whole = scan.source().iter().position(|&id| id == part.source()[i]).unwrap();
            assert_eq!(part.positions()[i], scan.positions()[whole]);
            let away =
                (0..3).map(|k| (f64::from(part.positions()[i][k]) - centre[k]).powi(2)).sum::<f64>().sqrt();
            if away < 0.5 * radius {
                assert_eq!(part.radii()[i], scan.radii()[whole]);
                assert_eq!(part.kind(i), scan.kind(whole));
                let [n, m] = [part.normals()[i], scan.normals()[whole]];
                let along: f32 = (0..3).map(|k| n[k] * m[k]).sum();
                assert!(along.abs() > 0.9999, "{n:?} {m:?}");
                compared += 1;
            }
        }
        assert!(compared > 50, "{compared}");
    }
    let scan = prepared(CloudKind::Random, 100, 3, &BuildOptions::default());
    assert!(scan.part(&[0, 1, 2, 3, 4, 5, 6]).is_none(), "seven points are no scan");
    assert_eq!(scan.part(&(0..8).collect::<Vec<_>>()).unwrap().len(), 8);
}
