//! Verdicts do not change if a scene is moved, rotated or scaled, if its scans are exchanged, or if
//! their points are reordered, repeated or denser.
use nearmiss::{
    BuildOptions, CollideOptions, CollidePlan, Evidence, GraphOptions, Pair, PointCloud, Pose, Reason, Scan,
    Scratch, Semantics, Verdict,
};
use nearmiss_testdata::arbitrary::{self, CloudKind};
use nearmiss_testdata::pairs::{SetOptions, analytic_set};
use nearmiss_testdata::shapes::{Sampling, scorer_radius, sphere, torus};

/// Motions of a scan's points, which are undone by their inverses in the poses.
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
    let mut scratch = Scratch::default();
    let (mut asked, mut thin, mut ambiguous) = (0, 0, 0);
    for (name, motion) in motions() {
        let moved: Vec<Scan> = (set.shapes.iter())
            .map(|shape| build(&shape.points.iter().map(|&p| motion.apply(p)).collect::<Vec<_>>()))
            .collect();
        let back = motion.inverse();
        for pair in set.pairs.iter().filter(|pair| !pair.is_in_band()) {
            let (a, b) = (&moved[pair.a], &moved[pair.b]);
            let plan = CollidePlan::new(&CollideOptions::estimated(), a, b).unwrap();
            let (pose_a, pose_b) = (pair.pose_a.after(&back), pair.pose_b.after(&back));
            let (va, vb) = (a.at(&pose_a), b.at(&pose_b));
            let verdict = Pair::new(va, vb).collide(&plan, &mut scratch).verdict;
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

fn build(points: &[[f64; 3]]) -> Scan {
    Scan::build(&PointCloud::from_positions(points).unwrap(), &BuildOptions::default()).unwrap()
}

fn ask(a: &Scan, b: &Scan, poses: [Pose; 2], options: CollideOptions) -> Verdict {
    let plan = CollidePlan::new(&options, a, b).unwrap();
    let (a, b) = (a.at(&poses[0]), b.at(&poses[1]));
    Pair::new(a, b).collide(&plan, &mut Scratch::default()).verdict
}

fn kind(verdict: &Verdict) -> &'static str {
    match verdict {
        Verdict::Intersecting { .. } => "intersecting",
        Verdict::Separated { .. } => "separated",
        Verdict::Undecided(_) => "undecided",
    }
}

#[test]
fn exchanged_or_moved_together_they_are_as_far_apart() {
    let set = analytic_set(5, &SetOptions { noises: vec![0.0, 0.1], repeats: 1 });
    let scans: Vec<Scan> = set.shapes.iter().map(|shape| build(&shape.points)).collect();
    let mut rng = arbitrary::rng(6);
    let certified = CollideOptions::estimated().with_evidence(Evidence::Certified);
    let mut asked = 0;
    for pair in set.pairs.iter().filter(|pair| !pair.is_in_band()) {
        let (a, b) = (&scans[pair.a], &scans[pair.b]);
        let motion = arbitrary::rotation(&mut rng).with_translation(arbitrary::point_in(&mut rng, 100.0));
        let (pose_a, pose_b) = (pair.pose_a, pair.pose_b);
        for options in [certified, certified.with_margin(2.0 * pair.r), thickened(pair.r)] {
            let verdict = ask(a, b, [pose_a, pose_b], options);
            let exchanged = ask(b, a, [pose_b, pose_a], options);
            let moved = ask(a, b, [motion.after(&pose_a), motion.after(&pose_b)], options);
            // With a margin, as for contacts, verdicts within the band may differ.
            let by = pair.gap - options.margin;
            if options.semantics == Semantics::Surface && by.abs() <= pair.r {
                continue;
            }
            asked += 1;
            let place = format!("{} at {:.2} r, {options:?}", pair.family, pair.gap / pair.r);
            assert_eq!(kind(&exchanged), kind(&verdict), "exchanged: {place}");
            assert_eq!(kind(&moved), kind(&verdict), "moved: {place}");
            for other in [verdict, exchanged, moved] {
                if let Verdict::Separated { gap, .. } = other {
                    assert!(gap <= pair.gap + 0.3 * pair.r, "a lower bound: {gap}, {place}");
                }
            }
        }
    }
    assert!(asked > 1000, "{asked} questions");
}

fn thickened(radius: f64) -> CollideOptions {
    CollideOptions::estimated().with_semantics(Semantics::Thickened(0.45 * radius))
}

#[test]
fn duplicates_change_nothing_and_order_only_names() {
    for kind in [CloudKind::Sphere, CloudKind::Rings, CloudKind::Clustered, CloudKind::Lattice] {
        let points = arbitrary::cloud(kind, 700, 8);
        let scan = build(&points);
        let twice = build(&[points.clone(), points.iter().rev().copied().collect()].concat());
        assert_eq!(twice.positions(), scan.positions(), "{kind:?}");
        assert_eq!(twice.radii(), scan.radii(), "{kind:?}");
        assert!(twice.discs().iter().eq(scan.discs().iter()), "{kind:?}");
        assert!(twice.enclosures().eq(scan.enclosures()), "{kind:?}");
        assert_eq!(twice.source(), scan.source(), "{kind:?}");
        assert_eq!(twice.dropped().duplicate - scan.dropped().duplicate, 700, "{kind:?}");

        // A permutation, because 271 and 700 are coprime.
        let order: Vec<usize> = (0..points.len()).map(|i| (271 * i + 5) % points.len()).collect();
        let other = build(&order.iter().map(|&i| points[i]).collect::<Vec<_>>());
        let by_place = |scan: &Scan| {
            let mut all: Vec<([u32; 3], u32, u8)> = (0..scan.len())
                .map(|i| {
                    let place = scan.positions()[i].map(f32::to_bits);
                    (place, scan.radii()[i].to_bits(), scan.kind(i).code())
                })
                .collect();
            all.sort_unstable();
            all
        };
        assert_eq!(other.sampling_radius().to_bits(), scan.sampling_radius().to_bits(), "{kind:?}");
        let differ = by_place(&other).iter().zip(by_place(&scan)).filter(|(a, b)| **a != *b).count();
        // Sums over neighbours are rounded in another order, which may move a point across a
        // threshold.
        assert!(differ * 100 <= scan.len(), "{kind:?}: {differ} of {} points differ", scan.len());
    }
}

#[test]
fn powers_of_two_scale_every_number() {
    let points = arbitrary::cloud(CloudKind::Sphere, 600, 9);
    let scan = build(&points);
    for power in [-20, -1, 7, 25] {
        let factor = 2.0_f64.powi(power);
        let other = build(&points.iter().map(|p| p.map(|c| c * factor)).collect::<Vec<_>>());
        #[expect(clippy::cast_possible_truncation, reason = "a power of two")]
        let unit = (other.frame().scale / scan.frame().scale / factor) as f32;
        let same = |name: &str, a: &[f32], b: &[f32]| {
            let differ = a.iter().zip(b).filter(|(a, b)| (**a).to_bits() != (**b * unit).to_bits()).count();
            assert_eq!(differ, 0, "2^{power}: {name}");
        };
        same("positions", scan.positions().as_flattened(), other.positions().as_flattened());
        same("radii", scan.radii(), other.radii());
        let discs = |scan: &Scan| scan.discs().iter().collect::<Vec<_>>();
        same("discs", &discs(&scan), &discs(&other));
        assert_eq!(scan.normals(), other.normals(), "2^{power}");
        assert_eq!(scan.source(), other.source(), "2^{power}");
        for (a, b) in scan.enclosures().zip(other.enclosures()) {
            same("centres of enclosures", &a.centre, &b.centre);
            same("half lengths of enclosures", &a.half, &b.half);
        }
    }
}

/// Vertices of a torus in a lattice of `n` by `n / 2` quadrilaterals, as in a mesh.
fn torus_vertices(n: u32) -> Vec<[f64; 3]> {
    let turn = |i: u32, of: u32| std::f64::consts::TAU * f64::from(i) / f64::from(of);
    let vertex = |i: u32, j: u32| {
        let (u, v) = (turn(i, n), turn(j, n / 2));
        let across = 1.0 + 0.4 * v.cos();
        [across * u.cos(), across * u.sin(), 0.4 * v.sin()]
    };
    (0..n).flat_map(|i| (0..n / 2).map(move |j| vertex(i, j))).collect()
}

#[test]
fn a_finer_mesh_answers_as_the_coarser_did() {
    let exact = torus(1.0, 0.4);
    let ball = sphere(0.5).sample(Sampling::clean(0.06));
    let probe = build(&ball.points);
    let coarse = torus_vertices(64);
    let r = scorer_radius(&coarse).max(scorer_radius(&ball.points));
    let scans = [build(&coarse), build(&torus_vertices(128)), build(&torus_vertices(256))];
    let mut rng = arbitrary::rng(10);
    let (mut hits, mut apart) = (0, 0);
    for _ in 0..400 {
        let centre = arbitrary::point_in(&mut rng, 1.8);
        let gap = exact.distance(centre) - 0.5;
        // Deeper inside, the ball is entirely within the tube.
        if gap.abs() <= r || gap < -0.45 {
            continue;
        }
        let pose = arbitrary::rotation(&mut rng).with_translation(centre);
        for scan in &scans {
            let verdict = ask(scan, &probe, [Pose::IDENTITY, pose], CollideOptions::estimated());
            assert_eq!(verdict.is_intersecting(), gap < 0.0, "gap {:.2} r: {verdict:?}", gap / r);
            assert_eq!(verdict.is_separated(), gap > 0.0, "gap {:.2} r: {verdict:?}", gap / r);
        }
        hits += u32::from(gap < 0.0);
        apart += u32::from(gap > 0.0);
    }
    assert!(hits > 50 && apart > 100, "{hits} hits, {apart} apart");
}

/// A graph orients normals, and no verdict depends on their signs: the bits are equal, except for
/// the sides of a contact's normals.
#[test]
fn a_graph_changes_no_verdict() {
    let mut rng = arbitrary::rng(12);
    let mut hits = 0;
    for (n, cloud) in [CloudKind::Sphere, CloudKind::Clustered, CloudKind::Coplanar, CloudKind::Rings]
        .into_iter()
        .enumerate()
    {
        let cloud = PointCloud::from_positions(&arbitrary::cloud(cloud, 900, n as u64)).unwrap();
        let bare = Scan::build(&cloud, &BuildOptions::default()).unwrap();
        let joined = bare.clone().with_graph(&cloud, &GraphOptions::default(), None).unwrap();
        let size = bare.bounds().half_extents().into_iter().fold(0.0, f64::max);
        for options in [
            CollideOptions::estimated(),
            CollideOptions::estimated().with_evidence(Evidence::Certified).with_margin(0.01 * size),
        ] {
            for _ in 0..150 {
                let pose =
                    arbitrary::rotation(&mut rng).with_translation(arbitrary::point_in(&mut rng, 2.2 * size));
                let [one, other] =
                    [&bare, &joined].map(|scan| ask(scan, scan, [Pose::IDENTITY, pose], options));
                match (one, other) {
                    (
                        Verdict::Intersecting { contact: p, evidence: e },
                        Verdict::Intersecting { contact: q, evidence: f },
                    ) => {
                        assert_eq!((p.point, p.residual, p.sources, e), (q.point, q.residual, q.sources, f));
                        hits += 1;
                    }
                    _ => assert_eq!(one, other, "{options:?}"),
                }
            }
        }
    }
    assert!((200..1000).contains(&hits), "{hits} of 1200 meet");
}
