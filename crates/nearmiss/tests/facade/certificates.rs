//! Certified separations compared with exact distances, and the contents of their proofs.
use nearmiss::{
    Bandwidth, BuildOptions, Check, CollideOptions, CollidePlan, Detail, Evidence, Pair, PointCloud, Pose,
    Proof, Scan, Scratch, Semantics, SurfaceOptions, Verdict,
};
use nearmiss_testdata::arbitrary;
use nearmiss_testdata::pairs::{SetOptions, analytic_set};
use nearmiss_testdata::shapes::{Sampling, scorer_radius, sphere};

fn scan(points: &[[f64; 3]]) -> Scan {
    Scan::build(&PointCloud::from_positions(points).unwrap(), &BuildOptions::default()).unwrap()
}

#[test]
fn no_certificate_is_false_and_nearly_all_clear_separations_have_one() {
    let set = analytic_set(2, &SetOptions { noises: vec![0.0, 0.1], repeats: 2 });
    let scans: Vec<Scan> = set.shapes.iter().map(|shape| scan(&shape.points)).collect();
    let mut scratch = Scratch::default();
    let options = CollideOptions::estimated().with_detail(Detail::Verdict);
    let (mut clear, mut certified) = (0, 0);
    for pair in &set.pairs {
        let (a, b) = (&scans[pair.a], &scans[pair.b]);
        let (va, vb) = (a.at(&pair.pose_a), b.at(&pair.pose_b));
        let mut ask = |options: CollideOptions| {
            let plan = CollidePlan::new(&options, a, b).unwrap();
            Pair::new(va, vb).collide(&plan, &mut scratch).verdict
        };
        let estimated = ask(options);
        let verdict = ask(options.with_evidence(Evidence::Certified));
        assert_eq!(verdict.is_separated(), estimated.is_separated(), "evidence never changes the verdict");
        assert_eq!(verdict.is_intersecting(), estimated.is_intersecting());
        if pair.gap >= 6.0 * pair.r {
            clear += 1;
        }
        if let Verdict::Separated { gap, evidence: Evidence::Certified } = verdict {
            assert!(pair.gap > -0.3 * pair.r, "{}: certified {gap} for {}", pair.family, pair.gap);
            assert!(gap > 0.0 && gap < pair.gap + 0.3 * pair.r, "{}: {gap} for {}", pair.family, pair.gap);
            certified += u32::from(pair.gap >= 6.0 * pair.r);
        }
    }
    assert!(clear > 100 && f64::from(certified) >= 0.95 * f64::from(clear), "{certified} of {clear}");
}

#[test]
fn a_proof_covers_all_pairs_of_points() {
    let shape = sphere(1.0).sample(Sampling::clean(0.08));
    let scan = scan(&shape.points);
    let r = scorer_radius(&shape.points);
    let plan =
        CollidePlan::new(&CollideOptions::estimated().with_evidence(Evidence::Certified), &scan, &scan)
            .unwrap();
    let mut rng = arbitrary::rng(3);
    let mut scratch = Scratch::default();
    let mut proof = Proof::default();
    let (mut proven, mut most) = (0, 0);
    for round in 0..60 {
        let away = arbitrary::unit_vector(&mut rng).map(|c| c * (2.0 + r * f64::from(round % 12)));
        let pose = arbitrary::rotation(&mut rng).with_translation(away);
        let (a, b) = (scan.at(&Pose::IDENTITY), scan.at(&pose));
        let answer = Pair::new(a, b).proof(&mut proof).collide(&plan, &mut scratch);
        let Verdict::Separated { gap, evidence: Evidence::Certified } = answer.verdict else {
            assert!(proof.pairs.is_empty(), "nothing is proven of {:?}", answer.verdict);
            continue;
        };
        proven += 1;
        most = most.max(proof.pairs.len());
        assert!(proof.pairs.iter().all(|(_, distance)| *distance >= gap), "{gap} is the least of all");
        let mut covered = vec![0_u8; scan.len() * scan.len()];
        for (pair, _) in &proof.pairs {
            let points = |id| scan.topology().points(id);
            for i in points(pair.a) {
                for j in points(pair.b) {
                    covered[i * scan.len() + j] = 1;
                }
            }
        }
        assert!(covered.iter().all(|&times| times > 0), "every pair of points is excluded");
    }
    assert!(proven > 20 && most > 20, "{proven} proofs of up to {most} pairs");
}

/// A sparse bowl, a large empty space, and a small patch inside the bowl whose discs miss the
/// bowl's discs, although the leaves are compared. Proofs for other pairs of leaves prove nothing
/// for these.
#[test]
fn leaves_that_were_compared_are_not_certified() {
    let lattice = |step: f64, height: &dyn Fn(f64, f64) -> f64| -> Vec<[f64; 3]> {
        let at = |i: i32| (f64::from(i) - 1.5) * step;
        (0..4).flat_map(|i| (0..4).map(move |j| (at(i), at(j)))).map(|(x, y)| [x, y, height(x, y)]).collect()
    };
    let mut bowl = lattice(0.3, &|x, y| 1.2 * (x * x + y * y));
    for i in 0..4 {
        for j in 0..4 {
            bowl.push([20.0 + 0.3 * f64::from(i), 0.3 * f64::from(j), 0.0]);
        }
    }
    let options = CollideOptions::estimated().with_detail(Detail::Verdict).with_evidence(Evidence::Certified);
    for height in [0.35, 0.236] {
        let (a, b) = (scan(&bowl), scan(&lattice(0.02, &|x, _| height + 0.3 * x)));
        let plan = CollidePlan::new(&options, &a, &b).unwrap();
        let (va, vb) = (a.at(&Pose::IDENTITY), b.at(&Pose::IDENTITY));
        let answer = Pair::new(va, vb).collide(&plan, &mut Scratch::default());
        assert!(answer.statistics.leaf_pairs > 0, "the leaves are compared");
        assert!(
            !matches!(answer.verdict, Verdict::Separated { evidence: Evidence::Certified, .. }),
            "{:?}",
            answer.verdict
        );
    }
}

/// Two grids along the axes that meet at a rim, where a neighbour of a rim point is exactly
/// perpendicular. There a zero of either sign once made the cell of the point vanish.
#[test]
fn grids_along_the_axes_are_enclosed_to_their_rims() {
    let grid: Vec<[f64; 3]> =
        (0..13).flat_map(|i| (0..6).map(move |j| [f64::from(i), f64::from(j), 0.0])).collect();
    let scan = scan(&grid);
    let turned = [
        -0.080_917_897_015_431_28,
        0.021_815_976_909_983_124,
        -0.996_481_990_351_086_8,
        6.691_529_901_348_915,
        0.001_774_128_822_682_024_8,
        -0.999_755_698_185_68,
        -0.022_031_713_782_276_897,
        -1.317_422_485_214_487_8,
        -0.996_719_191_352_068_2,
        -0.003_550_647_367_273_155,
        0.080_859_424_272_948_57,
        6.154_827_342_033_586,
        0.0,
        0.0,
        0.0,
        1.0,
    ];
    let pose = Pose::from_row_major(&turned, scan.bounds(), 1e-6).unwrap();
    let options = CollideOptions::estimated().with_evidence(Evidence::Certified);
    let plan = CollidePlan::new(&options, &scan, &scan).unwrap();
    let (a, b) = (scan.at(&Pose::IDENTITY), scan.at(&pose));
    let meeting = [6.177_413_816_683_716, -0.653_311_282_612_506_4, 1.26e-7];
    for view in [&a, &b] {
        let at = view.evaluate(meeting, &mut Scratch::default());
        assert!(at.f.abs() < 1e-6 * at.bandwidth, "a point of either surface: {}", at.f);
    }
    let verdict = Pair::new(a, b).collide(&plan, &mut Scratch::default()).verdict;
    assert!(!matches!(verdict, Verdict::Separated { evidence: Evidence::Certified, .. }), "{verdict:?}");
}

#[test]
fn bandwidths_beyond_measure_are_saved_and_certify_nothing() {
    let shape = sphere(1.0).sample(Sampling::clean(0.3));
    let cloud = PointCloud::from_positions(&shape.points).unwrap();
    for h in [1e3, 1e13, 9e17] {
        let surface = SurfaceOptions::default().with_bandwidth(Bandwidth::Fixed(h));
        let scan = Scan::build(&cloud, &BuildOptions::default().with_surface(surface)).unwrap();
        assert_eq!(scan.sanity_check(), Ok(()), "{h}");
        let mut bytes = Vec::new();
        scan.write_to(&mut bytes).unwrap();
        let scan = Scan::from_bytes(bytes, Check::Full).unwrap();
        let asked = |semantics| {
            let options =
                CollideOptions::estimated().with_semantics(semantics).with_evidence(Evidence::Certified);
            let plan = CollidePlan::new(&options, &scan, &scan).unwrap();
            let (a, b) = (scan.at(&Pose::IDENTITY), scan.at(&Pose::from_translation([0.0, 20.0, 0.0])));
            Pair::new(a, b).collide(&plan, &mut Scratch::default()).verdict
        };
        let nothing = Verdict::Separated { gap: 0.0, evidence: Evidence::Estimated };
        assert_eq!(asked(Semantics::Surface), nothing, "{h}");
        // Cells end at a limited distance from the points, whatever the bandwidth.
        let Verdict::Separated { gap, evidence: Evidence::Certified } = asked(Semantics::Obstacle) else {
            panic!("{h}: obstacles are apart");
        };
        assert!(gap > 10.0 && gap <= 18.1, "{h}: {gap}");
    }
}

#[test]
fn distances_are_proven_however_far() {
    let shape = sphere(1.0).sample(Sampling::clean(0.1));
    let scan = scan(&shape.points);
    let options = CollideOptions::estimated().with_evidence(Evidence::Certified);
    let plan = CollidePlan::new(&options, &scan, &scan).unwrap();
    for (away, share) in
        [(2.9, 0.05), (4.0, 0.4), (10.0, 0.7), (150.0, 0.8), (1000.0, 0.99), (1e30, 0.99), (1e60, 0.99)]
    {
        let (a, b) =
            (scan.at(&Pose::IDENTITY), scan.at(&Pose::from_translation([0.6 * away, 0.0, 0.8 * away])));
        let mut proof = Proof::default();
        let scratch = &mut Scratch::default();
        let verdict = Pair::new(a, b).proof(&mut proof).collide(&plan, scratch).verdict;
        let Verdict::Separated { gap, evidence: Evidence::Certified } = verdict else {
            panic!("{away}: {verdict:?}")
        };
        let distance = away - 2.0;
        assert!(gap <= distance * (1.0 + 1e-9) && gap >= share * distance, "{gap} of {distance}");
        assert!(!proof.pairs.is_empty());
    }
}
