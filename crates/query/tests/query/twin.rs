//! Queries against brute force: every pair of discs, every pair of points.
use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_hierarchy::{BuildOptions, PointHierarchy, PointKind};
use nearmiss_query::{
    Answer, Budget, CollideOptions, CollidePlan, Detail, Evidence, Order, Pair, Placed, Reason, Scratch,
    Semantics, Verdict,
};
use nearmiss_testdata::arbitrary::{self, CloudKind};
use nearmiss_testdata::oracle;
use rand::RngExt;

fn prepared(points: &[[f64; 3]]) -> PointHierarchy {
    let leaf = BuildOptions::default().with_leaf_size(8);
    PointHierarchy::build(&PointCloud::from_positions(points).unwrap(), &leaf).unwrap()
}

fn ask(a: &Placed<'_>, b: &Placed<'_>, options: CollideOptions, budget: &Budget) -> Answer {
    let plan = CollidePlan::new(&options, a.scan(), b.scan()).unwrap();
    Pair::new(*a, *b).within(budget).collide(&plan, &mut Scratch::default())
}

const SHAPES: [CloudKind; 8] = [
    CloudKind::Random,
    CloudKind::Clustered,
    CloudKind::Lattice,
    CloudKind::Rings,
    CloudKind::Coplanar,
    CloudKind::Sphere,
    CloudKind::Outlier,
    CloudKind::Huge,
];

/// The greatest overlap of any two reliable discs in the world, as a share of their radii, and
/// whether any unreliable ones cross.
fn best_crossing(a: &Placed<'_>, b: &Placed<'_>) -> (f64, bool) {
    let discs = |view: &Placed<'_>| -> Vec<(oracle::Disc, bool, f64)> {
        let scan = view.scan();
        (0..scan.len())
            .map(|i| {
                let disc = oracle::Disc {
                    centre: view.point(i),
                    normal: view.stored_to_world().rotate(scan.normals()[i].map(f64::from)),
                    radius: f64::from(scan.discs().get(i)) * view.stored_to_world().scale(),
                };
                let radius = f64::from(scan.radii()[i]) * view.stored_to_world().scale();
                (disc, matches!(scan.kind(i), PointKind::Sheet | PointKind::Edge), radius)
            })
            .collect()
    };
    let (discs_a, discs_b) = (discs(a), discs(b));
    let mut best = f64::NEG_INFINITY;
    let mut doubtful = false;
    for (p, trusted_p, radius_p) in &discs_a {
        for (q, trusted_q, radius_q) in &discs_b {
            let crossing = oracle::crossing(p, q);
            let d = [0, 1, 2].map(|k| p.centre[k] - q.centre[k]);
            if d.iter().map(|x| x * x).sum::<f64>().sqrt() > 0.9 * radius_p.max(*radius_q) {
                continue;
            }
            if *trusted_p && *trusted_q {
                best = best.max(crossing.slack / p.radius.min(q.radius));
            } else {
                doubtful |= crossing.crosses;
            }
        }
    }
    (best, doubtful)
}

#[test]
fn the_test_of_two_discs_equals_the_twin() {
    let mut rng = arbitrary::rng(21);
    let mut seen = [0, 0];
    for round in 0..200_000 {
        let mut disc = |radius: f64| oracle::Disc {
            centre: arbitrary::point_in(&mut rng, 1.0),
            normal: arbitrary::unit_vector(&mut rng),
            radius,
        };
        let (p, mut q) = (disc(0.8), disc([0.8, 0.3, 1.5][round % 3]));
        if round % 5 == 0 {
            // Nearly parallel.
            q.normal = [0, 1, 2].map(|k| p.normal[k] + 0.02 * q.normal[k]);
            let length = q.normal.iter().map(|x| x * x).sum::<f64>().sqrt();
            q.normal = q.normal.map(|x| x / length);
        }
        let expected = oracle::crossing(&p, &q);
        if expected.slack.abs() < 1e-3 {
            continue;
        }
        #[expect(clippy::cast_possible_truncation, reason = "discs are single precision")]
        let single = |d: &oracle::Disc| nearmiss_query::Disc {
            centre: d.centre.map(|x| x as f32),
            normal: d.normal.map(|x| x as f32),
            radius: d.radius as f32,
        };
        let found = nearmiss_query::crossing(&single(&p), &single(&q));
        let d = [0, 1, 2].map(|k| p.centre[k] - q.centre[k]);
        let off = |n: [f64; 3]| (0..3).map(|k| n[k] * d[k]).sum::<f64>().abs();
        let touching = off(p.normal).max(off(q.normal)) <= 0.051 * p.radius.min(q.radius);
        if expected.crosses {
            assert!(found, "{p:?} {q:?} cross by {}", expected.slack);
        } else if !touching {
            assert!(!found, "{p:?} {q:?} miss by {}", expected.slack);
        }
        seen[usize::from(expected.crosses)] += 1;
    }
    assert!(seen.iter().all(|&n| n > 30_000), "both answers: {seen:?}");
}

#[test]
fn surfaces_meet_where_some_discs_cross() {
    let mut rng = arbitrary::rng(11);
    let (mut hits, mut misses) = (0, 0);
    for (n, kind) in (0_u64..).zip(SHAPES.iter().cycle().take(48)) {
        let a = prepared(&arbitrary::cloud(*kind, 250, n));
        let b = prepared(&arbitrary::cloud(*kind, 200, n + 100));
        let size = a.bounds().half_extents().into_iter().fold(0.0, f64::max);
        for _ in 0..4 {
            let spread = arbitrary::point_in(&mut rng, 2.2 * size);
            let pose = arbitrary::rotation(&mut rng).with_translation(spread);
            let (va, vb) = (Placed::new(&a, &Pose::IDENTITY), Placed::new(&b, &pose));
            let (slack, doubtful) = best_crossing(&va, &vb);
            let surfaces = CollideOptions::estimated().with_semantics(Semantics::Surface);
            let options = surfaces.with_detail(Detail::Verdict);
            let verdict = ask(&va, &vb, options, &Budget::UNLIMITED).verdict;
            // In between, rounding and the thickness of nearly parallel discs decide.
            if slack > 1e-3 {
                assert!(verdict.is_intersecting(), "{kind:?} {n}: slack {slack}, but {verdict:?}");
                hits += 1;
            } else if slack < -0.2 && !doubtful {
                assert!(!verdict.is_intersecting(), "{kind:?} {n}: slack {slack}, but {verdict:?}");
                misses += 1;
            }
        }
    }
    assert!(hits > 20 && misses > 40, "{hits} hits, {misses} misses");
}

#[test]
fn thickened_equals_brute_force() {
    let mut rng = arbitrary::rng(12);
    let mut seen = [0, 0];
    for (n, kind) in (0_u64..).zip(SHAPES.iter().cycle().take(32)) {
        let (points_a, points_b) = (arbitrary::cloud(*kind, 250, n), arbitrary::cloud(*kind, 200, n + 100));
        let (a, b) = (prepared(&points_a), prepared(&points_b));
        let stored = |scan: &PointHierarchy| -> Vec<[f64; 3]> {
            scan.positions().iter().map(|&p| scan.frame().to_world(p)).collect()
        };
        let (points_a, points_b) = (stored(&a), stored(&b));
        let size = a.bounds().half_extents().into_iter().fold(0.0, f64::max);
        for round in 0..6 {
            let scale = [1.0, 0.5, 3.0][round % 3];
            let pose_b = arbitrary::rotation(&mut rng)
                .with_translation(arbitrary::point_in(&mut rng, 3.0 * size))
                .with_scale(scale);
            let pose_a =
                arbitrary::rotation(&mut rng).with_translation(arbitrary::point_in(&mut rng, 0.1 * size));
            let nearest = oracle::least_distance(&points_a, &pose_a, &points_b, &pose_b).unwrap();
            let (va, vb) = (Placed::new(&a, &pose_a), Placed::new(&b, &pose_b));
            for factor in [0.0, 0.3, 0.499_999, 0.500_001, 0.7, 5.0] {
                let radius = factor * nearest.distance;
                let options = CollideOptions::estimated().with_semantics(Semantics::Thickened(radius));
                let expected = oracle::touches(nearest.distance, radius, 0.0);
                match ask(&va, &vb, options, &Budget::UNLIMITED).verdict {
                    Verdict::Intersecting { contact, evidence: Evidence::Certified } => {
                        assert!(expected, "{kind:?} {n}: {radius} for {}", nearest.distance);
                        assert!(
                            2.0 * contact.residual <= 2.0 * radius * (1.0 + 1e-12),
                            "the pair found touches"
                        );
                    }
                    Verdict::Separated { gap, evidence: Evidence::Certified } => {
                        assert!(!expected, "{kind:?} {n}: {radius} for {}", nearest.distance);
                        assert!(
                            gap <= nearest.distance - 2.0 * radius + 1e-12 * nearest.distance,
                            "a lower bound: {gap}"
                        );
                    }
                    other => panic!("undecided without a budget: {other:?}"),
                }
                seen[usize::from(expected)] += 1;
            }
        }
    }
    assert!(seen.iter().all(|&n| n > 300), "both verdicts: {seen:?}");
}

#[test]
fn a_witness_lies_on_both_surfaces() {
    let sphere = prepared(&arbitrary::cloud(CloudKind::Sphere, 3000, 1));
    let mut rng = arbitrary::rng(3);
    let size = sphere.bounds().half_extents()[0];
    let mut certified = 0;
    for _ in 0..40 {
        let direction = arbitrary::unit_vector(&mut rng);
        let shift = direction.map(|x| 1.2 * size * x);
        let pose = arbitrary::rotation(&mut rng).with_translation(shift);
        let (a, b) = (Placed::new(&sphere, &Pose::IDENTITY), Placed::new(&sphere, &pose));
        let answer = ask(&a, &b, CollideOptions::estimated(), &Budget::UNLIMITED);
        let Verdict::Intersecting { contact, evidence } = answer.verdict else { panic!("spheres meet") };
        if evidence == Evidence::Certified {
            certified += 1;
            for view in [&a, &b] {
                let at = view.evaluate(contact.point, &mut Scratch::default());
                assert!(at.f.abs() <= 1e-6 * at.bandwidth, "on the surface: {}", at.f / at.bandwidth);
            }
            assert!(answer.statistics.evaluations >= 2, "evaluations are counted");
        }
    }
    assert!(certified >= 36, "{certified} of 40 certified");
}

#[test]
fn a_work_budget_is_kept_and_reproducible() {
    let sphere = prepared(&arbitrary::cloud(CloudKind::Sphere, 3000, 1));
    let size = sphere.bounds().half_extents()[0];
    let pose = Pose::from_translation([1.9 * size, 0.2 * size, 0.1 * size]);
    let (a, b) = (Placed::new(&sphere, &Pose::IDENTITY), Placed::new(&sphere, &pose));
    // A fixed order, as another one may find another contact first.
    let options = CollideOptions::estimated().with_order(Order::DepthFirst);
    let unlimited = ask(&a, &b, options, &Budget::UNLIMITED);
    for work in [0, 1, 10, 50, 1_000_000] {
        let budget = Budget::default().with_work(work);
        let answer = ask(&a, &b, options, &budget);
        assert_eq!(answer, ask(&a, &b, options, &budget), "the same twice");
        let spent = answer.statistics.evaluations + answer.statistics.node_pairs;
        match answer.verdict {
            Verdict::Undecided(Reason::Budget { likelihood }) => {
                assert!(
                    likelihood > 0.0 && likelihood <= 1.0,
                    "boxes overlap, so there is a chance: {likelihood}"
                );
                // Sixteen pairs are compared at once.
                assert!(spent <= work + 16, "{spent} units for {work}");
            }
            verdict => assert_eq!(verdict, unlimited.verdict, "what an unlimited query says"),
        }
    }
    let past = nearmiss_query::Deadline::within(std::time::Duration::ZERO);
    let late = ask(&a, &b, options, &Budget::default().with_deadline(past));
    assert!(matches!(late.verdict, Verdict::Undecided(Reason::Budget { .. })), "{late:?}");
}

/// A square lattice in the plane z = 0 from −half to half.
fn lattice(half: i32, spacing: f64) -> Vec<[f64; 3]> {
    let side = |i: i32| f64::from(i) * spacing;
    (-half..=half).flat_map(|i| (-half..=half).map(move |j| [side(i), side(j), 0.0])).collect()
}

#[test]
fn grazing_sheets_touch_flat_or_not() {
    let flat = prepared(&lattice(25, 1.0));
    let verdict = CollideOptions::estimated().with_detail(Detail::Verdict);
    // Discs have a radius of about 0.65 · 1.41. Sheets touch within a twentieth of that.
    for (lift, touches) in [(0.0, true), (0.02, true), (0.04, true), (0.06, false), (0.5, false)] {
        let pose = Pose::from_translation([0.3, 0.2, lift]);
        let (a, b) = (Placed::new(&flat, &Pose::IDENTITY), Placed::new(&flat, &pose));
        let found = ask(&a, &b, verdict, &Budget::UNLIMITED).verdict;
        assert_eq!(found.is_intersecting(), touches, "lifted by {lift}: {found:?}");
    }
}

#[test]
fn contacts_of_coarse_and_fine_lie_on_both() {
    let coarse = prepared(&lattice(10, 1.0));
    let fine = prepared(&lattice(10, 0.01));
    let mut rng = arbitrary::rng(5);
    let mut hits = 0;
    for round in 0..300 {
        let pose = arbitrary::rotation(&mut rng).with_translation(arbitrary::point_in(&mut rng, 0.4));
        let (a, b) = (Placed::new(&coarse, &Pose::IDENTITY), Placed::new(&fine, &pose));
        let (a, b) = if round % 2 == 0 { (a, b) } else { (b, a) };
        let options = CollideOptions::estimated().with_detail(Detail::Verdict);
        if let Verdict::Intersecting { contact, .. } = ask(&a, &b, options, &Budget::UNLIMITED).verdict {
            hits += 1;
            let in_fine = pose.apply_inverse(contact.point);
            let away = in_fine.map(|x| (x.abs() - 0.1).max(0.0)).iter().map(|x| x * x).sum::<f64>().sqrt();
            assert!(away < 0.02, "{in_fine:?} is off the fine patch");
            assert!(contact.point[2].abs() < 1e-6, "{:?} is off the coarse plane", contact.point);
        }
    }
    assert!(hits > 30, "{hits} hits");
}

#[test]
fn a_pose_that_is_none_is_undecided() {
    let sphere = prepared(&arbitrary::cloud(CloudKind::Sphere, 300, 1));
    let poses = [
        Pose::from_translation([f64::NAN, 0.0, 0.0]),
        Pose::from_translation([0.0, f64::INFINITY, 0.0]),
        Pose::IDENTITY.with_scale(0.0),
        Pose::IDENTITY.with_scale(-1.0),
        Pose::IDENTITY.with_scale(f64::NAN),
        Pose::IDENTITY.with_scale(1e39),
        Pose::from_axis_angle([1.0, 0.0, 0.0], f64::NAN),
        Pose::from_translation([1e160, 0.0, 0.0]),
        mirrored(),
    ];
    for pose in poses {
        let (a, b) = (Placed::new(&sphere, &Pose::IDENTITY), Placed::new(&sphere, &pose));
        for (a, b) in [(a, b), (b, a)] {
            for semantics in [Semantics::Surface, Semantics::Thickened(0.1)] {
                let options = CollideOptions::estimated().with_semantics(semantics);
                let verdict = ask(&a, &b, options, &Budget::UNLIMITED).verdict;
                assert_eq!(verdict, Verdict::Undecided(Reason::Pose), "{pose:?}");
            }
        }
    }
}

/// A mirror, which only deserialising can produce.
fn mirrored() -> Pose {
    let mut pose = serde_json::to_value(Pose::IDENTITY).unwrap();
    pose["rotation"][0] = (-1.0).into();
    serde_json::from_value(pose).unwrap()
}

#[test]
fn balls_that_surely_meet_are_likely_to() {
    let sphere = prepared(&arbitrary::cloud(CloudKind::Sphere, 3000, 1));
    let size = sphere.bounds().half_extents()[0];
    let pose = Pose::from_translation([3.0 * size, 0.0, 0.0]);
    let (a, b) = (Placed::new(&sphere, &Pose::IDENTITY), Placed::new(&sphere, &pose));
    let options = CollideOptions::estimated().with_semantics(Semantics::Thickened(5.0 * size));
    for work in [0, 1, 5] {
        let verdict = ask(&a, &b, options, &Budget::default().with_work(work)).verdict;
        let Verdict::Undecided(Reason::Budget { likelihood }) = verdict else { panic!("{verdict:?}") };
        assert!(likelihood > 0.5, "{likelihood} after {work} units");
    }
}

#[test]
fn signs_of_normals_change_no_answer() {
    let mut rng = arbitrary::rng(8);
    let (mut hits, mut apart) = (0, 0);
    for (n, kind) in (0_u64..).zip(SHAPES.iter().cycle().take(16)) {
        let points = arbitrary::cloud(*kind, 600, n);
        let plain = prepared(&points);
        // Some normals are turned to either side, as when nothing tells inside from outside.
        let mut turned = prepared(&points);
        let either: Vec<[f32; 3]> = turned
            .normals()
            .iter()
            .map(|normal| if rng.random_bool(0.5) { *normal } else { normal.map(|x| -x) })
            .collect();
        turned.turn_normals(&either);
        let size = plain.bounds().half_extents().into_iter().fold(0.0, f64::max);
        let options = CollideOptions::estimated();
        for options in [
            options,
            options.with_detail(Detail::Verdict),
            options.with_evidence(Evidence::Certified),
            options.with_margin(plain.sampling_radius()),
        ] {
            for _ in 0..40 {
                let poses = [arbitrary::pose(&mut rng, size), arbitrary::pose(&mut rng, size)];
                let [one, other] = [&plain, &turned].map(|scan| {
                    let views = [Placed::new(scan, &poses[0]), Placed::new(scan, &poses[1])];
                    ask(&views[0], &views[1], options, &Budget::UNLIMITED)
                });
                assert_eq!(one.statistics, other.statistics, "{kind:?}");
                match (one.verdict, other.verdict) {
                    (
                        Verdict::Intersecting { contact: p, evidence: e },
                        Verdict::Intersecting { contact: q, evidence: f },
                    ) => {
                        assert_eq!((p.sources, e), (q.sources, f), "{kind:?}");
                        hits += 1;
                    }
                    (p, q) => {
                        assert_eq!(p, q, "{kind:?}");
                        apart += 1;
                    }
                }
            }
        }
    }
    assert!(hits > 300 && apart > 300, "{hits} {apart}");
}
