//! Hints, batches and worlds of meshes and scans against single queries.

use nearmiss_geometry::{PointCloud, Pose, TriangleMesh};
use nearmiss_hierarchy::{BuildOptions, MeshBuildOptions, MeshHierarchy, PointHierarchy};
use nearmiss_query::{
    BatchScratch, Bodies, BodyPair, Budget, CollideOptions, CollidePlan, Detail, DistanceOptions,
    DistancePlan, Evidence, MeshHint, MeshPair, MeshScanHint, MeshScanPair, MeshScanPlan, Placed, PlacedBody,
    PlacedMesh, Scratch, Semantics, Verdict, World, each,
};
use nearmiss_testdata::arbitrary::{self, CloudKind, point_in, rng, rotation, unit_vector};
use rand::RngExt;

type Random = rand_xoshiro::Xoshiro256PlusPlus;

/// A prepared tessellated sphere of radius 1 about the origin.
fn ball(rings: u32) -> MeshHierarchy {
    ball_of(1.0, rings)
}

/// The same with another radius.
fn ball_of(radius: f64, rings: u32) -> MeshHierarchy {
    let mut vertices = Vec::new();
    for i in 0..=rings {
        let polar = std::f64::consts::PI * f64::from(i) / f64::from(rings);
        for j in 0..2 * rings {
            let around = std::f64::consts::PI * f64::from(j) / f64::from(rings);
            let unit = [polar.sin() * around.cos(), polar.sin() * around.sin(), polar.cos()];
            vertices.push(unit.map(|x| radius * x));
        }
    }
    let at = |i: u32, j: u32| i * 2 * rings + j % (2 * rings);
    let quads = (0..rings).flat_map(|i| (0..2 * rings).map(move |j| (i, j)));
    let triangles = quads.flat_map(|(i, j)| {
        let [p, q, r, s] = [at(i, j), at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)];
        [[p, r, q], [q, r, s]]
    });
    let mesh = TriangleMesh::new(vertices, triangles.collect()).unwrap();
    MeshHierarchy::build(&mesh, &MeshBuildOptions::default()).unwrap()
}

fn scan(kind: CloudKind, count: u32) -> PointHierarchy {
    let cloud = PointCloud::from_positions(&arbitrary::cloud(kind, count, 7)).unwrap();
    PointHierarchy::build(&cloud, &BuildOptions::default()).unwrap()
}

/// Poses along a path of small steps that starts near contact, with turns.
fn walk(rng: &mut Random, from: f64, step: f64, count: u32) -> Vec<Pose> {
    let (away, along, turn) = (unit_vector(rng), unit_vector(rng), unit_vector(rng));
    (0..count)
        .map(|i| {
            let t = step * f64::from(i);
            let place = [0, 1, 2].map(|k| away[k] * from + along[k] * t);
            Pose::from_axis_angle(turn, 0.3 * t).with_translation(place)
        })
        .collect()
}

#[test]
fn hints_of_meshes_change_no_verdict_and_save_searches() {
    let rng = &mut rng(2501);
    let mesh = ball(20);
    let scratch = &mut Scratch::default();
    let (mut hits, mut misses, mut free) = (0, 0, 0);
    for round in 0..60 {
        // Steps of a hundredth of the spacing, and long ones.
        let step = [0.0015, 0.02, 0.3][round % 3];
        let from = 2.0 + 0.1 * rng.random_range(-0.5..1.0);
        let (mut hint, mut last) = (MeshHint::default(), None);
        for pose in walk(rng, from, step, 40) {
            let pair = MeshPair::new(PlacedMesh::new(&mesh, &Pose::IDENTITY), PlacedMesh::new(&mesh, &pose));
            let cold = pair.collide(scratch.meshes());
            let warm = pair.collide_hinted(&mut hint, scratch.meshes());
            assert_eq!(warm.verdict.is_intersecting(), cold.verdict.is_intersecting(), "{pose:?}, {last:?}");
            assert_eq!(warm.verdict.is_separated(), cold.verdict.is_separated(), "{pose:?}");
            hits += u32::from(cold.verdict.is_intersecting());
            misses += u32::from(cold.verdict.is_separated());
            free += u32::from(cold.verdict.is_separated() && warm.statistics.node_pairs == 0);
            if round % 5 == 0 {
                let [cold, warm] =
                    [pair.distance(scratch.meshes()), pair.distance_hinted(&mut hint, scratch.meshes())];
                assert_eq!((cold.lower, cold.upper), (warm.lower, warm.upper), "{pose:?}");
            }
            last = Some(pose);
        }
    }
    assert!(hits > 300 && misses > 300, "{hits} hits, {misses} misses");
    assert!(2 * free > misses, "{free} of {misses} separations without a search");
}

#[test]
fn hints_of_a_mesh_and_a_scan_change_no_verdict() {
    let rng = &mut rng(2502);
    let mesh = ball(12);
    let scratch = &mut Scratch::default();
    let (mut hits, mut misses, mut free) = (0, 0, 0);
    for (kind, from) in [(CloudKind::Sphere, 2.0), (CloudKind::Random, 1.8), (CloudKind::Rings, 2.0)] {
        let scan = scan(kind, 600);
        let estimated = CollideOptions::default();
        for options in [
            estimated,
            estimated.with_detail(Detail::Verdict),
            estimated.with_evidence(Evidence::Certified),
            estimated.with_evidence(Evidence::Certified).with_margin(0.1),
            estimated.with_semantics(Semantics::Thickened(0.05)),
        ] {
            let plan = MeshScanPlan::new(&options, &scan).unwrap();
            let of_distance = DistanceOptions::default().with_semantics(options.semantics);
            let of_distance = DistancePlan::against_mesh(&of_distance, &scan).unwrap();
            for round in 0..8 {
                let mut hint = MeshScanHint::default();
                let from = from + rng.random_range(-0.1..0.4);
                for pose in walk(rng, from, [0.002, 0.02][round % 2], 25) {
                    let placed = Placed::new(&scan, &Pose::IDENTITY);
                    let pair = MeshScanPair::new(placed, PlacedMesh::new(&mesh, &pose));
                    let cold = pair.collide(&plan, scratch).verdict;
                    let answer = pair.collide_hinted(&plan, &mut hint, scratch);
                    let warm = answer.verdict;
                    assert_eq!(
                        cold.is_intersecting(),
                        warm.is_intersecting(),
                        "{kind:?} {options:?} {pose:?}"
                    );
                    assert_eq!(cold.is_separated(), warm.is_separated(), "{kind:?} {options:?} {pose:?}");
                    hits += u32::from(cold.is_intersecting());
                    if let Verdict::Separated { gap, .. } = warm {
                        misses += 1;
                        free += u32::from(answer.statistics.node_pairs == 0);
                        let distance = pair.distance(&of_distance, scratch);
                        let rounding = 1e-6 * distance.upper;
                        assert!(gap <= distance.upper + rounding, "{gap}, but {distance:?}");
                    }
                    if round == 0 {
                        let cold = pair.distance(&of_distance, scratch);
                        let warm = pair.distance_hinted(&of_distance, &mut hint, scratch);
                        assert!(
                            (cold.upper - warm.upper).abs() <= 1e-6 + 0.01 * cold.upper,
                            "{cold:?}, {warm:?}"
                        );
                        assert!(warm.lower <= cold.upper && cold.lower <= warm.upper, "{cold:?}, {warm:?}");
                    }
                }
            }
        }
    }
    assert!(hits > 300 && misses > 300 && free > 100, "{hits} hits, {misses} misses, {free} free");
}

#[test]
fn hints_of_other_things_and_questions_are_ignored() {
    let (small, large, scan) = (ball_of(0.5, 8), ball(8), scan(CloudKind::Sphere, 600));
    let scratch = &mut Scratch::default();
    // Where the small ball is far from the other thing, the large one meets it.
    let pose = Pose::from_translation([1.8, 0.0, 0.0]);
    let [first, second] = [&small, &large]
        .map(|mesh| MeshPair::new(PlacedMesh::new(&large, &Pose::IDENTITY), PlacedMesh::new(mesh, &pose)));
    let mut hint = MeshHint::default();
    assert!(first.collide_hinted(&mut hint, scratch.meshes()).verdict.is_separated());
    assert_eq!(first.collide_hinted(&mut hint, scratch.meshes()).statistics.node_pairs, 0, "not remembered");
    assert!(second.collide_hinted(&mut hint, scratch.meshes()).verdict.is_intersecting(), "another mesh");

    let options = CollideOptions::default().with_evidence(Evidence::Certified);
    let [plan, wide] = [0.0, 0.5].map(|m| MeshScanPlan::new(&options.with_margin(m), &scan).unwrap());
    let placed = Placed::new(&scan, &Pose::IDENTITY);
    let pair = |mesh| MeshScanPair::new(placed, PlacedMesh::new(mesh, &pose));
    let mut hint = MeshScanHint::default();
    assert!(pair(&small).collide_hinted(&plan, &mut hint, scratch).verdict.is_separated());
    let again = pair(&small).collide_hinted(&plan, &mut hint, scratch);
    assert_eq!(again.statistics.node_pairs, 0, "not remembered");
    let known = hint.clone();
    assert!(pair(&large).collide_hinted(&plan, &mut hint, scratch).verdict.is_intersecting(), "another mesh");
    let margin = pair(&small).collide_hinted(&wide, &mut known.clone(), scratch).verdict;
    assert!(margin.is_intersecting(), "another margin: {margin:?}");

    // On the surface between the points: apart from them, but not from the obstacle.
    let (tiny, rng) = (ball_of(0.02, 4), &mut rng(2504));
    let of_points = options.with_semantics(Semantics::Thickened(0.0));
    let of_points = MeshScanPlan::new(&of_points, &scan).unwrap();
    let mut between = 0;
    for _ in 0..100 {
        let pose = Pose::from_translation(unit_vector(rng));
        let pair = MeshScanPair::new(placed, PlacedMesh::new(&tiny, &pose));
        let mut hint = MeshScanHint::default();
        let is_apart = pair.collide_hinted(&of_points, &mut hint, scratch).verdict.is_separated();
        let cold = pair.collide(&plan, scratch).verdict.is_intersecting();
        let warm = pair.collide_hinted(&plan, &mut hint, scratch).verdict.is_intersecting();
        assert_eq!(cold, warm, "another meaning: {pose:?}");
        between += u32::from(is_apart && cold);
    }
    assert!(between > 20, "{between} between points");
}

/// The verdicts of a batch on this number of threads.
fn batch<T: Clone + Send + Default>(
    threads: usize,
    count: usize,
    ask: impl Fn(usize, &mut Scratch) -> T + Sync + Send,
) -> Vec<T> {
    let mut answers = vec![T::default(); count];
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        each(&mut answers, None, &mut BatchScratch::default(), |i, scratch| {
            std::ops::ControlFlow::Continue(ask(i, scratch))
        })
    });
    answers
}

#[test]
fn batches_of_meshes_answer_as_single_queries_on_any_number_of_threads() {
    let rng = &mut rng(2503);
    let (mesh, scan) = (ball(10), scan(CloudKind::Sphere, 500));
    let poses: Vec<Pose> = (0..200)
        .map(|_| rotation(rng).with_translation(unit_vector(rng).map(|x| x * 2.3)))
        .chain((0..50).map(|_| Pose::from_translation(point_in(&mut arbitrary::rng(3), 2.0))))
        .collect();
    let plan =
        MeshScanPlan::new(&CollideOptions::default().with_evidence(Evidence::Certified), &scan).unwrap();
    let meshes = |i: usize, scratch: &mut Scratch| {
        let pair = MeshPair::new(PlacedMesh::new(&mesh, &Pose::IDENTITY), PlacedMesh::new(&mesh, &poses[i]));
        let budget = Budget::UNLIMITED.with_work(40);
        let pairs = [pair.collide(scratch.meshes()), pair.within(&budget).collide(scratch.meshes())];
        Some((pairs, pair.distance(scratch.meshes())))
    };
    let beside = |i: usize, scratch: &mut Scratch| {
        let pair = MeshScanPair::new(Placed::new(&scan, &Pose::IDENTITY), PlacedMesh::new(&mesh, &poses[i]));
        Some(pair.collide(&plan, scratch))
    };
    let single: Vec<_> = (0..poses.len()).map(|i| meshes(i, &mut Scratch::default())).collect();
    let against: Vec<_> = (0..poses.len()).map(|i| beside(i, &mut Scratch::default())).collect();
    for threads in [1, 2] {
        assert!(batch(threads, poses.len(), meshes) == single, "two meshes, {threads} threads");
        assert!(batch(threads, poses.len(), beside) == against, "a mesh and a scan, {threads} threads");
    }
}

/// Returns `true` if the bodies meet.
fn meets(pair: BodyPair<'_>, plan: &CollidePlan, of_mesh: &MeshScanPlan, scratch: &mut Scratch) -> bool {
    match pair {
        BodyPair::Scans(pair) => pair.collide(plan, scratch).verdict.is_intersecting(),
        BodyPair::MeshAndScan { pair, .. } => pair.collide(of_mesh, scratch).verdict.is_intersecting(),
        BodyPair::Meshes(pair) => pair.collide(scratch.meshes()).verdict.is_intersecting(),
        _ => unreachable!("there are no shapes"),
    }
}

#[test]
fn worlds_of_scans_and_meshes_find_every_pair_that_meets() {
    let rng = &mut rng(2504);
    let (mesh, scan) = (ball(8), scan(CloudKind::Sphere, 300));
    let plan = CollidePlan::new(&CollideOptions::default(), &scan, &scan).unwrap();
    let of_mesh = MeshScanPlan::new(&CollideOptions::default(), &scan).unwrap();
    let scratch = &mut Scratch::default();
    let mut kinds = [0; 3];
    for _ in 0..6 {
        let mut world = World::with_meshes();
        let mut bodies = Vec::new();
        let place = |rng: &mut Random| rotation(rng).with_scale(0.7).with_translation(point_in(rng, 3.0));
        for i in 0..24 {
            let pose = place(rng);
            let id = if i % 2 == 0 { world.insert(&scan, &pose) } else { world.insert_mesh(&mesh, &pose) };
            bodies.push((id, i % 2 == 1, pose));
        }
        for at in [3, 8, 15] {
            let pose = place(rng);
            assert!(world.move_to(bodies[at].0, &pose), "it exists");
            bodies[at].2 = pose;
        }
        let (id, ..) = bodies.remove(5);
        assert!(world.remove(id).is_none() && world.body(id).is_some(), "a mesh is not removed as a scan");
        assert!(world.remove_body(id).is_some() && world.body(id).is_none(), "it is removed");
        let mut near = Vec::new();
        world.near_pairs(Bodies::All, plan.reach(), &mut near);
        for (i, (a, a_is_mesh, at_a)) in bodies.iter().enumerate() {
            assert_eq!(world.placed(*a).is_none(), *a_is_mesh, "{a:?}");
            for (b, b_is_mesh, at_b) in &bodies[i + 1..] {
                let put = |is_mesh: bool, pose: &Pose| {
                    if is_mesh {
                        PlacedBody::Mesh(PlacedMesh::new(&mesh, pose))
                    } else {
                        PlacedBody::Scan(Placed::new(&scan, pose))
                    }
                };
                let expected = BodyPair::new(put(*a_is_mesh, at_a), put(*b_is_mesh, at_b));
                let expected = meets(expected, &plan, &of_mesh, scratch);
                let pair = world.body_pair([*a, *b]).unwrap();
                if let BodyPair::MeshAndScan { mesh_is_first, .. } = pair {
                    assert_eq!(mesh_is_first, *a_is_mesh, "the order of the bodies");
                }
                assert_eq!(meets(pair, &plan, &of_mesh, scratch), expected, "{a:?}, {b:?}");
                assert!(!expected || near.contains(&[*a, *b]), "{a:?} and {b:?} meet");
                kinds[usize::from(*a_is_mesh) + usize::from(*b_is_mesh)] += u32::from(expected);
            }
        }
        assert!(near.len() < 24 * 23 / 2, "the broad phase prunes");
    }
    assert!(kinds.iter().all(|&count| count > 10), "{kinds:?} contacts of each kind");
}
