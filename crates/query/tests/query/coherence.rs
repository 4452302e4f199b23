//! Hints: the same verdicts as without, at lower cost.
use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
use nearmiss_query::{
    Answer, Budget, CollideOptions, CollidePlan, Detail, Evidence, Method, Order, Pair, PairHint, Placed,
    Reason, Sampling, Scratch, Semantics, Verdict,
};
use nearmiss_testdata::arbitrary::{self, CloudKind};

fn prepared(points: &[[f64; 3]]) -> PointHierarchy {
    let leaf = BuildOptions::default().with_leaf_size(8);
    PointHierarchy::build(&PointCloud::from_positions(points).unwrap(), &leaf).unwrap()
}

/// A random walk of b past and through a, in shifts and turns of about `step`, drawn back if it
/// gets far away.
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
    let (mut seen, mut skipped, mut proven, mut evident) = ([0; 3], 0, 0, [0; 2]);
    for (n, cloud) in (0_u64..).zip(&kinds) {
        let a = prepared(&arbitrary::cloud(*cloud, 400, n));
        let b = prepared(&arbitrary::cloud(*cloud, 300, n + 50));
        let size = a.bounds().half_extents().into_iter().fold(0.0, f64::max);
        let r = a.sampling_radius();
        let base = CollideOptions::estimated().with_detail(Detail::Verdict);
        let surfaces = base.with_semantics(Semantics::Surface);
        let questions = [
            base,
            base.with_order(Order::Overlap),
            base.with_margin(r),
            base.with_evidence(Evidence::Certified),
            surfaces,
            surfaces.with_evidence(Evidence::Certified),
            base.with_evidence(Evidence::Certified).with_margin(0.5 * r),
            base.with_semantics(Semantics::Thickened(0.3 * r)),
        ];
        for options in questions {
            let plan = CollidePlan::new(&options, &a, &b).unwrap();
            let mut hint = PairHint::default();
            let mut scratch = Scratch::default();
            for step in [0.02 * r, 0.1 * r, r, 0.0, 8.0 * r] {
                for pose in walk(&mut rng, 1.6 * size, step, 60) {
                    let views = [Placed::new(&a, &Pose::IDENTITY), Placed::new(&b, &pose)];
                    let cold = Pair::new(views[0], views[1]).collide(&plan, &mut Scratch::default());
                    let warm = Pair::new(views[0], views[1]).hinted(&mut hint).collide(&plan, &mut scratch);
                    assert_eq!(
                        kind(&cold.verdict).0,
                        kind(&warm.verdict).0,
                        "{cloud:?} {options:?} {step}: {cold:?} {warm:?}"
                    );
                    let of_points = matches!(options.semantics, Semantics::Thickened(_));
                    if let Verdict::Separated { gap, evidence: Evidence::Certified } = warm.verdict
                        && !of_points
                    {
                        // Enclosures contain the points.
                        let least = least_distance(&views);
                        assert!(
                            gap <= least && options.evidence == Evidence::Certified,
                            "{cloud:?} {options:?}: {gap} {least}"
                        );
                        proven += 1;
                    }
                    if !of_points {
                        let differs = usize::from(kind(&cold.verdict).1 != kind(&warm.verdict).1);
                        evident[usize::from(options.semantics == Semantics::Obstacle)] += differs;
                    }
                    seen[usize::from(kind(&cold.verdict).0)] += 1;
                    skipped += usize::from(warm.statistics.node_pairs == 0 && warm.verdict.is_separated());
                    if let (Verdict::Separated { gap: exact, .. }, Semantics::Thickened(_)) =
                        (cold.verdict, options.semantics)
                        && let Verdict::Separated { gap, .. } = warm.verdict
                    {
                        // Both are lower bounds of the distance of the balls.
                        let least = least_distance(&views) - 0.6 * r;
                        assert!(gap.max(exact) <= least.max(0.0) + 1e-9 * size, "{gap} {exact} {least}");
                    }
                }
            }
        }
    }
    assert!(seen[0] > 500 && seen[1] > 1500, "{seen:?}");
    assert!(skipped > 500, "{skipped} answers came without any search");
    assert!(proven > 1000, "{proven} separations were certified");
    // The enclosures of two nodes may be disjoint even if those of two of their children are not
    // proven to be.
    assert!(evident.iter().sum::<usize>() * 500 < proven, "the evidence of {evident:?} of {proven} differs");
}

/// The least distance of any two points.
fn least_distance([a, b]: &[Placed<'_>; 2]) -> f64 {
    let points = |view: &Placed<'_>| (0..view.scan().len()).map(|i| view.point(i)).collect::<Vec<_>>();
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
    let mut scratch = Scratch::default();
    let mut hits = 0;
    for round in 0..600 {
        let (a, b) = (&scans[round % 4], &scans[(round / 3) % 4]);
        let margin = [0.0, 0.02 * size][round % 2];
        let options = CollideOptions::estimated().with_detail(Detail::Verdict).with_margin(margin);
        let plan = CollidePlan::new(&options, a, b).unwrap();
        let shift = arbitrary::point_in(&mut rng, 2.0 * size);
        let scale = [1.0, 1.01][(round / 5) % 2];
        let (pose_a, pose_b) = (Pose::IDENTITY.with_scale(scale), Pose::from_translation(shift));
        let views = [Placed::new(a, &pose_a), Placed::new(b, &pose_b)];
        let cold = Pair::new(views[0], views[1]).collide(&plan, &mut Scratch::default()).verdict;
        let warm = Pair::new(views[0], views[1]).hinted(&mut hint).collide(&plan, &mut scratch).verdict;
        assert_eq!(kind(&cold).0, kind(&warm).0, "round {round}");
        hits += usize::from(cold.is_intersecting());
    }
    assert!((100..500).contains(&hits), "{hits} of 600");
}

#[test]
fn small_steps_cost_less_than_half() {
    let scan = prepared(&arbitrary::cloud(CloudKind::Sphere, 5000, 3));
    let size = scan.bounds().half_extents()[0];
    for evidence in [Evidence::Estimated, Evidence::Certified] {
        let mut rng = arbitrary::rng(8);
        let options = CollideOptions::estimated().with_detail(Detail::Verdict).with_evidence(evidence);
        let plan = CollidePlan::new(&options, &scan, &scan).unwrap();
        let (mut cold, mut warm) = (0, 0);
        for _ in 0..20 {
            let mut hint = PairHint::default();
            let mut scratch = Scratch::default();
            let start = arbitrary::unit_vector(&mut rng);
            let step = 0.1 * scan.sampling_radius();
            for i in 0..400_u32 {
                let away = 2.0 * size + step * (f64::from(i) - 200.0);
                let pose = Pose::from_translation(start.map(|x| x * away));
                let views = [Placed::new(&scan, &Pose::IDENTITY), Placed::new(&scan, &pose)];
                cold += Pair::new(views[0], views[1])
                    .collide(&plan, &mut Scratch::default())
                    .statistics
                    .node_pairs;
                let answer = Pair::new(views[0], views[1]).hinted(&mut hint).collide(&plan, &mut scratch);
                warm += answer.statistics.node_pairs;
            }
        }
        assert!(2 * warm < cold, "{evidence:?}: {warm} node pairs with hints, {cold} without");
    }
}

#[test]
fn a_copy_of_a_hint_knows_the_same() {
    let scan = prepared(&arbitrary::cloud(CloudKind::Sphere, 1000, 3));
    let plan = CollidePlan::new(&CollideOptions::estimated(), &scan, &scan).unwrap();
    let mut hint = PairHint::default();
    let mut scratch = Scratch::default();
    for i in 0..50_u32 {
        let pose = Pose::from_translation([2.2 - 0.01 * f64::from(i), 0.1, 0.0]);
        let views = [Placed::new(&scan, &Pose::IDENTITY), Placed::new(&scan, &pose)];
        let mut copy = hint.clone();
        let one = Pair::new(views[0], views[1]).hinted(&mut hint).collide(&plan, &mut scratch);
        let other = Pair::new(views[0], views[1]).hinted(&mut copy).collide(&plan, &mut scratch);
        assert_eq!(one, other, "step {i}");
    }
}

/// A flat square of irregular points, about 1 apart.
fn plate(side: u32) -> Vec<[f64; 3]> {
    let mut rng = arbitrary::rng(4);
    let mut point = |i: u32| {
        let [x, y, _] = arbitrary::point_in(&mut rng, 0.2);
        [f64::from(i % side) + x, f64::from(i / side) + y, 0.0]
    };
    (0..side * side).map(&mut point).collect()
}

/// Answers without a hint and with one.
fn both(
    scans: [&PointHierarchy; 2],
    poses: [Pose; 2],
    options: &CollideOptions,
    budget: &Budget,
    hint: &mut PairHint,
) -> [Answer; 2] {
    let plan = CollidePlan::new(options, scans[0], scans[1]).unwrap();
    let [a, b] = [0, 1].map(|k: usize| Placed::new(scans[k], &poses[k]));
    let cold = Pair::new(a, b).within(budget).collide(&plan, &mut Scratch::default());
    [cold, Pair::new(a, b).within(budget).hinted(hint).collide(&plan, &mut Scratch::default())]
}

fn lifted(height: f64) -> [Pose; 2] {
    [Pose::IDENTITY, Pose::from_translation([0.3, 0.2, height])]
}

#[test]
fn a_hint_certifies_nothing_that_was_not_proven() {
    let scan = prepared(&plate(20));
    let r = scan.sampling_radius();
    let options = CollideOptions::estimated().with_evidence(Evidence::Certified);
    let mut seen = [0; 2];
    for step in 1..20 {
        // The boxes of discs become disjoint long before the enclosures do.
        let poses = lifted(0.1 * f64::from(step) * r);
        let mut hint = PairHint::default();
        for _ in 0..3 {
            let [cold, warm] = both([&scan; 2], poses, &options, &Budget::UNLIMITED, &mut hint);
            assert_eq!(kind(&cold.verdict), kind(&warm.verdict), "step {step}: {cold:?} {warm:?}");
            seen[usize::from(kind(&cold.verdict).1)] += 1;
        }
    }
    assert!(seen[0] > 10 && seen[1] > 10, "{seen:?}");
}

#[test]
fn test_points_see_the_same_with_a_hint() {
    let scan = prepared(&plate(20));
    let r = scan.sampling_radius();
    let method = Method::Sampling(Sampling::default());
    let mut seen = [0; 3];
    for coverings in [false, true] {
        let base = CollideOptions::estimated().with_detail(Detail::Verdict).with_method(method);
        let options = base.with_coverings(coverings);
        let mut hint = PairHint::default();
        for step in 0..100 {
            let turn = Pose::from_axis_angle([1.0, 0.3, 0.0], 0.002 * f64::from(step % 7));
            let poses =
                [Pose::IDENTITY, turn.with_translation([0.3, 0.2, 0.4 * r * (0.2 * f64::from(step)).sin()])];
            let [cold, warm] = both([&scan; 2], poses, &options, &Budget::UNLIMITED, &mut hint);
            assert_eq!(cold, warm, "step {step}, coverings {coverings}");
            seen[usize::from(kind(&cold.verdict).0)] += 1;
        }
    }
    assert!(seen[0] > 20 && seen[1] > 20, "{seen:?}");
}

#[test]
fn far_from_the_origin_a_hint_knows_no_better() {
    let scan = prepared(&plate(20));
    let options = CollideOptions::estimated().with_margin(0.5).with_detail(Detail::Verdict);
    let mut rounded = 0;
    for away in [0.0, 2.0_f64.powi(40), 2.0_f64.powi(45)] {
        for step in 1..30 {
            let gap = 0.5 + f64::from(step) / 64.0;
            let poses = [[0.0; 3], [0.0, 0.0, gap]].map(Pose::from_translation);
            let mut hint = PairHint::default();
            let [near, _] = both([&scan; 2], poses, &options, &Budget::UNLIMITED, &mut hint);
            // The same motion, but poses this far out are rounded.
            let poses = [[away, 0.0, 0.0], [away, 0.0, gap]].map(Pose::from_translation);
            let [cold, warm] = both([&scan; 2], poses, &options, &Budget::UNLIMITED, &mut hint);
            assert_eq!(kind(&cold.verdict), kind(&warm.verdict), "gap {gap} {away} away");
            rounded += u32::from(kind(&near.verdict) != kind(&cold.verdict));
        }
    }
    assert!(rounded > 5, "{rounded} verdicts differ far out");
}

#[test]
fn a_scan_of_which_a_point_moved_is_another() {
    let finger: Vec<_> = plate(4).iter().map(|p| p.map(|x| (x - 1.5) * 1e-4)).collect();
    let finger = prepared(&finger);
    let options = CollideOptions::estimated().with_semantics(Semantics::Thickened(0.001));
    let points = arbitrary::cloud(CloudKind::Coplanar, 1000, 1);
    let scan = prepared(&points);
    let mut hits = 0;
    for i in (0..points.len()).step_by(20) {
        let mut moved = points.clone();
        moved[i] = moved[i].map(|x| 0.9 * x);
        let poses = [Pose::from_translation(moved[i]), Pose::IDENTITY];
        let moved = prepared(&moved);
        let mut hint = PairHint::default();
        both([&finger, &scan], poses, &options, &Budget::UNLIMITED, &mut hint);
        let [cold, warm] = both([&finger, &moved], poses, &options, &Budget::UNLIMITED, &mut hint);
        assert_eq!(kind(&cold.verdict), kind(&warm.verdict), "point {i}");
        hits += u32::from(cold.verdict.is_intersecting());
    }
    assert!(hits > 40, "{hits}");
}

#[test]
fn a_hinted_search_that_a_budget_ends_is_as_likely_to_hit_as_what_it_leaves_open() {
    let scan = prepared(&arbitrary::cloud(CloudKind::Sphere, 3000, 3));
    let mut hint = PairHint::default();
    let pose = |away: f64| [Pose::IDENTITY, Pose::from_translation([away, 0.1, 0.0])];
    let options = CollideOptions::estimated();
    both([&scan; 2], pose(2.05), &options, &Budget::UNLIMITED, &mut hint);
    let few = Budget::UNLIMITED.with_work(60);
    let [_, warm] = both([&scan; 2], pose(2.04), &options, &few, &mut hint);
    let Verdict::Undecided(Reason::Budget { likelihood }) = warm.verdict else { panic!("{warm:?}") };
    assert!(likelihood > 0.1, "{likelihood} where overlapping boxes are left");
}

#[test]
fn small_steps_count_after_a_leap() {
    let scan = prepared(&arbitrary::cloud(CloudKind::Sphere, 500, 3));
    let options = CollideOptions::estimated().with_detail(Detail::Verdict);
    let mut hint = PairHint::default();
    let near = Pose::from_translation([2.3, 0.0, 0.0]);
    both([&scan; 2], [Pose::IDENTITY, near], &options, &Budget::UNLIMITED, &mut hint);
    let mut hits = 0;
    for exponent in [20, 47, 48, 49, 50, 51, 52, 53, 58] {
        let large = Pose::IDENTITY.with_scale(2.0_f64.powi(exponent));
        both([&scan; 2], [Pose::IDENTITY, large], &options, &Budget::UNLIMITED, &mut hint);
        for step in 0..100 {
            let place = Pose::from_translation([2.6 - 0.01 * f64::from(step % 100), 0.0, 0.0]);
            let [cold, warm] =
                both([&scan; 2], [Pose::IDENTITY, place], &options, &Budget::UNLIMITED, &mut hint);
            assert_eq!(kind(&cold.verdict), kind(&warm.verdict), "step {step} after 2^{exponent}");
            hits += u32::from(cold.verdict.is_intersecting());
        }
    }
    assert!(hits > 100, "{hits}");
}

#[test]
fn far_from_the_origin_a_hint_proves_no_greater_distance() {
    let scan = prepared(&plate(20));
    let base = CollideOptions::estimated();
    let both_kinds =
        [base.with_semantics(Semantics::Thickened(0.0)), base.with_evidence(Evidence::Certified)];
    let mut without_search = 0;
    for options in both_kinds {
        for away in [0.0, 2.0_f64.powi(36), 2.0_f64.powi(40), 2.0_f64.powi(43)] {
            for step in 0..50 {
                let lift = [0.0, 0.0, 6.0 + 0.125 * f64::from(step)];
                let near = [[0.0; 3], lift].map(Pose::from_translation);
                let mut hint = PairHint::default();
                both([&scan; 2], near, &options, &Budget::UNLIMITED, &mut hint);
                // The same motion, exactly, except that poses this far out may have been rounded.
                let far = [[away, 0.0, 0.0], [away, 0.0, lift[2]]].map(Pose::from_translation);
                let [cold, warm] = both([&scan; 2], far, &options, &Budget::UNLIMITED, &mut hint);
                let gap = |answer: &Answer| match answer.verdict {
                    Verdict::Separated { gap, evidence: Evidence::Certified } => gap,
                    _ => panic!("{options:?}, {away} away: {answer:?}"),
                };
                assert!(gap(&warm) <= gap(&cold), "{options:?}, {away} away: {warm:?} {cold:?}");
                without_search += u32::from(warm.statistics.node_pairs == 0);
            }
        }
    }
    assert!(without_search > 300, "{without_search} answers came without any search");
}
