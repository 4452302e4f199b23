//! The kinds of points on clouds of known nature.
use nearmiss_geometry::PointCloud;
use nearmiss_hierarchy::{BuildOptions, PointHierarchy, PointKind, SLAB};
use nearmiss_testdata::arbitrary::{gaussian, point_in, rng};
use nearmiss_testdata::scanner::{self, Frame};

fn prepared(points: &[[f64; 3]]) -> PointHierarchy {
    let scan = PointHierarchy::build(&PointCloud::from_positions(points).unwrap(), &BuildOptions::default());
    let scan = scan.unwrap();
    assert_eq!(scan.sanity_check(), Ok(()), "an invariant");
    scan
}

/// Returns a square lattice of n × n points.
fn lattice(n: u32, spacing: f64, height: impl Fn(f64, f64) -> f64) -> Vec<[f64; 3]> {
    let side = |i: u32| f64::from(i) * spacing;
    let all = (0..n).flat_map(|i| (0..n).map(move |j| [side(i), side(j)]));
    all.map(|[x, y]| [x, y, height(x, y)]).collect()
}

#[test]
fn rings_of_a_scanner_make_a_surface() {
    for (beams, steps, noise) in [(32, 900, 0.0), (32, 1800, 0.005), (64, 1800, 0.005), (16, 1800, 0.0)] {
        let points = scanner::frame(&Frame { beams, steps, noise, seed: 3 });
        let scan = prepared(&points);
        let label = format!("{beams} beams of {steps}, noise {noise}");
        assert!(scan.usable() > 0.8, "{label}: {} usable", scan.usable());
        assert!(scan.share(PointKind::Line) < 0.1, "{label}: {} lines", scan.share(PointKind::Line));
        let (mut turned, mut trusted) = (0, 0);
        for i in (0..scan.len()).filter(|&i| scan.kind(i) == PointKind::Sheet) {
            let p = scan.positions()[i].map(f64::from);
            let origin = scan.frame().origin;
            let (_, normal) = scanner::off([0, 1, 2].map(|k| p[k] * scan.frame().scale + origin[k]));
            let cosine: f64 = (0..3).map(|k| normal[k] * f64::from(scan.normals()[i][k])).sum();
            turned += u32::from(cosine.abs() < 0.9);
            trusted += 1;
        }
        let share = f64::from(turned) / f64::from(trusted);
        assert!(share < 0.05, "{label}: {share} of the trusted normals are off by more than 26°");
    }
}

#[test]
fn quantised_sheets_are_surfaces() {
    // A slope and a wave, with heights rounded to multiples of a step.
    let rounded = |z: f64| (z / 0.01).round() * 0.01;
    for points in [
        lattice(60, 0.01, |x, _| rounded(0.37 * x)),
        lattice(60, 0.02, |x, y| rounded(0.05 * (9.0 * x).sin() + 0.1 * y)),
    ] {
        let scan = prepared(&points);
        assert!(scan.usable() > 0.97, "{} usable", scan.usable());
    }
    // Each return twice, with a deviation of a hundredth of the spacing.
    let mut rng = rng(4);
    let twice = lattice(50, 0.1, |_, _| 0.0);
    let again: Vec<[f64; 3]> = twice.iter().map(|p| p.map(|x| x + 0.001 * gaussian(&mut rng))).collect();
    let scan = prepared(&[twice, again].concat());
    assert!(scan.usable() > 0.97, "{} usable", scan.usable());
}

#[test]
fn blobs_wires_and_lone_points_are_named() {
    let mut rng = rng(5);
    let blob: Vec<[f64; 3]> = (0..3000).map(|_| point_in(&mut rng, 1.0)).collect();
    let scan = prepared(&blob);
    assert!(scan.share(PointKind::Noisy) > 0.7, "{} of a blob", scan.share(PointKind::Noisy));
    assert!(scan.share(PointKind::Sheet) < 0.2, "{} of a blob", scan.share(PointKind::Sheet));

    let wire: Vec<[f64; 3]> =
        (0..2000_u16).map(|i| f64::from(i) * 0.01).map(|t| [t, 0.3 * t.sin(), 0.0]).collect();
    let scan = prepared(&wire);
    assert!(scan.share(PointKind::Line) > 0.99, "{} of a wire", scan.share(PointKind::Line));
    let greatest = scan.radii().iter().copied().fold(0.0, f32::max);
    assert!(greatest < 0.065, "a wire alone is as thin as its sixth neighbour: {greatest}");

    let mut points = lattice(40, 0.1, |_, _| 0.0);
    points.extend([[1.0, 1.0, 2.0], [3.0, 2.0, 3.0]]);
    let scan = prepared(&points);
    let lone = scan.source().iter().position(|&s| s == 1600).unwrap();
    assert_eq!(scan.kind(lone), PointKind::Stray);
    let ball = scan.arrays().ball(lone);
    assert!(scan.discs().get(lone) <= ball && f64::from(ball) <= scan.sampling_radius(), "{ball}");
    assert!(scan.share(PointKind::Stray) < 0.002, "no other");
}

#[test]
fn nothing_is_interpolated_beyond_the_reach() {
    // A twentieth of the points, with thirty times the spacing, too far away to be smoothed.
    let far = lattice(15, 3.0, |_, _| 0.0).into_iter().map(|[x, y, z]| [x + 500.0, y, z]);
    let points: Vec<[f64; 3]> = lattice(70, 0.1, |_, _| 0.0).into_iter().chain(far).collect();
    let scan = prepared(&points);
    let (reach, scale) = (scan.reach(), scan.frame().scale);
    assert!((reach / (2.0 * scan.sampling_radius()) - 1.0).abs() < 1e-6, "{reach}");
    for i in 0..scan.len() {
        let is_far = scan.source()[i] >= 4900;
        assert_eq!(scan.kind(i).is_sparse(), is_far, "point {i}: {:?}", scan.kind(i));
        let [radius, disc] = [scan.radii()[i], scan.discs().get(i)].map(|x| f64::from(x) * scale);
        let ball = f64::from(scan.arrays().obstacle_ball(i)) * scale;
        let limit = reach * (1.0 + 1e-6);
        assert!(radius <= limit && disc <= 0.5 * limit && ball <= 0.5 * limit, "point {i}");
        if is_far {
            assert!((ball / (0.5 * reach) - 1.0).abs() < 1e-5, "point {i}: {ball}");
        }
    }
    // A greater reach bridges gaps that the default does not.
    let cloud = PointCloud::from_positions(&points).unwrap();
    let wide = PointHierarchy::build(&cloud, &BuildOptions::default().with_reach(12.0)).unwrap();
    assert!(wide.share(PointKind::Stray) < 1e-9 && wide.share(PointKind::Sheet) > 0.9);
}

/// The parts of a block are those of its points: a ball about each and, on a sheet, a slab.
#[test]
fn parts_of_blocks_are_those_of_points() {
    let mut rng = rng(6);
    let mut points = lattice(40, 0.05, |x, y| 0.1 * (3.0 * x).sin() * y);
    points.extend((0..700).map(|_| point_in(&mut rng, 0.4).map(|x| x + 5.0)));
    points.extend((0..30).map(|_| point_in(&mut rng, 6.0)));
    let (scan, mut counts) = (prepared(&points), [0; 2]);
    let arrays = scan.arrays();
    for block in 0..arrays.blocks.len() {
        let parts = arrays.obstacle_parts(block);
        for lane in 0..16 {
            let i = 16 * block + lane;
            if i >= scan.len() {
                assert_eq!(parts.reaches[lane].to_bits(), 0, "unused");
                continue;
            }
            assert_eq!(parts.normals.map(|row| row[lane]), scan.normals()[i]);
            let reach = arrays.obstacle_reach(i);
            assert!((reach..1.01 * reach).contains(&parts.reaches[lane]), "{reach} {}", parts.reaches[lane]);
            let is_sheet = arrays.is_on_sheet(i);
            let slab = if is_sheet { SLAB * scan.radii()[i] } else { f32::INFINITY };
            assert_eq!(parts.slabs[lane].to_bits(), slab.to_bits(), "point {i}");
            counts[usize::from(is_sheet)] += 1;
        }
    }
    assert!(counts.iter().all(|&count| count > 300), "{counts:?}");
}
