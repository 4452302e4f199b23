//! Distances against brute force and against known values for spheres and planes.
use std::time::Duration;

use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
use nearmiss_query::{
    Budget, Deadline, Distance, DistanceOptions, DistancePlan, Evidence, Pair, Placed, PlanError, Scratch,
    Semantics,
};
use nearmiss_testdata::arbitrary::{self, CloudKind};

fn prepared(points: &[[f64; 3]], leaf_size: u32) -> PointHierarchy {
    let options = BuildOptions::default().with_leaf_size(leaf_size);
    PointHierarchy::build(&PointCloud::cleaned(points).unwrap(), &options).unwrap()
}

fn plan(semantics: Semantics, a: &PointHierarchy, b: &PointHierarchy) -> DistancePlan {
    DistancePlan::new(&DistanceOptions::default().with_semantics(semantics), a, b).unwrap()
}

/// The least distance of any two points, one by one.
fn brute(a: &Placed<'_>, b: &Placed<'_>) -> f64 {
    let points = |view: &Placed<'_>| (0..view.scan().len()).map(|i| view.point(i)).collect::<Vec<_>>();
    let (of_a, of_b) = (points(a), points(b));
    let distances = of_a
        .iter()
        .flat_map(|p| of_b.iter().map(move |q| (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>()));
    distances.fold(f64::INFINITY, f64::min).sqrt()
}

fn apart(points: [[f64; 3]; 2]) -> f64 {
    (0..3).map(|k| (points[0][k] - points[1][k]).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn points_are_as_far_apart_as_brute_force_says() {
    let mut rng = arbitrary::rng(71);
    let (mut far, mut near) = (0, 0);
    for (n, kind) in (0_u64..).zip(CloudKind::ALL.iter().cycle().take(42)) {
        let leaf_size = [16, 4, 64][(n % 3) as usize];
        let a = prepared(&arbitrary::cloud(*kind, 250, n), leaf_size);
        // Other densities and tree depths.
        let b = prepared(&arbitrary::cloud(*kind, [200, 40, 700][(n / 3 % 3) as usize], n + 100), 16);
        let size = a.bounds().half_extents().into_iter().fold(0.0, f64::max);
        let plan = plan(Semantics::Thickened(0.0), &a, &b);
        let mut scratch = Scratch::default();
        for (round, away) in [0.5, 3.0, 30.0, 1e6].into_iter().enumerate() {
            for scale in [1.0, 1e-3, 1e6] {
                let shift = arbitrary::unit_vector(&mut rng).map(|x| x * away * size);
                let pose_b = arbitrary::rotation(&mut rng).with_scale(scale).with_translation(shift);
                let shift = arbitrary::point_in(&mut rng, 10.0 * size);
                let pose_a = arbitrary::rotation(&mut rng).with_translation(shift);
                let (va, vb) = (Placed::new(&a, &pose_a), Placed::new(&b, &pose_b));
                let found = Pair::new(va, vb).distance(&plan, &mut scratch);
                let expected = brute(&va, &vb);
                let what = format!("{kind:?} {n}, {away} away, times {scale}: {found:?}");
                assert!((found.upper - expected).abs() <= 1e-15 * expected, "{what} for {expected}");
                assert_eq!((found.lower.to_bits(), found.complete), (found.upper.to_bits(), true), "{what}");
                assert!((apart(found.points) - found.upper).abs() <= 1e-12 * expected, "{what}");
                if round == 3 { far += 1 } else { near += 1 }
            }
        }
    }
    assert_eq!((far, near), (126, 378), "all were asked");
}

#[test]
fn coincident_and_single_points_have_distances() {
    let points = arbitrary::cloud(CloudKind::Random, 100, 5);
    let scan = prepared(&points, 16);
    let exact = plan(Semantics::Thickened(0.0), &scan, &scan);
    let here = Placed::new(&scan, &Pose::IDENTITY);
    let found = Pair::new(here, here).distance(&exact, &mut Scratch::default());
    assert_eq!(found.upper.to_bits(), 0.0_f64.to_bits(), "the very same points: {found:?}");
    assert_eq!(found.sources[0], found.sources[1]);

    // The corners of a cube so small that it acts as a single point.
    let corner = |i: u32| [0, 1, 2].map(|k| f64::from(i >> k & 1) * 1e-6);
    let dot = prepared(&(0..8).map(corner).collect::<Vec<_>>(), 16);
    let exact = plan(Semantics::Thickened(0.25), &scan, &dot);
    let there = Pose::from_translation([3.0, 4.0, 12.0]);
    let view = Placed::new(&dot, &there);
    let found = Pair::new(here, view).distance(&exact, &mut Scratch::default());
    let expected = brute(&here, &view) - 0.5;
    assert!((found.upper - expected).abs() < 1e-12 && found.complete, "{found:?} for {expected}");
    let thick = plan(Semantics::Thickened(20.0), &scan, &dot);
    let found = Pair::new(here, view).distance(&thick, &mut Scratch::default());
    assert_eq!((found.lower.to_bits(), found.upper.to_bits()), (0, 0), "balls that overlap: {found:?}");
}

/// A sphere of radius 1, sampled along a spiral.
fn sphere(count: u32) -> Vec<[f64; 3]> {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let place = |i: u32| {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
        let (flat, turn) = ((1.0 - z * z).sqrt(), golden * f64::from(i));
        [flat * turn.cos(), flat * turn.sin(), z]
    };
    (0..count).map(place).collect()
}

/// The depth of the implicit surface below such a sphere, h²H/2, measured with f.
fn bias(scan: &PointHierarchy) -> f64 {
    let at = scan.evaluate([0.6, 0.0, 0.8]);
    let radius = at.centroid.iter().zip(at.normal).map(|(a, n)| a * n).sum::<f64>().abs();
    1.0 - radius
}

#[test]
fn spheres_are_as_far_apart_as_they_are() {
    let (a, b) = (prepared(&sphere(3000), 16), prepared(&sphere(8000), 16));
    let plan = plan(Semantics::Surface, &a, &b);
    let r = a.sampling_radius();
    let inside = bias(&a) + bias(&b);
    assert!(inside > 0.0 && inside < 0.1 * r, "the bias is small: {inside}");
    let mut rng = arbitrary::rng(72);
    let mut scratch = Scratch::default();
    for gap in [0.02, 0.1, 0.3, 1.0, 10.0, 1e4] {
        let mut widest: f64 = 0.0;
        for _ in 0..12 {
            let shift = arbitrary::unit_vector(&mut rng).map(|x| x * (2.0 + gap));
            let pose = arbitrary::rotation(&mut rng).with_translation(shift);
            let (va, vb) = (Placed::new(&a, &Pose::IDENTITY), Placed::new(&b, &pose));
            let truth = gap + inside;
            let found = Pair::new(va, vb).distance(&plan, &mut scratch);
            assert!(found.complete && found.evidence == Evidence::Certified, "{gap}: {found:?}");
            assert!(found.lower <= truth + 1e-6 * gap, "{gap}: {found:?}");
            // The feet approach each other to about r/1000; the surface is round to r/100.
            assert!((found.upper - truth).abs() < 0.03 * r + 1e-6 * gap, "{gap}: {found:?} for {truth}");
            assert!((apart(found.points) - found.upper).abs() <= 1e-9 * gap.max(1.0), "{found:?}");
            widest = widest.max(found.upper - found.lower);
        }
        assert!(widest < 4.0 * r, "{gap}: {widest} for r = {r}");
    }
}

#[test]
fn whenever_a_budget_ends_it_the_distance_is_between_the_bounds() {
    let (a, b) = (prepared(&sphere(3000), 16), prepared(&sphere(2000), 8));
    let inside = bias(&a) + bias(&b);
    let mut rng = arbitrary::rng(73);
    for semantics in [Semantics::Surface, Semantics::Thickened(0.01)] {
        let plan = plan(semantics, &a, &b);
        for gap in [0.05, 0.5, 4.0] {
            let shift = arbitrary::unit_vector(&mut rng).map(|x| x * (2.0 + gap));
            let pose = arbitrary::rotation(&mut rng).with_translation(shift);
            let (va, vb) = (Placed::new(&a, &Pose::IDENTITY), Placed::new(&b, &pose));
            let truth = match semantics {
                Semantics::Surface => gap + inside,
                _ => brute(&va, &vb) - 0.02,
            };
            let mut last: Option<Distance> = None;
            for doubled in 0..16_u32 {
                let work = if doubled == 0 { 0 } else { 1 << (doubled - 1) };
                let found = Pair::new(va, vb)
                    .within(&Budget::UNLIMITED.with_work(work))
                    .distance(&plan, &mut Scratch::default());
                let again = Pair::new(va, vb)
                    .within(&Budget::UNLIMITED.with_work(work))
                    .distance(&plan, &mut Scratch::default());
                assert_eq!(found, again, "the same work, the same answer");
                let what = format!("{semantics:?}, gap {gap}, work {work}: {found:?}");
                assert!(found.lower <= truth * (1.0 + 1e-12), "{what} for {truth}");
                let off = if semantics == Semantics::Surface { 0.01 * a.sampling_radius() } else { 0.0 };
                assert!(found.upper >= truth * (1.0 - 1e-12) - off, "{what} for {truth}");
                // A step costs at most sixteen units, a projection twelve evaluations.
                let spent = found.statistics.node_pairs + found.statistics.evaluations;
                assert!(spent <= work + 16 + 24, "{what}");
                if let Some(last) = last {
                    assert!(found.lower >= last.lower, "{what} after {last:?}");
                }
                last = Some(found);
            }
            assert!(last.unwrap().complete, "the last sufficed: {last:?}");
            let unlimited = Pair::new(va, vb).distance(&plan, &mut Scratch::default());
            let last = last.unwrap();
            assert_eq!((unlimited.lower, unlimited.upper), (last.lower, last.upper), "as without a budget");
            let deadline = Budget::UNLIMITED.with_deadline(Deadline::within(Duration::ZERO));
            let none = Pair::new(va, vb).within(&deadline).distance(&plan, &mut Scratch::default());
            assert!(!none.complete && none.lower <= truth && none.upper >= truth, "{none:?}");
        }
    }
}

#[test]
fn what_touches_is_at_distance_zero() {
    let scan = prepared(&sphere(3000), 16);
    let plan = plan(Semantics::Surface, &scan, &scan);
    let mut rng = arbitrary::rng(74);
    for depth in [0.05, 0.3, 1.0, 1.7] {
        let shift = arbitrary::unit_vector(&mut rng).map(|x| x * (2.0 - depth));
        let pose = arbitrary::rotation(&mut rng).with_translation(shift);
        let (va, vb) = (Placed::new(&scan, &Pose::IDENTITY), Placed::new(&scan, &pose));
        for budget in [Budget::UNLIMITED, Budget::UNLIMITED.with_work(100_000)] {
            let found = Pair::new(va, vb).within(&budget).distance(&plan, &mut Scratch::default());
            assert_eq!((found.lower, found.upper), (0.0, 0.0), "{depth}: {found:?}");
            assert!(found.complete && found.evidence == Evidence::Certified, "{depth}: {found:?}");
            let off = found.points[0].iter().map(|x| x * x).sum::<f64>().sqrt() - 1.0;
            assert!(off.abs() < 0.01, "a place on both: {found:?}");
        }
    }
    // A sphere inside another one does not touch it.
    let within = Pose::IDENTITY.with_scale(0.2);
    let (va, vb) = (Placed::new(&scan, &Pose::IDENTITY), Placed::new(&scan, &within));
    let found = Pair::new(va, vb).distance(&plan, &mut Scratch::default());
    assert!((found.upper - 0.8).abs() < 0.01 && found.lower > 0.2, "{found:?}");
}

#[test]
fn wrong_questions_and_poses_are_told() {
    let scan = prepared(&sphere(200), 16);
    let thick = |radius| DistanceOptions::default().with_semantics(Semantics::Thickened(radius));
    assert!(matches!(DistancePlan::new(&thick(-1.0), &scan, &scan), Err(PlanError::Radius(_))));
    let plan = plan(Semantics::Surface, &scan, &scan);
    let here = Placed::new(&scan, &Pose::IDENTITY);
    let nowhere = Placed::new(&scan, &Pose::from_translation([f64::NAN, 0.0, 0.0]));
    let found = Pair::new(here, nowhere).distance(&plan, &mut Scratch::default());
    assert_eq!((found.lower, found.upper, found.complete), (0.0, f64::INFINITY, false), "{found:?}");
}
