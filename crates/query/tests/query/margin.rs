//! Margins: one-sided against brute force on points, exact on shapes with known distances.
use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
use nearmiss_query::{
    Answer, CollideOptions, CollidePlan, Detail, Evidence, Pair, Placed, Scratch, Semantics, Verdict,
};
use nearmiss_testdata::arbitrary::{self, CloudKind};
use nearmiss_testdata::oracle;
use nearmiss_testdata::shapes::{Order, Sampling, scorer_radius, sphere};

fn prepared(points: &[[f64; 3]]) -> PointHierarchy {
    let leaf = BuildOptions::default().with_leaf_size(8);
    PointHierarchy::build(&PointCloud::from_positions(points).unwrap(), &leaf).unwrap()
}

fn ask(a: &Placed<'_>, b: &Placed<'_>, options: CollideOptions) -> Answer {
    let plan = CollidePlan::new(&options, a.scan(), b.scan()).unwrap();
    Pair::new(*a, *b).collide(&plan, &mut Scratch::default())
}

fn in_world(view: &Placed<'_>) -> Vec<[f64; 3]> {
    (0..view.scan().len()).map(|i| view.point(i)).collect()
}

#[test]
fn points_within_the_margin_are_never_separated() {
    let mut rng = arbitrary::rng(31);
    let (mut met, mut proven) = (0, 0);
    for (n, kind) in (0_u64..).zip(CloudKind::ALL.iter().cycle().take(56)) {
        let (points_a, points_b) = (arbitrary::cloud(*kind, 250, n), arbitrary::cloud(*kind, 200, n + 100));
        let (Ok(_), Ok(_)) = (PointCloud::from_positions(&points_a), PointCloud::from_positions(&points_b))
        else {
            continue;
        };
        let (a, b) = (prepared(&points_a), prepared(&points_b));
        let size = a.bounds().half_extents().into_iter().fold(0.0, f64::max);
        for round in 0..4 {
            let pose_b = arbitrary::rotation(&mut rng)
                .with_translation(arbitrary::point_in(&mut rng, 3.5 * size))
                .with_scale([1.0, 0.5, 3.0][round % 3]);
            let (va, vb) = (Placed::new(&a, &Pose::IDENTITY), Placed::new(&b, &pose_b));
            let same = Pose::IDENTITY;
            let nearest = oracle::least_distance(&in_world(&va), &same, &in_world(&vb), &same).unwrap();
            for factor in [0.01, 0.7, 0.999_999, 1.000_001, 1.3, 20.0] {
                let margin = factor * nearest.distance;
                for evidence in [Evidence::Estimated, Evidence::Certified] {
                    let options = CollideOptions::estimated()
                        .with_detail(Detail::Verdict)
                        .with_margin(margin)
                        .with_evidence(evidence);
                    match ask(&va, &vb, options).verdict {
                        Verdict::Separated { gap, evidence } => {
                            assert!(factor < 1.0, "{kind:?} {n}: points {factor} of the margin apart");
                            if evidence == Evidence::Certified {
                                proven += 1;
                                assert!(gap >= margin && gap <= nearest.distance, "{gap} from {margin}");
                            }
                        }
                        verdict => met += u32::from(verdict.is_intersecting()),
                    }
                }
                let thick = 0.1 * nearest.distance;
                let options = CollideOptions::estimated()
                    .with_semantics(Semantics::Thickened(thick))
                    .with_margin(0.8 * margin);
                let expected = oracle::touches(nearest.distance, thick, 0.8 * margin);
                let verdict = ask(&va, &vb, options).verdict;
                assert_eq!(verdict.is_intersecting(), expected, "{kind:?} {n}: {factor}, balls");
            }
        }
    }
    assert!(met > 500 && proven > 100, "{met} met, {proven} proven apart");
}

#[test]
fn spheres_meet_within_a_margin_of_their_distance() {
    let mut rng = arbitrary::rng(32);
    let (mut certified, mut met, mut apart) = (0, 0, 0);
    for (seed, noise) in [(1, 0.0), (2, 0.1)] {
        let sampling = Sampling { spacing: 0.08, noise, order: Order::Random, seed };
        let shape = sphere(1.0).sample(sampling);
        let scan = prepared(&shape.points);
        let r = scorer_radius(&shape.points);
        for _ in 0..150 {
            let direction = arbitrary::unit_vector(&mut rng);
            let gap = r * (2.0 + 5.0 * arbitrary::point_in(&mut rng, 1.0)[0].abs());
            let pose = arbitrary::rotation(&mut rng).with_translation(direction.map(|c| c * (2.0 + gap)));
            let (va, vb) = (Placed::new(&scan, &Pose::IDENTITY), Placed::new(&scan, &pose));
            for (margin, meets) in [(gap + r, true), (gap - r, false)] {
                let options = CollideOptions::estimated().with_margin(margin);
                let verdict = ask(&va, &vb, options).verdict;
                assert_eq!(verdict.is_intersecting(), meets, "gap {gap}, margin {margin}: {verdict:?}");
                let Verdict::Intersecting { contact, evidence } = verdict else {
                    apart += 1;
                    continue;
                };
                met += 1;
                assert!(
                    contact.residual <= 0.5 * margin * (1.0 + 1e-4),
                    "half the distance: {}",
                    contact.residual
                );
                if evidence == Evidence::Certified {
                    certified += 1;
                    let off = contact.point.iter().map(|c| c * c).sum::<f64>().sqrt() - 1.0;
                    assert!(off > -r && off < margin + r, "between the spheres: {off}");
                }
            }
        }
    }
    assert!(met >= 300 && apart >= 300 && certified > 250, "{met} met, {certified} certified, {apart} apart");
}

#[test]
fn a_margin_that_is_no_length_is_refused() {
    let scan = prepared(&arbitrary::cloud(CloudKind::Sphere, 100, 1));
    for margin in [-1.0, f64::NAN, f64::INFINITY] {
        let plan = CollidePlan::new(&CollideOptions::estimated().with_margin(margin), &scan, &scan);
        assert!(plan.unwrap_err().to_string().contains("margin"), "{margin}");
    }
}
