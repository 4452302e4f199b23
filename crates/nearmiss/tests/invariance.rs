//! The same scene elsewhere, turned, larger or smaller, is the same scene.

use nearmiss::{
    Budget, BuildOptions, CollideOptions, CollidePlan, CollideScratch, PointCloud, Pose, Reason, Scan,
    Verdict, collide_with,
};
use nearmiss_testdata::arbitrary;
use nearmiss_testdata::pairs::{SetOptions, analytic_set};

/// Motions of a scan's points, whose inverses are put before the poses.
fn motions() -> Vec<(&'static str, Pose)> {
    let mut rng = arbitrary::rng(4);
    let turn = arbitrary::rotation(&mut rng);
    vec![
        ("turned", turn),
        ("far away", turn.with_translation([1e6, -2e6, 3e5])),
        ("a thousandth", turn.with_scale(1e-3)),
        ("a million times larger", Pose::IDENTITY.with_scale(1e6).with_translation([5e5, 0.0, -1e6])),
        ("beyond single precision's reach", Pose::IDENTITY.with_scale(2.0_f64.powi(60))),
    ]
}

#[test]
fn verdicts_outside_the_band_do_not_change() {
    let set = analytic_set(3, &SetOptions { noises: vec![0.1], repeats: 1 });
    let build = |points: &[[f64; 3]]| {
        Scan::build(&PointCloud::from_positions(points).unwrap(), &BuildOptions::default()).unwrap()
    };
    let mut scratch = CollideScratch::default();
    let (mut asked, mut thin, mut ambiguous) = (0, 0, 0);
    for (name, motion) in motions() {
        let moved: Vec<Scan> = (set.shapes.iter())
            .map(|shape| build(&shape.points.iter().map(|&p| motion.apply(p)).collect::<Vec<_>>()))
            .collect();
        let back = motion.inverse();
        for pair in set.pairs.iter().filter(|pair| !pair.is_in_band()) {
            let (a, b) = (&moved[pair.a], &moved[pair.b]);
            let plan = CollidePlan::new(&CollideOptions::default(), a, b).unwrap();
            let (pose_a, pose_b) = (pair.pose_a.after(&back), pair.pose_b.after(&back));
            let (va, vb) = (a.at(&pose_a), b.at(&pose_b));
            let verdict = collide_with(&va, &vb, &plan, &Budget::UNLIMITED, &mut scratch).verdict;
            thin += usize::from(pair.thin);
            asked += 1;
            if pair.thin && verdict == Verdict::Undecided(Reason::Ambiguous) {
                ambiguous += 1;
                continue;
            }
            assert_eq!(
                (verdict.is_intersecting(), verdict.is_separated()),
                (pair.truth, !pair.truth),
                "{name}, {}: {verdict:?} at gap {:.2} r",
                pair.family,
                pair.gap / pair.r
            );
        }
    }
    assert!(asked > 1000, "{asked} questions");
    assert!(ambiguous * 20 <= thin, "{ambiguous} of {thin} thin ones undecided");
}
