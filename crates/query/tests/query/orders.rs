//! Orders, coverings, resolutions and test points: the same verdicts with other methods.
use std::time::Duration;

use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
use nearmiss_query::{
    Answer, Budget, CollideOptions, CollidePlan, Detail, Evidence, Method, Order, Pacer, Pair, Placed,
    PlanError, Reason, Sampling, Scratch, Semantics, Verdict,
};
use nearmiss_testdata::arbitrary::{self, CloudKind};

const ORDERS: [Order; 5] = [Order::DepthFirst, Order::Overlap, Order::Sides, Order::SidesByGap, Order::Cells];

fn prepared(points: &[[f64; 3]]) -> PointHierarchy {
    let leaf = BuildOptions::default().with_leaf_size(8);
    PointHierarchy::build(&PointCloud::from_positions(points).unwrap(), &leaf).unwrap()
}

fn sphere(count: u32) -> PointHierarchy {
    prepared(&arbitrary::cloud(CloudKind::Sphere, count, 7))
}

fn ask(
    a: &PointHierarchy,
    b: &PointHierarchy,
    pose: &Pose,
    options: &CollideOptions,
    budget: &Budget,
) -> Answer {
    let plan = CollidePlan::new(options, a, b).unwrap();
    Pair::new(Placed::new(a, &Pose::IDENTITY), Placed::new(b, pose))
        .within(budget)
        .collide(&plan, &mut Scratch::default())
}

fn kind(verdict: &Verdict) -> u8 {
    match verdict {
        Verdict::Intersecting { .. } => 0,
        Verdict::Separated { .. } => 1,
        Verdict::Undecided(_) => 2,
    }
}

#[test]
fn orders_and_coverings_change_no_verdict() {
    let mut rng = arbitrary::rng(3);
    let kinds =
        [CloudKind::Sphere, CloudKind::Lattice, CloudKind::Clustered, CloudKind::Rings, CloudKind::Outlier];
    let mut seen = [0; 3];
    for (n, cloud) in (0_u64..).zip(kinds) {
        let a = prepared(&arbitrary::cloud(cloud, 500, n));
        let b = prepared(&arbitrary::cloud(cloud, 400, n + 9));
        let size = a.bounds().half_extents().into_iter().fold(0.0, f64::max);
        for round in 0..60 {
            let pose = arbitrary::rotation(&mut rng)
                .with_translation(arbitrary::point_in(&mut rng, 2.5 * size))
                .with_scale([1.0, 0.6][round % 2]);
            let margin = [0.0, 0.05 * size][round / 30];
            let base = CollideOptions::estimated()
                .with_detail([Detail::Verdict, Detail::Witness][round % 2])
                .with_margin(margin);
            let certified = base.with_evidence(Evidence::Certified);
            let expected = ask(&a, &b, &pose, &base, &Budget::UNLIMITED).verdict;
            let proven = ask(&a, &b, &pose, &certified, &Budget::UNLIMITED).verdict;
            seen[usize::from(kind(&expected))] += 1;
            for order in ORDERS {
                for coverings in [false, true] {
                    let options = base.with_order(order).with_coverings(coverings);
                    let verdict = ask(&a, &b, &pose, &options, &Budget::UNLIMITED).verdict;
                    assert_eq!(kind(&verdict), kind(&expected), "{cloud:?} {round} {options:?}");
                    let options = options.with_evidence(Evidence::Certified);
                    let verdict = ask(&a, &b, &pose, &options, &Budget::UNLIMITED).verdict;
                    let is_proven = |verdict: &Verdict| {
                        matches!(verdict, Verdict::Separated { evidence: Evidence::Certified, .. })
                    };
                    // Coverings may separate leaves whose boxes overlap, which then need not be
                    // compared.
                    assert!(is_proven(&verdict) || !is_proven(&proven), "{cloud:?} {round} {options:?}");
                }
            }
        }
    }
    assert!(seen[0] > 40 && seen[1] > 40, "{seen:?}");
}

#[test]
fn work_budgets_are_reproducible_in_every_order() {
    let scan = sphere(3000);
    let mut rng = arbitrary::rng(9);
    let mut scratch = Scratch::default();
    let mut unfinished = 0;
    for _ in 0..40 {
        let pose = Pose::from_translation(arbitrary::unit_vector(&mut rng).map(|x| 1.98 * x));
        for order in ORDERS {
            let options = CollideOptions::estimated().with_order(order);
            let plan = CollidePlan::new(&options, &scan, &scan).unwrap();
            let views = [Placed::new(&scan, &Pose::IDENTITY), Placed::new(&scan, &pose)];
            for work in [0, 1, 7, 60, 500] {
                let budget = Budget::UNLIMITED.with_work(work);
                let fresh =
                    Pair::new(views[0], views[1]).within(&budget).collide(&plan, &mut Scratch::default());
                let used = Pair::new(views[0], views[1]).within(&budget).collide(&plan, &mut scratch);
                assert_eq!(fresh, used, "{order:?} {work}");
                let spent = fresh.statistics.evaluations + fresh.statistics.node_pairs;
                assert!(spent <= work + 40, "{spent} of {work}");
                if let Verdict::Undecided(Reason::Budget { likelihood }) = fresh.verdict {
                    assert!((0.0..=1.0).contains(&likelihood), "{likelihood}");
                    unfinished += 1;
                }
            }
        }
    }
    assert!(unfinished > 200, "{unfinished}");
}

#[test]
fn a_resolution_saves_work_and_errs_towards_contact() {
    let scan = sphere(20_000);
    let r = scan.sampling_radius();
    let options = CollideOptions::estimated().with_detail(Detail::Verdict);
    let mut before = u64::MAX;
    for times in [0.0, 2.0, 4.0, 8.0, 16.0] {
        let budget = Budget::UNLIMITED.with_resolution(times * r);
        let mut pairs = 0;
        for (gap, meets) in [(-4.0 * r, true), (-0.5, true), (4.0 * times * r + 2.0 * r, false)] {
            let pose = Pose::from_axis_angle([1.0, 2.0, 0.5], 0.4).with_translation([0.0, 2.0 + gap, 0.0]);
            let answer = ask(&scan, &scan, &pose, &options, &budget);
            assert_eq!(kind(&answer.verdict), u8::from(!meets), "gap {gap} at {times} r: {answer:?}");
            pairs += answer.statistics.node_pairs;
        }
        assert!(pairs <= before, "{pairs} node pairs at {times} r, {before} at a finer resolution");
        before = pairs;
    }
    assert!(before < 60, "{before} at the coarsest");
    // No node is finer than resolution 0; every node is finer than 1e3.
    let pose = Pose::from_translation([0.0, 2.3, 0.0]);
    let fine = ask(&scan, &scan, &pose, &options, &Budget::UNLIMITED.with_resolution(0.0));
    let whole = ask(&scan, &scan, &pose, &options, &Budget::UNLIMITED);
    assert_eq!(kind(&fine.verdict), kind(&whole.verdict));
    let coarse = ask(&scan, &scan, &pose, &options, &Budget::UNLIMITED.with_resolution(1e3));
    assert!(coarse.statistics.node_pairs <= 1, "{coarse:?}");
}

#[test]
fn test_points_see_what_surfaces_do() {
    let scan = sphere(4000);
    let r = scan.sampling_radius();
    let base = CollideOptions::estimated().with_detail(Detail::Verdict);
    for flat in [false, true] {
        let sampling = Sampling::default().with_flat(flat);
        let options = base.with_method(Method::Sampling(sampling));
        for (gap, meets) in [(-0.6, true), (-2.0 * r, true), (2.0 * r, false), (0.5, false)] {
            let pose = Pose::from_axis_angle([0.3, 1.0, 0.5], 0.7).with_translation([2.0 + gap, 0.0, 0.0]);
            let answer = ask(&scan, &scan, &pose, &options, &Budget::UNLIMITED);
            assert_eq!(kind(&answer.verdict), u8::from(!meets), "flat {flat}, gap {gap}: {answer:?}");
            if let Verdict::Intersecting { contact, evidence } = answer.verdict {
                assert_eq!(evidence, Evidence::Estimated);
                let away =
                    |c: [f64; 3]| (0..3).map(|k| (contact.point[k] - c[k]).powi(2)).sum::<f64>().sqrt() - 1.0;
                let off = away([0.0; 3]).abs().max(away([2.0 + gap, 0.0, 0.0]).abs());
                assert!(off <= 0.5 * r, "{off} off, r {r}");
                assert!(answer.distance_estimate.unwrap() < 0.4 * r, "{answer:?}");
            } else if let Some(estimate) = answer.distance_estimate {
                assert!(estimate >= 0.4 * r && estimate >= gap - 0.2 * r, "{answer:?}");
            }
        }
    }
    // Without volumes nothing is proven, not even at a large distance; with volumes it is.
    for (flat, away, proven) in [(true, 3.0, false), (false, 3.0, true), (true, 2.1, false)] {
        let sampling = Sampling::default().with_flat(flat);
        let options = base.with_method(Method::Sampling(sampling)).with_evidence(Evidence::Certified);
        let verdict =
            ask(&scan, &scan, &Pose::from_translation([away, 0.0, 0.0]), &options, &Budget::UNLIMITED)
                .verdict;
        let Verdict::Separated { gap, evidence } = verdict else { panic!("{verdict:?}") };
        assert_eq!(evidence == Evidence::Certified, proven, "flat {flat}, {away}");
        assert!(gap <= away - 2.0 + 1e-6 && (gap > 0.0) == proven, "{gap}");
    }
    // A witness from a test point is verified.
    let options = CollideOptions::estimated().with_method(Method::Sampling(Sampling::default()));
    let pose = Pose::from_translation([1.5, 0.0, 0.0]);
    let answer = ask(&scan, &scan, &pose, &options, &Budget::UNLIMITED);
    assert!(
        matches!(answer.verdict, Verdict::Intersecting { evidence: Evidence::Certified, .. }),
        "{answer:?}"
    );
}

#[test]
fn test_points_depend_on_seed_and_leaves_alone() {
    let scan = sphere(2000);
    let r = scan.sampling_radius();
    // Nothing is found, so every order tests every leaf pair.
    let pose = Pose::from_translation([2.0 + 0.3 * r, 0.0, 0.0]);
    let estimate = |order, seed| {
        let sampling = Sampling::default().with_seed(seed).with_tolerance(0.1);
        let options = CollideOptions::estimated().with_method(Method::Sampling(sampling)).with_order(order);
        ask(&scan, &scan, &pose, &options, &Budget::UNLIMITED).distance_estimate
    };
    let first = estimate(Order::DepthFirst, 1);
    assert!(first.is_some_and(|d| d > 0.1 * r && d < 2.0 * r), "{first:?}, r {r}");
    assert_eq!(first, estimate(Order::Overlap, 1), "another order");
    assert_ne!(first, estimate(Order::DepthFirst, 2), "another seed");
}

#[test]
fn what_cannot_be_sampled_is_refused() {
    let scan = sphere(100);
    let method = |sampling| CollideOptions::estimated().with_method(Method::Sampling(sampling));
    let refused = |options: CollideOptions| CollidePlan::new(&options, &scan, &scan).unwrap_err();
    let plain = Sampling::default();
    assert_eq!(refused(method(plain.with_test_points(0))), PlanError::TestPoints(0));
    assert_eq!(refused(method(plain.with_test_points(65_537))), PlanError::TestPoints(65_537));
    for tolerance in [0.0, -1.0, 4.1] {
        assert_eq!(refused(method(plain.with_tolerance(tolerance))), PlanError::Tolerance(tolerance));
    }
    assert!(matches!(refused(method(plain.with_tolerance(f64::NAN))), PlanError::Tolerance(_)));
    assert_eq!(refused(method(plain).with_margin(0.1)), PlanError::SamplingAlone);
    assert_eq!(refused(method(plain).with_semantics(Semantics::Thickened(0.1))), PlanError::SamplingAlone);
}

#[test]
fn ended_searches_by_test_points_are_as_likely_to_hit_as_what_they_leave_open() {
    let scan = sphere(3000);
    // The scans overlap deeply, but no test point is near enough to both.
    let pose = Pose::from_translation([1.0, 0.1, 0.0]);
    for flat in [false, true] {
        let sampling = Sampling::default().with_flat(flat).with_tolerance(1e-9);
        let options = CollideOptions::estimated().with_method(Method::Sampling(sampling));
        for work in [0, 10, 100, 1000] {
            let answer = ask(&scan, &scan, &pose, &options, &Budget::UNLIMITED.with_work(work));
            let Verdict::Undecided(Reason::Budget { likelihood }) = answer.verdict else {
                panic!("{answer:?}")
            };
            assert!(likelihood > 0.8, "flat {flat}, work {work}: {likelihood}");
        }
    }
}

#[test]
fn paces_that_are_none_are_mended() {
    let scan = sphere(1000);
    let r = scan.sampling_radius();
    let options = CollideOptions::estimated().with_method(Method::Sampling(Sampling::default()));
    let plan = CollidePlan::new(&options, &scan, &scan).unwrap();
    let apart = Pose::from_translation([2.0 + 2.0 * r, 0.0, 0.0]);
    let views = [Placed::new(&scan, &Pose::IDENTITY), Placed::new(&scan, &apart)];
    let plain = Sampling::default();
    for target in [Duration::ZERO, Duration::from_secs(1), Duration::MAX] {
        for test_points in [0, 128, u32::MAX] {
            for tolerance in [0.4, 0.0, -1.0, f64::NAN] {
                let sampling = plain.with_test_points(test_points).with_tolerance(tolerance);
                let mut pacer = Pacer::new(target).with_sampling(sampling);
                for _ in 0..2 {
                    if pacer.sampling().test_points > 1000 && !target.is_zero() {
                        break;
                    }
                    let pair = Pair::new(views[0], views[1]);
                    let answer = pacer.pace(&plan, |plan, budget| {
                        pair.within(budget).collide(plan, &mut Scratch::default())
                    });
                    assert!(!answer.verdict.is_intersecting(), "{target:?} {sampling:?} {answer:?}");
                }
                let Sampling { test_points, tolerance, .. } = pacer.sampling();
                assert!((8..=65_536).contains(&test_points) && (0.1..=1.0).contains(&tolerance), "{pacer:?}");
            }
        }
    }
}

#[test]
fn closer_looks_do_not_use_up_what_damaged_files_are_allowed() {
    let cloud = PointCloud::from_positions(&arbitrary::cloud(CloudKind::Coplanar, 400, 1)).unwrap();
    let build = BuildOptions::default().with_leaf_size(4).with_samples(32);
    let scan = PointHierarchy::build(&cloud, &build).unwrap();
    let margin = scan.sampling_radius();
    // Parallel to itself, just out of reach: thousands of node pairs and no contact.
    let height = 1.02 * margin / f64::sqrt(0.09 + 0.49 + 1.0);
    let pose = Pose::from_translation([0.3, -0.7, -1.0].map(|x| x * height));
    let options = CollideOptions::estimated().with_margin(margin);
    for order in ORDERS {
        let answer = ask(&scan, &scan, &pose, &options.with_order(order), &Budget::UNLIMITED);
        assert!(answer.verdict.is_separated(), "{order:?}: {answer:?}");
    }
}

#[test]
fn no_resolution_misses_what_meets() {
    let mut rng = arbitrary::rng(17);
    let kinds =
        [CloudKind::Sphere, CloudKind::Lattice, CloudKind::Clustered, CloudKind::Rings, CloudKind::Random];
    let (mut met, mut erred) = (0, 0);
    for (n, cloud) in (0_u64..).zip(kinds) {
        let a = prepared(&arbitrary::cloud(cloud, 700, n));
        let b = prepared(&arbitrary::cloud(cloud, 300, n + 30));
        let size = a.bounds().half_extents().into_iter().fold(0.0, f64::max);
        for round in 0..120 {
            let pose = arbitrary::rotation(&mut rng)
                .with_translation(arbitrary::point_in(&mut rng, 2.5 * size))
                .with_scale([1.0, 0.3][round % 2]);
            let options = CollideOptions::estimated().with_detail(Detail::Verdict);
            let fine = ask(&a, &b, &pose, &options, &Budget::UNLIMITED).verdict;
            for times in [0.5, 2.0, 5.0, 20.0] {
                let budget = Budget::UNLIMITED.with_resolution(times * a.sampling_radius());
                let coarse = ask(&a, &b, &pose, &options, &budget).verdict;
                if fine.is_intersecting() {
                    met += 1;
                    assert!(coarse.is_intersecting(), "{cloud:?} {round} at {times} r: {coarse:?}");
                } else {
                    erred += usize::from(coarse.is_intersecting());
                }
            }
        }
    }
    assert!(met > 300 && erred > 20, "{met} meet, {erred} seem to");
}

/// The likelihood after one unit of work, from the two root boxes alone.
fn first_guess(a: &PointHierarchy, b: &PointHierarchy, pose: &Pose) -> f64 {
    let budget = Budget::UNLIMITED.with_work(1);
    let answer = ask(a, b, pose, &CollideOptions::estimated().with_detail(Detail::Verdict), &budget);
    let Verdict::Undecided(Reason::Budget { likelihood }) = answer.verdict else { panic!("{answer:?}") };
    likelihood
}

/// Squares of 2 × 2 at these heights, with points 0.1 apart.
fn shelves(heights: &[f64]) -> Vec<[f64; 3]> {
    let along = |i: i32| 0.1 * f64::from(i);
    let square = |z: f64| {
        (-10..=10).flat_map(move |i| (-10..=10).map(move |j| [along(i), along(j), z])).collect::<Vec<_>>()
    };
    heights.iter().flat_map(|&z| square(z)).collect()
}

#[test]
fn a_likelihood_counts_what_boxes_hold() {
    let hall = prepared(&shelves(&[-1.0, 1.0]));
    let shop = prepared(&shelves(&[-1.0, -0.6, -0.2, 0.2, 0.6, 1.0]));
    let ball = sphere(300);
    let size = ball.bounds().half_extents()[0];
    let mut likelihoods = [0.0; 2];
    for z in [-0.8, -0.4, 0.0, 0.4, 0.8] {
        let pose = Pose::from_translation([0.1, 0.1, z]).with_scale(0.15 / size);
        for (sum, scan) in likelihoods.iter_mut().zip([&hall, &shop]) {
            *sum += first_guess(scan, &ball, &pose) / 5.0;
        }
    }
    let [empty, full] = likelihoods;
    assert!(empty + 0.05 < full && full < 0.9, "{empty} in a hall, {full} in a shop");
}

#[test]
fn a_likelihood_knows_neither_units_nor_sides() {
    let (a, b) = (prepared(&shelves(&[-0.5, 0.5])), sphere(300));
    let points: Vec<[f64; 3]> = shelves(&[-0.5, 0.5]).iter().map(|p| p.map(|x| 1024.0 * x)).collect();
    let large = prepared(&points);
    let mut rng = arbitrary::rng(5);
    for _ in 0..20 {
        let at = arbitrary::point_in(&mut rng, 0.4);
        let pose = arbitrary::rotation(&mut rng).with_scale(0.3).with_translation(at);
        let own = first_guess(&a, &b, &pose);
        let swapped = first_guess(&b, &a, &pose.inverse());
        let pose = pose.with_scale(0.3 * 1024.0).with_translation(at.map(|x| 1024.0 * x));
        let scaled = first_guess(&large, &b, &pose);
        assert!((own - swapped).abs() < 1e-3 && (own - scaled).abs() < 1e-3, "{own} {swapped} {scaled}");
    }
}
