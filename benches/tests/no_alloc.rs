//! Queries and evaluations allocate no memory once their scratch is warm.
//!
//! This is a program without a test harness because the counter covers the whole process.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

use nearmiss::hierarchy::GatherScratch;
use nearmiss::{
    Brackets, Budget, BuildOptions, CollideOptions, CollidePlan, Contacts, CurveOptions, CurvePlan, Curves,
    Deadline, Detail, DistanceOptions, DistancePlan, Evidence, GraphOptions, Interior, Interpolation,
    ManifoldPoint, Mesh, MeshBuildOptions, MeshPair, MeshScanPair, MeshScanPlan, MeshSolid, Method, Motion,
    Pair, Paths, Pose, Prepared, Ray, Scan, Scratch, Semantics, Shape, ShapeHint, ShapePlan, Sweep,
    SweepOptions, SweepPlan, SweepVerdict, Target, Verdict,
};
use nearmiss_benches::counting::Counting;
use nearmiss_benches::object::Object;
use nearmiss_benches::poses;
use nearmiss_testdata::arbitrary::{point_in, rng};
use std::time::Duration;

#[global_allocator]
static ALLOCATOR: Counting = Counting::new();

/// Poses of each kind that are queried while the counter is watched.
const POSES: usize = 300;

/// The plans of the queries, with their budgets.
fn questions(scan: &Scan, r: f64) -> Vec<(CollidePlan, Budget)> {
    let options = CollideOptions::estimated();
    let [verdict, witness] = [Detail::Verdict, Detail::Witness].map(|detail| options.with_detail(detail));
    let thick = options.with_semantics(Semantics::Thickened(0.5 * r));
    let whole = Budget::UNLIMITED;
    let hour = whole.with_deadline(Deadline::within(Duration::from_secs(3600)));
    let along = |search| witness.with_method(Method::Interpolation(search));
    let flat = Interpolation::default().with_flat(true);
    let asked = [
        (along(Interpolation::default()), whole),
        (along(flat), whole),
        (along(flat.with_brackets(Brackets::Annulus)), whole.with_work(300)),
        (verdict, whole),
        (witness, whole),
        (thick, whole),
        (verdict, whole.with_work(8)),
        (witness, whole.with_work(40)),
        (thick, whole.with_work(8)),
        (witness, hour),
        (verdict.with_evidence(Evidence::Certified), whole),
        (witness.with_margin(r), whole),
    ];
    let plan = |options: &CollideOptions| CollidePlan::new(options, scan, scan).expect("options in range");
    asked.map(|(options, budget)| (plan(&options), budget)).to_vec()
}

/// Queries the poses of a scan; returns the number of verdicts of each kind.
fn ask_all(
    scan: &Scan,
    questions: &[(CollidePlan, Budget)],
    poses: &[Pose],
    (scratch, places): (&mut Scratch, &mut Vec<ManifoldPoint>),
) -> [usize; 3] {
    let mut verdicts = [0; 3];
    for (plan, budget) in questions {
        for pose in poses {
            let (a, b) = (scan.at(&Pose::IDENTITY), scan.at(pose));
            let kind = match Pair::new(a, b).within(budget).manifold(places).collide(plan, scratch).verdict {
                Verdict::Intersecting { .. } => 0,
                Verdict::Separated { .. } => 1,
                Verdict::Undecided(_) => 2,
            };
            verdicts[kind] += 1;
        }
    }
    verdicts
}

#[expect(clippy::too_many_lines, reason = "all tests share their scenes")]
fn main() {
    let object = Object::read("dragon-5k").unwrap().scaled().unwrap();
    let scan = Scan::build(&object.cloud, &BuildOptions::default()).unwrap();
    let mut poses: Vec<Pose> = poses::near(&object, POSES, 1).unwrap().iter().map(|near| near.pose).collect();
    poses.extend(poses::sweep(POSES / 10, 1, 0).into_iter().flatten());
    let along = scan
        .clone()
        .with_graph(&object.cloud, &GraphOptions::default().with_close_pairs(Some(Paths::Rebuilt)), None)
        .unwrap();
    let along = along.with_geodesic_kernel().unwrap();
    let (mut scratch, mut places) = (Scratch::default(), Vec::new());
    for scan in [&scan, &along] {
        let (questions, kernel) = (questions(scan, object.r), scan.metric());
        // Exactly the same queries: buffers grow to what these need and no further.
        let first = ask_all(scan, &questions, &poses, (&mut scratch, &mut places));
        let before = ALLOCATOR.calls();
        let second = ask_all(scan, &questions, &poses, (&mut scratch, &mut places));
        assert_eq!(ALLOCATOR.calls() - before, 0, "queries by the {kernel} kernel allocated");
        assert_eq!(first, second, "verdicts depend on the scratch");
        assert!(first.iter().all(|&n| n > 20), "of every kind of verdict some: {first:?}");
    }

    let plan = CurvePlan::new(&CurveOptions::default(), &scan, &scan).unwrap();
    let options = CollideOptions::estimated();
    let everything = CollidePlan::new(&options, &scan, &scan).unwrap();
    let (mut found, mut contacts) = (Curves::default(), Contacts::default());
    let mut draw_all = || {
        let mut points = 0;
        for pose in &poses {
            let (a, b) = (scan.at(&Pose::IDENTITY), scan.at(pose));
            Pair::new(a, b).curves(&plan, &mut found, &mut scratch);
            Pair::new(a, b).contacts(&mut contacts).collide(&everything, &mut scratch);
            points += found.points.len();
        }
        points
    };
    let first = draw_all();
    let before = ALLOCATOR.calls();
    assert_eq!(draw_all(), first, "curves depend on the scratch");
    assert_eq!(ALLOCATOR.calls() - before, 0, "curves allocated");
    assert!(first > 1000, "{first} points of curves");

    let mut measure_all = || {
        let mut sum = 0.0;
        for semantics in [Semantics::Surface, Semantics::Thickened(0.5 * object.r)] {
            let asked = DistanceOptions::default().with_semantics(semantics);
            let plan = DistancePlan::new(&asked, &scan, &scan).unwrap();
            for (pose, work) in poses.iter().zip([u64::MAX, 400].into_iter().cycle()) {
                let budget = Budget::UNLIMITED.with_work(work);
                let (a, b) = (scan.at(&Pose::IDENTITY), scan.at(pose));
                sum += Pair::new(a, b).within(&budget).distance(&plan, &mut scratch).upper;
            }
        }
        sum
    };
    let first = measure_all();
    let before = ALLOCATOR.calls();
    assert_eq!(measure_all().to_bits(), first.to_bits(), "distances depend on the scratch");
    assert_eq!(ALLOCATOR.calls() - before, 0, "distances allocated");
    assert!(first > 100.0 * object.r, "some are apart: {first}");

    let stays = Motion::still(Pose::IDENTITY);
    let paths: Vec<Motion> = poses.chunks(3).take(40).map(|poses| Motion::through(poses).unwrap()).collect();
    let mut sweep_all = || {
        let (mut free, mut sum) = (0, 0.0);
        for semantics in [Semantics::Obstacle, Semantics::Thickened(0.5 * object.r)] {
            let plan =
                SweepPlan::new(&SweepOptions::default().with_semantics(semantics), &scan, &scan).unwrap();
            for path in &paths {
                let sweep = Sweep::new(scan.along(&stays), scan.along(path));
                match sweep.first_impact(&plan, &mut scratch).verdict {
                    SweepVerdict::Free { clearance, .. } => (free, sum) = (free + 1, sum + clearance),
                    SweepVerdict::Impact { t_hit, .. } => sum += t_hit,
                    SweepVerdict::Undecided { t_free, .. } => sum += t_free,
                }
            }
        }
        (free, sum.to_bits())
    };
    let first = sweep_all();
    let before = ALLOCATOR.calls();
    assert_eq!(sweep_all(), first, "sweeps depend on the scratch");
    assert_eq!(ALLOCATOR.calls() - before, 0, "sweeps allocated");
    let shapes = [CollideOptions::default(), options.with_margin(object.r)];
    let shapes = shapes.map(|options| ShapePlan::new(&options, &scan).unwrap());
    let (mut hint, mut places, mut hits) = (ShapeHint::default(), Vec::new(), Vec::new());
    let mut touch_all = || {
        let mut sum = 0;
        for (plan, pose) in shapes.iter().cycle().zip(&poses) {
            let target = Target::new(scan.at(&Pose::IDENTITY), plan);
            let centre = pose.translation();
            let solids = [
                Shape::Sphere { centre, radius: object.r },
                Shape::Box { pose: *pose, half: [3.0 * object.r; 3], radius: 0.0 },
            ];
            for solid in &solids {
                sum += usize::from(target.touch(solid, &mut scratch).verdict.is_touching());
                sum += usize::from(target.distance(solid, f64::INFINITY, &mut scratch).is_some());
                target.contacts_hinted(solid, &mut hint, &mut places, &mut scratch);
                sum += places.len();
            }
            let ray = Ray::new(centre.map(|c| 3.0 * c), centre.map(|c| -c));
            target.cast_all(&ray, &mut hits, &mut scratch);
            sum += hits.len() + usize::from(target.cast(&ray, &mut scratch).hit.is_some());
        }
        let target = Target::new(scan.at(&Pose::IDENTITY), &shapes[0]);
        let ball = Shape::Sphere { centre: [0.0; 3], radius: object.r };
        sum += paths
            .iter()
            .map(|path| target.sweep(&ball, path, &mut scratch).distances as usize)
            .sum::<usize>();
        sum += usize::from(ball.gap_to(&ball).is_some());
        hint.clear();
        sum
    };
    let first = touch_all();
    let before = ALLOCATOR.calls();
    assert_eq!(touch_all(), first, "shapes depend on the scratch");
    assert_eq!(ALLOCATOR.calls() - before, 0, "shapes and rays allocated");
    assert!(first > 100, "{first} contacts and hits");

    let mesh = Mesh::build(object.mesh.as_ref().unwrap(), &MeshBuildOptions::default()).unwrap();
    let distance = DistancePlan::against_mesh(&DistanceOptions::default(), &scan).unwrap();
    let asked = [
        options.with_evidence(Evidence::Certified),
        options.with_semantics(Semantics::Thickened(0.5 * object.r)),
        options.with_margin(object.r),
    ];
    let asked = asked.map(|options| MeshScanPlan::new(&options, &scan).unwrap());
    let mut compare_all = || {
        let (mut hits, mut sum) = (0, 0.0);
        for (pose, work) in poses.iter().zip([u64::MAX, 400].into_iter().cycle()) {
            let budget = Budget::UNLIMITED.with_work(work);
            let pair = MeshScanPair::new(scan.at(&Pose::IDENTITY), mesh.at(pose)).within(&budget);
            for plan in &asked {
                hits += usize::from(pair.collide(plan, &mut scratch).verdict.is_intersecting());
                pair.contacts(plan, &mut contacts, &mut scratch);
            }
            sum += pair.distance(&distance, &mut scratch).upper;
        }
        (hits, sum.to_bits())
    };
    let first = compare_all();
    let before = ALLOCATOR.calls();
    assert_eq!(compare_all(), first, "answers about a mesh depend on the scratch");
    assert_eq!(ALLOCATOR.calls() - before, 0, "queries of a mesh and a scan allocated");
    assert!(first.0 > 100, "{} contacts", first.0);

    let solid = MeshSolid::new(&mesh);
    let mut separate_all = || {
        let mut sum = 0.0;
        for (pose, work) in poses.iter().step_by(20).zip([u64::MAX, 400].into_iter().cycle()) {
            let budget = Budget::UNLIMITED.with_work(work);
            let pair = MeshPair::new(mesh.at(&Pose::IDENTITY), mesh.at(pose)).within(&budget);
            sum += pair.penetration([&solid; 2], scratch.meshes()).upper;
        }
        sum
    };
    let first = separate_all();
    let before = ALLOCATOR.calls();
    assert_eq!(separate_all().to_bits(), first.to_bits(), "penetrations depend on the scratch");
    assert_eq!(ALLOCATOR.calls() - before, 0, "penetrations allocated");
    assert!(first > object.r, "some overlap: {first}");

    let plan = CollidePlan::new(&CollideOptions::default(), &scan, &scan).unwrap();
    let target = Target::new(scan.at(&Pose::IDENTITY), &shapes[0]);
    let mut part_all = || {
        let mut sum = 0.0;
        for (pose, work) in poses.iter().step_by(20).zip([u64::MAX, 4000].into_iter().cycle()) {
            let budget = Budget::UNLIMITED.with_work(work);
            let pair = Pair::new(scan.at(&Pose::IDENTITY), scan.at(pose)).within(&budget);
            sum += pair.penetration(&plan, [Interior::Solid; 2], &mut scratch).upper;
            let cuboid = Shape::Box { pose: *pose, half: [6.0 * object.r; 3], radius: 0.0 };
            sum += target.penetration(&cuboid, Interior::Solid, &budget, &mut scratch).upper;
        }
        sum
    };
    let first = part_all();
    let before = ALLOCATOR.calls();
    assert_eq!(part_all().to_bits(), first.to_bits(), "penetrations of scans depend on the scratch");
    assert_eq!(ALLOCATOR.calls() - before, 0, "penetrations of scans allocated");
    assert!(first > object.r, "some overlap: {first}");

    let rng = &mut rng(5);
    let places: Vec<[f64; 3]> = (0..POSES)
        .map(|i| {
            let [p, d] = [scan.positions()[i * 7].map(f64::from), point_in(rng, object.r)];
            [0, 1, 2].map(|k| p[k] + d[k])
        })
        .collect();
    let mut gather = GatherScratch::default();
    let evaluate = |gather: &mut GatherScratch| -> usize {
        places.iter().filter(|&&x| scan.evaluate_with(x, gather).f.is_finite()).count()
    };
    let defined = evaluate(&mut gather);
    let before = ALLOCATOR.calls();
    let again = evaluate(&mut gather);
    assert_eq!(ALLOCATOR.calls() - before, 0, "evaluations allocated");
    assert_eq!(defined, again, "evaluations depend on the scratch");
    assert!(defined > POSES / 2, "{defined} of {POSES} places have an f");
}
