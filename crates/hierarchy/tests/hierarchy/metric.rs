//! Discs that are fitted again follow from the given f, as those of a build do.
use nearmiss_geometry::PointCloud;
use nearmiss_hierarchy::{BuildOptions, GatherScratch, PointHierarchy, PointKind};
use nearmiss_surface::{Evaluation, Metric, Status};
use nearmiss_testdata::arbitrary::{self, CloudKind};
use nearmiss_testdata::scanner::{self, Frame};

fn prepared(points: &[[f64; 3]]) -> PointHierarchy {
    PointHierarchy::build(&PointCloud::from_positions(points).unwrap(), &BuildOptions::default()).unwrap()
}

fn clouds() -> Vec<Vec<[f64; 3]>> {
    let mut clouds: Vec<Vec<[f64; 3]>> =
        CloudKind::ALL.iter().map(|&kind| arbitrary::cloud(kind, 1500, 3)).collect();
    clouds.push(scanner::frame(&Frame { beams: 16, steps: 300, noise: 0.005, seed: 2 }));
    clouds
}

/// Returns f by straight distances, and adds all points that support it to `supporting`.
fn straight(
    scan: &PointHierarchy,
    i: u32,
    scratch: &mut GatherScratch,
    supporting: &mut Vec<u32>,
) -> Evaluation {
    let p = scan.positions()[i as usize];
    for (j, (q, &radius)) in (0..).zip(scan.positions().iter().zip(scan.radii())) {
        let d_sq: f64 = (0..3).map(|k| (f64::from(q[k]) - f64::from(p[k])).powi(2)).sum();
        if d_sq < f64::from(scan.plan().support_radius(radius)).powi(2) {
            supporting.push(j);
        }
    }
    scan.evaluate_near(i as usize, p.map(f64::from), scratch)
}

/// A fit by the Euclidean metric must equal the build, which does the same with other loops.
#[test]
fn a_fit_by_straight_distances_changes_nothing() {
    for points in clouds() {
        let scan = prepared(&points);
        let mut again = scan.clone();
        again.use_metric(Metric::Euclidean, |i, scratch, supporting| straight(&scan, i, scratch, supporting));
        assert_eq!(again.sanity_check(), Ok(()), "an invariant");
        assert_eq!(again.meta(), scan.meta(), "metadata");
        // Planes are fitted before the last tree is built, so sums have another order.
        let mut differ = 0;
        let near = |a: f32, b: f32| (a - b).abs() <= 1e-5 * a.abs().max(1.0);
        for i in 0..scan.len() {
            if again.kind(i) != scan.kind(i) {
                differ += 1;
                continue;
            }
            let [n, m] = [&again, &scan].map(|scan| scan.normals()[i]);
            let same = (0..3).all(|k| (n[k] - m[k]).abs() < 1e-4);
            assert!(!same || near(again.discs().get(i), scan.discs().get(i)), "the disc of point {i}");
            differ += usize::from(!same);
        }
        // A vote uses the nearest neighbours, and takes the normal of the nearest one on a sheet;
        // ties can be broken either way.
        assert!(20 * differ <= scan.len(), "{differ} points");
        if differ > 0 {
            continue;
        }
        let boxes = [&again, &scan].map(|scan| scan.boxes().collect::<Vec<_>>());
        for id in 0..scan.topology().len() {
            let [e, f] = [&again, &scan].map(|scan| scan.arrays().enclosure(id));
            let [b, c] = [boxes[0][id], boxes[1][id]];
            for k in 0..3 {
                let same =
                    near(b.half[k], c.half[k]) && (e.half[k] - f.half[k]).abs() < 0.01 * f.half[k].max(0.1);
                assert!(same && near(b.centre[k], c.centre[k]), "node {id}: {b:?}, {c:?}");
            }
            let [new, old] = [&again, &scan].map(|scan| scan.arrays().sampling_radius_of(id));
            assert!((new - old).abs() < 1e-3 * old, "the sampling radius of node {id}");
        }
    }
}

#[test]
fn what_a_fit_says_is_kept() {
    let mut scan = prepared(&arbitrary::cloud(CloudKind::Sphere, 700, 5));
    let old = scan.clone();
    // Oriented, but against the leaves' main axes.
    let inwards: Vec<[f32; 3]> = (old.positions().iter().zip(old.normals()))
        .map(|(p, n)| if (0..3).map(|k| p[k] * n[k]).sum::<f32>() > 0.0 { n.map(|c| -c) } else { *n })
        .collect();
    scan.turn_normals(&inwards);
    let statuses = [Status::Ok, Status::Border, Status::Ambiguous, Status::Outside];
    let [upright, tilted] = [[0.0, 0.0, 1.0], [0.6, 0.0, 0.8]];
    let oriented = scan.clone();
    scan.use_metric(Metric::Geodesic, |i, _: &mut (), supporting| {
        // Points that only support themselves are at a border.
        supporting.push(i);
        Evaluation {
            f: 0.0,
            normal: if i % 3 == 0 { tilted } else { upright },
            centroid: [0.0; 3],
            support: 9,
            bandwidth: 1.0,
            eigenvalues: [0.0, 1.0, 1.0],
            status: statuses[i as usize % 4],
        }
    });
    assert_eq!(scan.sanity_check(), Ok(()), "boxes hold the new discs");
    assert_eq!((old.metric(), scan.metric()), (Metric::Euclidean, Metric::Geodesic), "said");
    let kinds = [PointKind::Sheet, PointKind::Edge, PointKind::Noisy, PointKind::Stray];
    let mut kept = 0;
    for i in 0..scan.len() {
        if scan.kind(i) != kinds[i % 4] {
            // The neighbours' vote: noisy points join a sheet, and sheet points without others
            // around are noisy.
            let voted = if i % 4 == 2 { PointKind::Sheet } else { PointKind::Noisy };
            assert!(i % 4 < 3 && scan.kind(i) == voted, "point {i}");
            continue;
        }
        kept += 1;
        let (n, was) = (scan.normals()[i], oriented.normals()[i]);
        let up = if i % 3 == 0 { tilted } else { upright };
        let along: f64 = (0..3).map(|k| f64::from(n[k]) * up[k]).sum();
        assert!(along.abs() > 1.0 - 1e-6, "the normal of point {i}: {n:?}");
        assert!((0..3).map(|k| n[k] * was[k]).sum::<f32>() >= 0.0, "point {i} has changed sides");
        let share = scan.discs().get(i) / scan.radii()[i];
        assert!((share - 0.35).abs() < 1e-6, "the disc of point {i}, {share} radii, is none of a border");
    }
    assert!(kept > 500, "{kept} of 700");
}
