//! A scan whose points were moved is as valid as one that was prepared: every array belongs to the
//! current points, and enclosures hold the surface and the obstacle.

use nearmiss_geometry::NodeId;
use nearmiss_hierarchy::{
    BuildOptions, DeformError, DeformingScan, GatherScratch, OrientedBox, Part, PointHierarchy, PointKind,
    SLAB,
};
use nearmiss_surface::{Status, SurfaceOptions, project};
use nearmiss_testdata::arbitrary::{self, CloudKind, point_in, pose, rng};
use nearmiss_testdata::oracle::{self, Parameters};

use crate::twin::compare;

/// Deformations of some points, with names.
pub(crate) fn frames(points: &[[f64; 3]], size: f64, seed: u64) -> Vec<(&'static str, Vec<[f64; 3]>)> {
    let rng = &mut rng(seed);
    let turn = pose(rng, 3.0 * size);
    let noise: Vec<[f64; 3]> = points.iter().map(|_| point_in(rng, 0.02 * size)).collect();
    let all = |f: &dyn Fn(usize, [f64; 3]) -> [f64; 3]| {
        points.iter().enumerate().map(|(i, p)| f(i, *p)).collect::<Vec<_>>()
    };
    let wave = 3.0 / size;
    vec![
        ("identity", points.to_vec()),
        ("rigid", all(&|_, p| turn.apply(p))),
        ("shear", all(&|_, [x, y, z]| [x + 0.1 * z, y - 0.05 * x, z])),
        ("bend", all(&|_, [x, y, z]| [x, y, z + 0.1 * size * (wave * x).sin()])),
        ("stretch", all(&|_, [x, y, z]| [1.7 * x, y, 0.8 * z])),
        ("noise", all(&|i, p| [0, 1, 2].map(|k| p[k] + noise[i][k]))),
        ("soup", all(&|i, _| noise[i].map(|x| 30.0 * x))),
        ("apart", all(&|_, [x, y, z]| [if x > 0.1 * size { x + size } else { x }, y, z])),
        ("far", all(&|_, p| [p[0] + 1e4 * size, p[1], p[2] - 3e3 * size])),
        ("flat", all(&|_, [x, y, _]| [x, y, 0.0])),
        ("line", all(&|_, [x, ..]| [x, 0.5 * x, 0.0])),
        ("point", all(&|_, _| [0.25 * size; 3])),
        ("identity", points.to_vec()),
    ]
}

/// Points of each kind, and their extent.
fn clouds() -> Vec<(CloudKind, Vec<[f64; 3]>, f64)> {
    let kinds = [
        CloudKind::Sphere,
        CloudKind::Lattice,
        CloudKind::Random,
        CloudKind::Rings,
        CloudKind::Clustered,
        CloudKind::Outlier,
        CloudKind::Duplicates,
        CloudKind::Huge,
    ];
    let with_extent = |kind| {
        let points = arbitrary::cloud(kind, 700, 9);
        let far = points.iter().flatten().fold(0.0_f64, |far, x| far.max(x.abs()));
        (kind, points, far)
    };
    kinds.map(with_extent).to_vec()
}

/// Returns the distance by which `x` is outside the box.
fn outside(bounds: &OrientedBox, x: [f64; 3]) -> f64 {
    let d = [0, 1, 2].map(|k| x[k] - f64::from(bounds.centre[k]));
    let along = |k: usize| (0..3).map(|i| f64::from(bounds.axes[k][i]) * d[i]).sum::<f64>();
    (0..3).map(|k| along(k).abs() - f64::from(bounds.half[k])).fold(f64::MIN, f64::max)
}

/// Asserts that places of the surface and of the obstacle are in the enclosures of all nodes that
/// contain their nearest point. Returns their numbers.
fn check_enclosed(scan: &PointHierarchy, seed: u64, name: &str) -> [usize; 2] {
    let (mut scratch, mut random, mut found) = (GatherScratch::default(), rng(seed), [0; 2]);
    let (arrays, positions) = (scan.arrays(), scan.positions());
    let nearest = |x: [f64; 3]| scan.nearest_point(x) as usize;
    let held = |part: Part, x: [f64; 3], p: usize| {
        let mut node = Some(scan.topology().leaf_of(p));
        while let Some(id) = node {
            let beyond = outside(&scan.tree().enclosure(part, id), x);
            assert!(
                beyond <= 0.0,
                "{name}: {x:?} is {beyond} outside {part:?} of node {id:?}, near point {p}"
            );
            node = scan.topology().parent(id).map(|(parent, _)| parent);
        }
    };
    for i in 0..scan.len() {
        let r = f64::from(scan.radii()[i]);
        let away = point_in(&mut random, 1.5 * r);
        let start = [0, 1, 2].map(|k| f64::from(positions[i][k]) + away[k]);
        let foot = project(start, |x| scan.evaluate_with(x, &mut scratch));
        for x in [start, foot.point] {
            if scan.evaluate_with(x, &mut scratch).status != Status::Ok {
                continue;
            }
            let p = nearest(x);
            held(Part::Surface, x, p);
            found[0] += 1;
            let d = [0, 1, 2].map(|k| x[k] - f64::from(positions[p][k]));
            let height: f64 = (0..3).map(|k| d[k] * f64::from(scan.normals()[p][k])).sum();
            let far = d.iter().map(|d| d * d).sum::<f64>().sqrt();
            let slab = f64::from(SLAB * scan.radii()[p]);
            if arrays.is_on_sheet(p) && far <= f64::from(arrays.cell_radius(p)) && height.abs() <= slab {
                held(Part::Obstacle, x, p);
                found[1] += 1;
            }
        }
    }
    found
}

/// Asserts that the spacing of each node is the root mean square of the radii under it.
fn check_spacings(scan: &PointHierarchy, name: &str) {
    for id in scan.topology().ids() {
        let radii = &scan.radii()[scan.topology().points(id)];
        let squares: f64 = radii.iter().map(|r| f64::from(*r).powi(2)).sum();
        let expected = (squares / radii.len() as f64).sqrt();
        let found = f64::from(scan.arrays().coverings[id.index()].spacing);
        assert!((found - expected).abs() <= 1e-5 * expected, "{name}: {id:?} has {found}, not {expected}");
    }
}

/// The default surface, for the naive implementation of f.
fn parameters() -> Parameters {
    let surface = SurfaceOptions::default();
    Parameters {
        reach: surface.support_radius,
        kernel: oracle::Kernel::Gaussian { theta: 1e-4 },
        bandwidth: oracle::Bandwidth::Local,
        least_support: surface.support_min as usize,
    }
}

#[test]
fn a_moved_scan_is_valid_in_every_frame() {
    let (mut found, mut compared) = ([0; 2], 0);
    for (kind, points, size) in clouds() {
        for leaf_size in [16, 10, 24, 64] {
            let options = BuildOptions::default().with_leaf_size(leaf_size);
            let Ok(mut scan) = DeformingScan::new(&points, &options) else { continue };
            for (number, (name, frame)) in (0..).zip(frames(&points, size, 4)) {
                let name = format!("{kind:?}, leaves of {leaf_size}, {name}");
                let refitted = match scan.refit(&frame) {
                    // Noise takes repeated points apart.
                    Err(DeformError::Apart { .. }) => continue,
                    refitted => refitted.unwrap(),
                };
                assert_eq!(refitted.carried + refitted.fitted, scan.len(), "{name}");
                assert_eq!(scan.sanity_check(), Ok(()), "{name}");
                check_spacings(&scan, &name);
                let of_frame = check_enclosed(&scan, number, &name);
                found = [0, 1].map(|k| found[k] + of_frame[k]);
                if leaf_size == 16 && name.ends_with("bend") {
                    compared += compare(&scan, parameters(), number);
                }
            }
        }
    }
    assert!(found.iter().all(|&found| found > 20_000), "{found:?} places of surfaces and obstacles");
    assert!(compared > 1000, "f was compared with its naive sum at {compared} places");
}

/// Sparse points come last in the order and are balls in the obstacle, also in a frame in which they sample a
/// sheet.
#[test]
fn points_that_were_sparse_remain_balls() {
    let lattice = |n: u32, spacing: f64, away: f64| {
        (0..n * n).map(move |i| [spacing * f64::from(i % n) + away, spacing * f64::from(i / n), 0.0])
    };
    let points: Vec<[f64; 3]> = lattice(70, 0.1, 0.0).chain(lattice(15, 3.0, 500.0)).collect();
    let gathered: Vec<[f64; 3]> = lattice(70, 0.1, 0.0).chain(lattice(15, 0.1, 20.0)).collect();
    let mut scan = DeformingScan::new(&points, &BuildOptions::default()).unwrap();
    scan.renew(&gathered).unwrap();
    assert_eq!(scan.sanity_check(), Ok(()));
    let (arrays, mut sheets) = (scan.arrays(), 0);
    for i in arrays.dense..scan.len() {
        let leaf = scan.topology().leaf_of(i);
        assert!(arrays.leaves.has_balls(scan.topology().leaf_number(leaf)), "point {i}");
        let (ball, enclosure) = (arrays.obstacle_ball(i), scan.tree().enclosure(Part::Obstacle, leaf));
        assert!(ball > 0.3 * scan.radii()[i], "point {i} has a ball of {ball}");
        for side in [-0.999, 0.999] {
            let x = [0, 1, 2].map(|k| scan.positions()[i][k] + side * ball * scan.normals()[i][k]);
            let beyond = outside(&enclosure, x.map(f64::from));
            assert!(beyond <= 0.0, "the ball of point {i} is {beyond} outside");
        }
        sheets += usize::from(scan.kind(i) == PointKind::Sheet);
    }
    assert!(sheets > 100, "{sheets} of {} sample a sheet", scan.len() - arrays.dense);
}

#[test]
fn a_scan_at_rest_keeps_its_discs_and_a_renewed_one_equals_a_prepared_one() {
    for (kind, points, size) in clouds() {
        let Ok(mut scan) = DeformingScan::new(&points, &BuildOptions::default()) else { continue };
        let first = PointHierarchy::clone(&scan);
        let is_same_order = first.arrays().dense == first.len();
        for _ in 0..2 {
            assert_eq!(scan.refit(&points).unwrap().fitted, 0, "{kind:?}");
            assert_eq!(scan.radii(), first.radii(), "{kind:?}");
            for (n, m) in scan.normals().iter().zip(first.normals()) {
                assert!((0..3).all(|k| (n[k] - m[k]).abs() < 1e-3), "{kind:?}: {n:?}, {m:?}");
            }
        }
        let shear = &frames(&points, size, 4)[2].1;
        scan.refit(shear).unwrap();
        scan.renew(&points).unwrap();
        assert_eq!(scan.sanity_check(), Ok(()), "{kind:?}");
        assert_eq!(scan.source(), first.source(), "{kind:?}: the order stays");
        if is_same_order {
            assert_eq!(scan.radii(), first.radii(), "{kind:?}");
            assert_eq!(scan.normals(), first.normals(), "{kind:?}");
            assert!((0..scan.len()).all(|i| scan.kind(i) == first.kind(i)), "{kind:?}");
            assert!(scan.discs().iter().eq(first.discs().iter()), "{kind:?}");
            assert_eq!(scan.reach(), first.reach(), "{kind:?}");
            assert_eq!(scan.sampling_radius(), first.sampling_radius(), "{kind:?}");
        }
        // Renewed in another frame, it equals one that was prepared there and kept its order.
        scan.renew(shear).unwrap();
        let mut other = DeformingScan::new(&points, &BuildOptions::default()).unwrap();
        other.renew(shear).unwrap();
        assert_eq!(scan.outline(), other.outline(), "{kind:?}: history does not matter");
    }
}

#[test]
fn replaced_points_are_fitted_as_prepared_ones() {
    let (mut found, mut among) = (0, 0);
    let (kind, mut strays, size) = clouds().swap_remove(0);
    strays.extend((2..8_u8).map(|i| [0.0, size * f64::from(i), 0.3 * size]));
    for (kind, points, size) in clouds().into_iter().chain([(kind, strays, 8.0 * size)]) {
        let Ok(mut scan) = DeformingScan::new(&points, &BuildOptions::default()) else { continue };
        let shear = &frames(&points[10..], size, 4)[2].1;
        let Ok(anew) = DeformingScan::new(shear, &BuildOptions::default()) else { continue };
        scan.replace(shear).unwrap();
        assert_eq!(scan.sanity_check(), Ok(()), "{kind:?}");
        if scan.source() == anew.source() {
            assert_eq!((scan.radii(), scan.normals()), (anew.radii(), anew.normals()), "{kind:?}");
        } else {
            // Few sparse points stay among the others; in a prepared scan they come last.
            let sparse = (0..scan.len()).filter(|i| scan.kind(*i).is_sparse()).count();
            assert!((1..=scan.len() / 100).contains(&sparse), "{kind:?}: {sparse} of {}", scan.len());
            among += 1;
        }
        let by_input = |scan: &DeformingScan| {
            let point = |i: usize| (scan.source()[i], scan.radii()[i], scan.discs().get(i), scan.kind(i));
            let mut all: Vec<_> = (0..scan.len()).map(point).collect();
            all.sort_by_key(|point| point.0);
            all
        };
        assert_eq!(by_input(&scan), by_input(&anew), "{kind:?}");
        found += check_enclosed(&scan, 5, "replaced")[0];
    }
    assert!(
        found > 2000 && among > 0,
        "{found} places of surfaces, {among} scans with sparse points among others"
    );
}

/// A scene as a depth camera sees it: a wall, a floor, two balls before them, holes and noise.
pub(crate) fn depth_frame(width: u32, height: u32, time: f64) -> Vec<[f64; 3]> {
    let focus = 0.9 * f64::from(width);
    let balls = [([-0.4 + 0.2 * time.sin(), 0.2, 2.0], 0.45), ([0.6, 0.5, 2.6], 0.35)];
    let mut random = rng(3);
    let mut pixel = |i: u32| {
        let (u, v) = (f64::from(i % width), f64::from(i / width));
        let d = [(u - 0.5 * f64::from(width)) / focus, (v - 0.5 * f64::from(height)) / focus, 1.0];
        let mut depth: f64 = if d[1] > 0.0 { (0.9 / d[1]).min(3.5) } else { 3.5 };
        for (centre, radius) in balls {
            let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            let (dd, dc, cc) = (dot(d, d), dot(d, centre), dot(centre, centre) - radius * radius);
            let root = dc * dc - dd * cc;
            depth = if root > 0.0 { depth.min((dc - root.sqrt()) / dd) } else { depth };
        }
        let [noise, hole, _] = point_in(&mut random, 1.0);
        if hole > 0.96 || (i % width / 9 + i / width / 9) % 13 == 5 {
            return if hole > 0.0 { [f64::NAN; 3] } else { [0.0; 3] };
        }
        d.map(|x| x * depth * (1.0 + 3e-4 * noise))
    };
    (0..width * height).map(&mut pixel).collect()
}

#[test]
fn a_depth_frame_is_fitted_by_pixels_nearly_as_by_distances() {
    let first = depth_frame(96, 72, 0.0);
    let still: Vec<[f64; 3]> = first.iter().copied().filter(|p| p[2] > 0.0).collect();
    let mut scan = DeformingScan::new(&still, &BuildOptions::default()).unwrap();
    for step in 0..3_u8 {
        let frame = depth_frame(96, 72, f64::from(step));
        scan.replace_organised(&frame, 96).unwrap();
        assert_eq!(scan.sanity_check(), Ok(()), "frame {step}");
        let measured: Vec<[f64; 3]> = frame.iter().copied().filter(|p| p[2] > 0.0).collect();
        assert_eq!(scan.len(), measured.len(), "frame {step}");
        let anew = DeformingScan::new(&measured, &BuildOptions::default()).unwrap();
        let ratio = scan.sampling_radius() / anew.sampling_radius();
        assert!((ratio - 1.0).abs() < 0.05, "frame {step}: the sampling radius is {ratio} of the exact one");
        assert!((scan.sheet_share() - anew.sheet_share()).abs() < 0.02, "frame {step}");
        let places: Vec<usize> = (0..frame.len()).filter(|i| frame[*i][2] > 0.0).collect();
        let mut of_pixel = vec![0; frame.len()];
        (0..anew.len()).for_each(|i| of_pixel[places[anew.source()[i] as usize]] = i);
        let same = (0..scan.len()).filter(|&i| {
            let other = of_pixel[scan.source()[i] as usize];
            let cosine: f32 = (0..3).map(|k| scan.normals()[i][k] * anew.normals()[other][k]).sum();
            let ratio = scan.radii()[i] / anew.radii()[other];
            cosine.abs() > 0.95 && (0.8..1.25).contains(&ratio) && scan.kind(i) == anew.kind(other)
        });
        let share = same.count() as f64 / scan.len() as f64;
        assert!(share > 0.9, "frame {step}: {share} of all points are as prepared");
        let [surface, obstacle] = check_enclosed(&scan, step.into(), "a depth frame");
        assert!(surface.min(obstacle) > 4000, "frame {step}: {surface}, {obstacle}");
        let moved: Vec<[f64; 3]> = frame.iter().map(|p| [p[0] + 0.1, p[1], p[2]]).collect();
        assert!(matches!(scan.refit(&moved), Err(DeformError::NotFinite { .. })), "holes do not move");
    }
    let identity = scan.outline().identity;
    scan.replace_organised(&depth_frame(96, 72, 2.0), 96).unwrap();
    assert_eq!(scan.outline().identity, identity, "history does not matter");
    let none = vec![[f64::NAN; 3]; 64];
    assert!(matches!(scan.replace_organised(&none, 8), Err(DeformError::Cloud(_))), "nothing is measured");
    let faulty = scan.replace_organised(&first, 1000);
    assert_eq!(faulty, Err(DeformError::Image { width: 1000, got: 96 * 72 }), "no rows of 1000");
    assert_eq!(scan.outline().identity, identity, "the scan is unchanged");
    // Pixels far apart do not tell neighbours.
    let scattered: Vec<[f64; 3]> =
        (0..first.len()).map(|i| if i % 7 == 0 { first[i] } else { [f64::NAN; 3] }).collect();
    scan.replace_organised(&scattered, 96).unwrap();
    assert_eq!(scan.sanity_check(), Ok(()), "scattered pixels");
}

#[test]
fn points_are_fitted_anew_where_their_spacing_changes() {
    let lattice = |stretch: f64| -> Vec<[f64; 3]> {
        let place = |i: u32| [f64::from(i % 60), f64::from(i / 60)];
        let stretched = |[x, y]: [f64; 2]| [if x > 30.0 { 30.0 + stretch * (x - 30.0) } else { x }, y, 0.0];
        (0..3600).map(place).map(stretched).collect()
    };
    let mut scan = DeformingScan::new(&lattice(1.0), &BuildOptions::default()).unwrap();
    let far = |scan: &DeformingScan| {
        let place = scan.source().iter().position(|&i| i == 60 * 30 + 55).unwrap();
        f64::from(scan.radii()[place]) * scan.frame().scale
    };
    // Spacing is the root of the area of a point.
    for (stretch, limit) in [(1.2, 0.02), (1.5, 0.06)] {
        assert_eq!(scan.refit(&lattice(stretch)).unwrap().fitted, 0, "within the factor all are carried");
        let (carried, anew) = (far(&scan), DeformingScan::new(&lattice(stretch), &BuildOptions::default()));
        let ratio = carried / far(&anew.unwrap());
        assert!((ratio - 1.0).abs() < limit, "{carried}, {ratio} of a scan prepared anew");
    }
    let refitted = scan.refit(&lattice(1.7)).unwrap();
    assert!((1500..2200).contains(&refitted.fitted), "half of the points: {refitted:?}");
    let fitted = far(&scan);
    let mut anew = DeformingScan::new(&lattice(1.7), &BuildOptions::default()).unwrap();
    assert!((fitted / far(&anew) - 1.0).abs() < 0.05, "{fitted}, prepared anew {}", far(&anew));
    anew.refit(&lattice(1.7)).unwrap();
    assert!((scan.sheet_share() - anew.sheet_share()).abs() < 0.01, "{}", scan.sheet_share());
    assert_eq!(scan.refit(&lattice(1.7)).unwrap().fitted, 0, "they rest in the new frame");
}

#[test]
fn scans_with_leaves_of_any_size_rest_and_move_without_fits() {
    for (leaf_size, count) in [(10, 408), (16, 403), (24, 405), (64, 394), (64, 410), (64, 30)] {
        let options = BuildOptions::default().with_leaf_size(leaf_size);
        let cloud = |count| arbitrary::cloud(CloudKind::Sphere, count, 9);
        let mut scan = DeformingScan::new(&cloud(500), &options).unwrap();
        scan.refit(&cloud(500)).unwrap();
        // Fewer points, so that memory has more room than they need.
        let points = cloud(count);
        scan.replace(&points).unwrap();
        let radii = scan.radii().to_vec();
        let moved: Vec<[f64; 3]> = points.iter().map(|[x, y, z]| [x + 3.0, *y, *z]).collect();
        for frame in [&points, &moved, &points] {
            assert_eq!(scan.refit(frame).unwrap().fitted, 0, "{count} points in leaves of {leaf_size}");
            assert!(scan.radii() == radii, "{count} points in leaves of {leaf_size} keep their radii");
        }
    }
}

#[test]
fn points_beside_a_sharp_crease_keep_their_radii() {
    let sheet = |angle: f64| -> Vec<[f64; 3]> {
        let place = |i: u32| [f64::from(i % 61) - 26.0, f64::from(i / 61)];
        (0..61 * 40).map(place).map(|[x, y]| [x * angle.cos(), y, x.abs() * angle.sin()]).collect()
    };
    let mut scan = DeformingScan::new(&sheet(0.0), &BuildOptions::default()).unwrap();
    let angle = 80.0_f64.to_radians();
    assert!(scan.refit(&sheet(angle)).unwrap().fitted > 0, "leaves across the crease are bent");
    let mut anew = scan.clone();
    anew.renew(&sheet(angle)).unwrap();
    for (i, (refitted, renewed)) in scan.radii().iter().zip(anew.radii()).enumerate() {
        let ratio = refitted / renewed;
        assert!((0.7..1.8).contains(&ratio), "point {i}: {refitted}, renewed {renewed}");
    }
}

#[test]
fn faulty_frames_are_refused_and_change_nothing() {
    let mut points = arbitrary::cloud(CloudKind::Sphere, 100, 1);
    points.push(points[3]);
    let mut scan = DeformingScan::new(&points, &BuildOptions::default()).unwrap();
    let identity = scan.outline().identity;
    assert_eq!(
        scan.refit(&points[1..]),
        Err(DeformError::Count { what: "points", expected: 101, got: 100 }),
        "too few points"
    );
    let mut faulty = points.clone();
    faulty[17][2] = f64::NAN;
    let message = scan.refit(&faulty).unwrap_err().to_string();
    assert!(message.contains("point 17") && message.contains("NaN"), "{message}");
    faulty[17][2] = 1e40;
    assert!(matches!(scan.renew(&faulty), Err(DeformError::TooFar { .. })), "too far");
    faulty[17] = points[17];
    faulty[100][0] += 0.5;
    let message = scan.refit(&faulty).unwrap_err().to_string();
    assert!(message.contains("point 100") && message.contains("point 3"), "{message}");
    assert_eq!(scan.outline().identity, identity, "the scan is unchanged");
    let moved: Vec<[f64; 3]> = points.iter().map(|p| [p[0] + 1.0, p[1], p[2]]).collect();
    assert!(scan.refit(&moved).is_ok(), "repeated points may move together");
    assert_ne!(scan.outline().identity, identity, "another frame is another scan");
    assert_eq!(scan.tree().bounds(NodeId::ROOT), *scan.root_box(), "one box of the root");
}
