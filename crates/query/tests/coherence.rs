//! Hints: the same verdicts as without, for less.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
use nearmiss_query::{
    Budget, CollideOptions, CollidePlan, CollideScratch, Detail, Evidence, Order, PairHint, ScanView,
    Semantics, Verdict, collide, collide_hinted,
};
use nearmiss_testdata::arbitrary::{self, CloudKind};

fn prepared(points: &[[f64; 3]]) -> PointHierarchy {
    let leaf = BuildOptions::default().with_leaf_size(8);
    PointHierarchy::build(&PointCloud::from_positions(points).unwrap(), &leaf).unwrap()
}

/// A walk of b past and through a: shifts and turns of about `step`, drawn back when it gets far.
fn walk(rng: &mut impl rand::Rng, size: f64, step: f64, count: usize) -> Vec<Pose> {
    let mut at = arbitrary::unit_vector(rng).map(|x| x * size);
    let axis = arbitrary::unit_vector(rng);
    let (mut angle, mut poses) = (0.0, Vec::new());
    let mut heading = at.map(|x| -x / size);
    for i in 0..count {
        if i % 40 == 39 {
            let turned = arbitrary::unit_vector(rng);
            heading = [0, 1, 2].map(|k| turned[k] - at[k] / size);
        }
        at = [0, 1, 2].map(|k| at[k] + heading[k] * step);
        angle += 0.3 * step / size;
        poses.push(Pose::from_axis_angle(axis, angle).with_translation(at));
    }
    poses
}

fn kind(verdict: &Verdict) -> (u8, bool) {
    match verdict {
        Verdict::Intersecting { .. } => (0, false),
        Verdict::Separated { evidence, .. } => (1, *evidence == Evidence::Certified),
        Verdict::Undecided(_) => (2, false),
    }
}

#[test]
fn hints_change_no_verdict() {
    let mut rng = arbitrary::rng(31);
    let kinds =
        [CloudKind::Sphere, CloudKind::Lattice, CloudKind::Clustered, CloudKind::Rings, CloudKind::Coplanar];
    let (mut seen, mut skipped) = ([0; 3], 0);
    for (n, cloud) in (0_u64..).zip(kinds.iter().cycle().take(10)) {
        let a = prepared(&arbitrary::cloud(*cloud, 400, n));
        let b = prepared(&arbitrary::cloud(*cloud, 300, n + 50));
        let size = a.bounds().half_extents().into_iter().fold(0.0, f64::max);
        let r = a.sampling_radius();
        let base = CollideOptions::default().with_detail(Detail::Verdict);
        let questions = [
            base,
            base.with_order(Order::Overlap),
            base.with_margin(r),
            base.with_evidence(Evidence::Certified),
            base.with_evidence(Evidence::Certified).with_margin(0.5 * r),
            base.with_semantics(Semantics::Thickened(0.3 * r)),
        ];
        for options in questions {
            let plan = CollidePlan::new(&options, &a, &b).unwrap();
            let mut hint = PairHint::default();
            let mut scratch = CollideScratch::default();
            for step in [0.02 * r, 0.1 * r, r, 0.0, 8.0 * r] {
                for pose in walk(&mut rng, 1.6 * size, step, 60) {
                    let views = [ScanView::new(&a, &Pose::IDENTITY), ScanView::new(&b, &pose)];
                    let cold = collide(&views[0], &views[1], &plan, &Budget::UNLIMITED);
                    let warm = collide_hinted(
                        &views[0],
                        &views[1],
                        &plan,
                        &Budget::UNLIMITED,
                        &mut hint,
                        &mut scratch,
                    );
                    assert_eq!(
                        kind(&cold.verdict).0,
                        kind(&warm.verdict).0,
                        "{cloud:?} {options:?} {step}: {cold:?} {warm:?}"
                    );
                    seen[usize::from(kind(&cold.verdict).0)] += 1;
                    skipped += usize::from(warm.statistics.node_pairs == 0 && warm.verdict.is_separated());
                    if let (Verdict::Separated { gap: exact, .. }, Semantics::Thickened(_)) =
                        (cold.verdict, options.semantics)
                        && let Verdict::Separated { gap, .. } = warm.verdict
                    {
                        // Both are lower bounds of the distance of balls.
                        let least = least_distance(&views) - 0.6 * r;
                        assert!(gap.max(exact) <= least.max(0.0) + 1e-9 * size, "{gap} {exact} {least}");
                    }
                }
            }
        }
    }
    assert!(seen[0] > 1000 && seen[1] > 3000, "{seen:?}");
    assert!(skipped > 1000, "{skipped} answers came without any search");
}

/// The least distance of any two points.
fn least_distance([a, b]: &[ScanView<'_>; 2]) -> f64 {
    let points = |view: &ScanView<'_>| (0..view.scan().len()).map(|i| view.point(i)).collect::<Vec<_>>();
    let (of_a, of_b) = (points(a), points(b));
    let square = |p: &[f64; 3], q: &[f64; 3]| (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>();
    of_a.iter().flat_map(|p| of_b.iter().map(move |q| square(p, q))).fold(f64::INFINITY, f64::min).sqrt()
}

#[test]
fn a_hint_for_something_else_is_none() {
    let mut rng = arbitrary::rng(5);
    let scans: Vec<PointHierarchy> = (0..4_u32)
        .map(|n| prepared(&arbitrary::cloud(CloudKind::Sphere, 300 + 40 * n, u64::from(n))))
        .collect();
    let size = scans[0].bounds().half_extents()[0];
    let mut hint = PairHint::default();
    let mut scratch = CollideScratch::default();
    let mut hits = 0;
    for round in 0..600 {
        let (a, b) = (&scans[round % 4], &scans[(round / 3) % 4]);
        let margin = [0.0, 0.02 * size][round % 2];
        let options = CollideOptions::default().with_detail(Detail::Verdict).with_margin(margin);
        let plan = CollidePlan::new(&options, a, b).unwrap();
        let shift = arbitrary::point_in(&mut rng, 2.0 * size);
        let scale = [1.0, 1.01][(round / 5) % 2];
        let (pose_a, pose_b) = (Pose::IDENTITY.with_scale(scale), Pose::from_translation(shift));
        let views = [ScanView::new(a, &pose_a), ScanView::new(b, &pose_b)];
        let cold = collide(&views[0], &views[1], &plan, &Budget::UNLIMITED).verdict;
        let warm =
            collide_hinted(&views[0], &views[1], &plan, &Budget::UNLIMITED, &mut hint, &mut scratch).verdict;
        assert_eq!(kind(&cold).0, kind(&warm).0, "round {round}");
        hits += usize::from(cold.is_intersecting());
    }
    assert!((100..500).contains(&hits), "{hits} of 600");
}

#[test]
fn small_steps_cost_less_than_half() {
    let mut rng = arbitrary::rng(8);
    let scan = prepared(&arbitrary::cloud(CloudKind::Sphere, 5000, 3));
    let size = scan.bounds().half_extents()[0];
    let plan =
        CollidePlan::new(&CollideOptions::default().with_detail(Detail::Verdict), &scan, &scan).unwrap();
    let (mut cold, mut warm) = (0, 0);
    for _ in 0..20 {
        let mut hint = PairHint::default();
        let mut scratch = CollideScratch::default();
        let start = arbitrary::unit_vector(&mut rng);
        let step = 0.1 * scan.sampling_radius();
        for i in 0..400_u32 {
            let away = 2.0 * size + step * (f64::from(i) - 200.0);
            let pose = Pose::from_translation(start.map(|x| x * away));
            let views = [ScanView::new(&scan, &Pose::IDENTITY), ScanView::new(&scan, &pose)];
            cold += collide(&views[0], &views[1], &plan, &Budget::UNLIMITED).statistics.node_pairs;
            let answer =
                collide_hinted(&views[0], &views[1], &plan, &Budget::UNLIMITED, &mut hint, &mut scratch);
            warm += answer.statistics.node_pairs;
        }
    }
    assert!(2 * warm < cold, "{warm} node pairs with hints, {cold} without");
}

#[test]
fn a_hint_survives_being_saved() {
    let scan = prepared(&arbitrary::cloud(CloudKind::Sphere, 1000, 3));
    let plan = CollidePlan::new(&CollideOptions::default(), &scan, &scan).unwrap();
    let mut hint = PairHint::default();
    let mut scratch = CollideScratch::default();
    for i in 0..50_u32 {
        let pose = Pose::from_translation([2.2 - 0.01 * f64::from(i), 0.1, 0.0]);
        let views = [ScanView::new(&scan, &Pose::IDENTITY), ScanView::new(&scan, &pose)];
        let mut copy: PairHint = serde_json::from_str(&serde_json::to_string(&hint).unwrap()).unwrap();
        let one = collide_hinted(&views[0], &views[1], &plan, &Budget::UNLIMITED, &mut hint, &mut scratch);
        let other = collide_hinted(&views[0], &views[1], &plan, &Budget::UNLIMITED, &mut copy, &mut scratch);
        assert_eq!(one, other, "step {i}");
    }
}

/// What stands in a hint that was read from somewhere must not lead out of the arrays.
#[test]
fn foreign_nodes_in_a_hint_do_not_panic() {
    let scan = prepared(&arbitrary::cloud(CloudKind::Sphere, 1000, 3));
    let plan = CollidePlan::new(&CollideOptions::default(), &scan, &scan).unwrap();
    let mut scratch = CollideScratch::default();
    for away in [1.5, 2.1] {
        let pose = Pose::from_translation([away, 0.0, 0.0]);
        let views = [ScanView::new(&scan, &Pose::IDENTITY), ScanView::new(&scan, &pose)];
        let mut hint = PairHint::default();
        let cold = collide_hinted(&views[0], &views[1], &plan, &Budget::UNLIMITED, &mut hint, &mut scratch);
        let mut value = serde_json::to_value(&hint).unwrap();
        for id in [1_u32, 200_000, u32::MAX] {
            if let Some(met) = value["met"].as_object_mut() {
                met.insert("a".into(), id.into());
            }
            for standing in value["front"].as_array_mut().unwrap() {
                standing["until"] = (-1.0).into();
                standing["pair"]["b"] = id.into();
            }
            value["clear"] = (-1.0).into();
            let mut foreign: PairHint = serde_json::from_value(value.clone()).unwrap();
            let answer =
                collide_hinted(&views[0], &views[1], &plan, &Budget::UNLIMITED, &mut foreign, &mut scratch);
            // Ids that exist may stand for other parts of the scan; those that do not begin anew.
            if id > 1 {
                assert_eq!(kind(&answer.verdict).0, kind(&cold.verdict).0, "{away} {id}");
            }
        }
    }
}
