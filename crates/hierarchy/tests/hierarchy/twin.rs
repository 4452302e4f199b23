//! The hierarchy compared with naive implementations: radii, the implicit function everywhere, and
//! invariants.
use nearmiss_geometry::PointCloud;
use nearmiss_hierarchy::{BuildOptions, GatherScratch, PointHierarchy, PointKind};
use nearmiss_index::PointBlock;
use nearmiss_surface::{Bandwidth, Evaluation, Kernel, Level, Moments, Status, SurfaceOptions};
use nearmiss_testdata::arbitrary::{self, CloudKind};
use nearmiss_testdata::instructions::levels;
use nearmiss_testdata::oracle::{self, Parameters, SurfaceTwin};

const KINDS: [CloudKind; 14] = [
    CloudKind::Random,
    CloudKind::Clustered,
    CloudKind::Lattice,
    CloudKind::Rings,
    CloudKind::Collinear,
    CloudKind::Coplanar,
    CloudKind::OneVoxel,
    CloudKind::EqualX,
    CloudKind::FarClusters,
    CloudKind::Duplicates,
    CloudKind::Huge,
    CloudKind::Tiny,
    CloudKind::Outlier,
    CloudKind::Sphere,
];

fn prepared(points: &[[f64; 3]], options: &BuildOptions) -> PointHierarchy {
    PointHierarchy::build(&PointCloud::from_positions(points).unwrap(), options).unwrap()
}

fn stored(scan: &PointHierarchy) -> Vec<[f64; 3]> {
    scan.positions().iter().map(|p| p.map(f64::from)).collect()
}

#[test]
fn invariants_hold_for_every_kind_of_cloud_and_size() {
    for kind in KINDS {
        for n in [8, 9, 16, 17, 33, 100, 1000] {
            let points = arbitrary::cloud(kind, n, u64::from(n));
            let Ok(cloud) = PointCloud::from_positions(&points) else { continue };
            for leaf_size in [4, 16, 64] {
                let options = BuildOptions::default().with_leaf_size(leaf_size);
                let scan = PointHierarchy::build(&cloud, &options).unwrap();
                assert_eq!(scan.sanity_check(), Ok(()), "{kind:?}, {n} points, leaves of {leaf_size}");
                let mut source = scan.source().to_vec();
                source.sort_unstable();
                assert_eq!(source, cloud.source(), "{kind:?}: a permutation of the cloud");
            }
        }
    }
}

#[test]
fn radii_equal_the_twin() {
    for kind in KINDS {
        let scan = prepared(&arbitrary::cloud(kind, 700, 3), &BuildOptions::default());
        let expected = oracle::radii(&stored(&scan));
        let mut differ = 0;
        let reach = scan.reach() / scan.frame().scale;
        for (i, expected) in expected.iter().enumerate() {
            let (found, expected) = (f64::from(scan.radii()[i]), expected.min(reach));
            // A ring whose next ring is beyond the reach has the distance of its sixth neighbour.
            let is_line = scan.kind(i) == PointKind::Line && found < expected;
            differ += u32::from((found / expected - 1.0).abs() > 1e-5 && !is_line);
        }
        // Ties between equally near neighbours can be broken either way; this matters if they are
        // judged as a line.
        let most = if matches!(kind, CloudKind::Lattice | CloudKind::Rings) { 20 } else { 0 };
        assert!(differ <= most, "{kind:?}: {differ} of {} radii differ", expected.len());
    }
}

/// Returns `true` if no threshold is so near that rounding could decide the status.
fn is_clear(at: &oracle::Evaluation, x: [f64; 3]) -> bool {
    let [l1, l2, l3] = at.eigenvalues;
    let half = 0.5 * at.bandwidth.powi(2);
    let aside = (0..3).map(|k| (x[k] - at.centroid[k]).powi(2)).sum::<f64>().sqrt();
    let clear = |value: f64, threshold: f64| (value / threshold - 1.0).abs() > 1e-3;
    clear(aside / at.bandwidth, oracle::BORDER)
        && clear(l1 / half, oracle::THIN)
        && clear((l2 - l1) / (l1 + l2 + l3), oracle::GAP)
}

/// Compares f with the naive implementation at points near the stored ones. Returns the number of
/// points that are ok in both.
pub(crate) fn compare(scan: &PointHierarchy, parameters: Parameters, seed: u64) -> usize {
    let points = stored(scan);
    let radii: Vec<f64> = scan.radii().iter().map(|&r| f64::from(r)).collect();
    let twin = SurfaceTwin::with_radii(&points, &radii, parameters);
    let mut rng = arbitrary::rng(seed);
    let mut compared = 0;
    for i in (0..points.len()).step_by(points.len() / 200 + 1) {
        for reach in [0.0, 0.2, 1.0, 3.0, 6.0] {
            let offset = arbitrary::point_in(&mut rng, reach * radii[i]);
            let x = [0, 1, 2].map(|k| points[i][k] + offset[k]);
            let found = scan.evaluate(x);
            let Some(expected) = twin.evaluate(x) else {
                assert_eq!(found.status, Status::Outside, "nothing reaches {x:?}");
                continue;
            };
            // A point whose support radius ends here may be on either side.
            if found.support as usize != expected.support {
                assert!(
                    found.support.abs_diff(u32::try_from(expected.support).unwrap()) <= 2,
                    "support at {x:?}"
                );
                continue;
            }
            if is_clear(&expected, x) {
                let same = match expected.status {
                    oracle::Status::Outside => Status::Outside,
                    oracle::Status::Border => Status::Border,
                    oracle::Status::Ambiguous => Status::Ambiguous,
                    oracle::Status::Ok => Status::Ok,
                };
                assert_eq!(found.status, same, "status at {x:?}: {expected:?}");
            }
            let ok = expected.status == oracle::Status::Ok;
            let gap = expected.eigenvalues[1] - expected.eigenvalues[0];
            if ok && gap > 0.05 * expected.bandwidth.powi(2) {
                let error = (found.f.abs() - expected.value.abs()).abs() / expected.bandwidth;
                assert!(error < 1e-5, "f at {x:?}: {} for {}, off by {error} h", found.f, expected.value);
                let twisted =
                    (0..3).map(|k| (found.normal[k] - expected.normal[k]).abs()).fold(0.0, f64::max);
                assert!(!(1e-4..=0.5).contains(&twisted), "normal at {x:?}: {twisted}");
                compared += usize::from(found.status == Status::Ok);
            }
        }
    }
    compared
}

#[test]
fn the_implicit_function_equals_the_twin() {
    let dragon = nearmiss_testdata::dragon::dragon_mesh(nearmiss_testdata::dragon::Dragon::Points5k).unwrap();
    let clouds =
        KINDS.map(|kind| arbitrary::cloud(kind, 900, 5)).into_iter().chain([dragon.vertices().to_vec()]);
    let mut compared = 0;
    for points in clouds {
        for (kernel, twin_kernel) in [
            (Kernel::Gaussian, oracle::Kernel::Gaussian { theta: 1e-4 }),
            (Kernel::Wendland, oracle::Kernel::Wendland),
        ] {
            for (bandwidth, twin_bandwidth) in
                [(Bandwidth::Local, oracle::Bandwidth::Local), (Bandwidth::Global, oracle::Bandwidth::Global)]
            {
                let surface = SurfaceOptions::default().with_kernel(kernel).with_bandwidth(bandwidth);
                let scan = prepared(&points, &BuildOptions::default().with_surface(surface));
                let parameters = Parameters {
                    reach: surface.support_radius,
                    kernel: twin_kernel,
                    bandwidth: twin_bandwidth,
                    least_support: surface.support_min as usize,
                };
                compared += compare(&scan, parameters, 7);
            }
        }
    }
    assert!(compared > 4000, "only {compared} points were ok on both sides");
}

#[test]
fn near_an_interior_sheet_the_function_is_ok() {
    let points: Vec<[f64; 3]> = (0..2500_i32).map(|i| [f64::from(i % 50), f64::from(i / 50), 0.0]).collect();
    let scan = prepared(&points, &BuildOptions::default());
    let mut rng = arbitrary::rng(1);
    let mut ok = 0;
    for _ in 0..1000 {
        let [x, y, z] = arbitrary::point_in(&mut rng, 1.0);
        let h = f64::from(scan.plan().bandwidth(1.414));
        let at = scan.evaluate([25.0 + 15.0 * x, 25.0 + 15.0 * y, 0.2 * h * z]);
        ok += u32::from(at.status == Status::Ok);
        assert!((at.f.abs() - (0.2 * h * z).abs()).abs() < 1e-5 * h, "f is the height");
    }
    assert!(ok >= 950, "{ok} of 1000");
}

/// Returns f at `x`, with all points of the scan offered.
fn by_all_points(scan: &PointHierarchy, x: [f64; 3]) -> Evaluation {
    Moments::about(Level::baseline(), scan.plan(), x, scan.blocks().iter().copied()).evaluate(scan.plan(), x)
}

#[test]
fn lists_and_instructions_change_no_bit() {
    let dragon = nearmiss_testdata::dragon::dragon_mesh(nearmiss_testdata::dragon::Dragon::Points5k).unwrap();
    let clouds =
        KINDS.map(|kind| arbitrary::cloud(kind, 3000, 2)).into_iter().chain([dragon.vertices().to_vec()]);
    let (mut listed, mut compared) = (0, 0);
    for points in clouds {
        for (leaf_size, bandwidth) in
            [(16, Bandwidth::Local), (4, Bandwidth::Local), (60, Bandwidth::Local), (16, Bandwidth::Global)]
        {
            let surface = SurfaceOptions::default().with_bandwidth(bandwidth);
            let scan =
                prepared(&points, &BuildOptions::default().with_leaf_size(leaf_size).with_surface(surface));
            let mut scratches: Vec<GatherScratch> = levels().into_iter().map(GatherScratch::at).collect();
            let mut rng = arbitrary::rng(6);
            for i in (0..scan.len()).step_by(97) {
                listed += usize::from(scan.neighbours(i / PointBlock::WIDTH).is_some());
                let mut step = |reach: f64| {
                    let offset = arbitrary::point_in(&mut rng, reach * f64::from(scan.radii()[i]));
                    [0, 1, 2].map(|k| f64::from(scan.positions()[i][k]) + offset[k])
                };
                // Some of these positions share a list of blocks.
                let walk = [0.3, 0.1, 0.1, 0.2, 3.0, 0.05, 0.05, 40.0, 0.0].map(&mut step);
                let walk = walk.map(|x| (x, by_all_points(&scan, x)));
                for scratch in &mut scratches {
                    let mut near = scan.near(i, scratch);
                    for (x, expected) in walk {
                        assert_eq!(near.evaluate(x), expected, "near a point, at {x:?}");
                    }
                }
                // On the surface, near it, beyond the range of the list, and far away.
                for reach in [0.0, 0.5, 2.0, 6.0, 40.0] {
                    let x = step(reach);
                    let expected = by_all_points(&scan, x);
                    for scratch in &mut scratches {
                        // The block left in the scratch by the previous evaluation may be near or
                        // not.
                        assert_eq!(scan.evaluate_with(x, scratch), expected, "anywhere, at {x:?}");
                        assert_eq!(scan.evaluate_near(i, x, scratch), expected, "at a leaf, at {x:?}");
                        compared += 1;
                    }
                }
            }
        }
    }
    assert!(compared > 20_000 && listed > 1000, "{listed} of {compared} by lists");
}

#[test]
fn a_list_is_complete_where_it_is_said_to_be() {
    for kind in KINDS {
        let scan = prepared(&arbitrary::cloud(kind, 3000, 4), &BuildOptions::default());
        for i in (0..scan.len()).step_by(53) {
            let block = i / PointBlock::WIDTH;
            let Some((within, groups)) = scan.neighbours(block) else { continue };
            let lane = block % PointBlock::WIDTH;
            let middle = scan.groups()[block / PointBlock::WIDTH].position.map(|c| f64::from(c[lane]));
            for (j, (p, r)) in scan.positions().iter().zip(scan.radii()).enumerate() {
                let away = (0..3).map(|k| (f64::from(p[k]) - middle[k]).powi(2)).sum::<f64>().sqrt();
                if away < f64::from(scan.plan().support_radius(*r)) + f64::from(within) {
                    let group = u32::try_from(j / PointBlock::WIDTH.pow(2)).unwrap();
                    assert!(groups.contains(&group), "{kind:?}: point {j} supports f near block {block}");
                }
            }
        }
    }
}

#[test]
fn a_scratch_of_another_scan_does_no_harm() {
    let large = prepared(&arbitrary::cloud(CloudKind::Sphere, 5000, 1), &BuildOptions::default());
    let small = prepared(&arbitrary::cloud(CloudKind::Sphere, 40, 1), &BuildOptions::default());
    let mut scratch = GatherScratch::default();
    for i in (0..large.len()).step_by(37) {
        let x = large.positions()[i].map(f64::from);
        assert_eq!(large.evaluate_near(i, x, &mut scratch), large.evaluate(x), "the large one");
        assert_eq!(small.evaluate_with(x, &mut scratch), small.evaluate(x), "the small one after it");
        assert_eq!(small.evaluate_near(usize::MAX, x, &mut scratch), small.evaluate(x), "no such point");
    }
}

#[test]
fn where_f_was_asked_about_before_does_not_matter() {
    let mut rng = arbitrary::rng(5);
    for kind in CloudKind::ALL {
        let scan = prepared(&arbitrary::cloud(kind, 3000, 4), &BuildOptions::default());
        let mut scratch = GatherScratch::default();
        let mut x = scan.positions()[0].map(f64::from);
        for round in 0..1500 {
            assert_eq!(scan.evaluate_onward(x, &mut scratch), scan.evaluate(x), "{kind:?}, at {x:?}");
            // From point to point by short steps, with a long one now and then.
            let next = scan.nearest_point(x) as usize + if round % 40 == 0 { 1000 } else { 1 };
            let step = arbitrary::point_in(&mut rng, 0.5 * f64::from(scan.radii()[next % scan.len()]));
            x = [0, 1, 2].map(|k| f64::from(scan.positions()[next % scan.len()][k]) + step[k]);
        }
    }
}

#[test]
fn threads_and_order_of_work_do_not_matter() {
    let points = arbitrary::cloud(CloudKind::Clustered, 30_000, 9);
    let cloud = PointCloud::from_positions(&points).unwrap();
    let build =
        |threads| PointHierarchy::build(&cloud, &BuildOptions::default().with_threads(threads)).unwrap();
    let (one, two, five) = (build(1), build(2), build(5));
    for other in [two, five] {
        assert_eq!(one.positions(), other.positions(), "order");
        assert_eq!(one.normals(), other.normals(), "normals");
        assert_eq!(one.radii(), other.radii(), "radii");
        assert!(one.boxes().eq(other.boxes()), "boxes");
        assert_eq!(one.meta(), other.meta(), "the rest");
        for block in 0..one.blocks().len() {
            assert_eq!(one.neighbours(block), other.neighbours(block), "the list of block {block}");
        }
    }
}

#[test]
fn the_nearest_point_is_found_from_anywhere() {
    for kind in CloudKind::ALL {
        // Many groups of blocks, so that lists contain more than the first.
        let points = arbitrary::cloud(kind, 6_000, 6);
        let scan =
            PointHierarchy::build(&PointCloud::from_positions(&points).unwrap(), &BuildOptions::default())
                .unwrap();
        let mut rng = arbitrary::rng(8);
        let far = scan.positions().iter().flatten().fold(0.0_f64, |far, &c| far.max(f64::from(c.abs())));
        for k in 0..100 {
            let i = k * 7919 % scan.len();
            let off = arbitrary::point_in(&mut rng, far * [0.0, 0.01, 0.03, 3.0][k % 4]);
            let x = [0, 1, 2].map(|k| f64::from(scan.positions()[i][k]) + off[k]);
            let away = |p: &[f32; 3]| (0..3).map(|k| (f64::from(p[k]) - x[k]).powi(2)).sum::<f64>();
            // The first of equally near points.
            let nearest =
                (0..).zip(scan.positions()).min_by(|a, b| away(a.1).total_cmp(&away(b.1))).unwrap().0;
            assert_eq!(scan.nearest_point(x), nearest, "{kind:?}, {x:?}");
            // From any point, and from a close one whose list is complete there.
            for from in [k * 31 % scan.len(), i] {
                assert_eq!(scan.nearest_point_near(from, x), nearest, "{kind:?}, {x:?} from {from}");
            }
        }
    }
}
