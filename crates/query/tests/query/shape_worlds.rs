//! Worlds with convex shapes against loops over all pairs.

use std::convert::Infallible;
use std::sync::Arc;

use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_hierarchy::{BuildOptions, MeshHierarchy, PointHierarchy};
use nearmiss_query::{
    AsShape, Bodies, Body, BodyId, BodyInterior, BodyPair, BodyVerdict, Budget, CollideOptions, CollidePlan,
    DistanceOptions, DistancePlan, Interior, MeshSolid, PlacedBody, PlacedShape, Prepared, PreparedMesh,
    Reason, Scratch, Semantics, Shape, ShapePlan, ShapeScanPair, ShapeVerdict, World,
};
use nearmiss_testdata::arbitrary::{point_in, rng, unit_vector};
use rand::RngExt;

use crate::shape_pairs::{Ellipsoid, Owned, SCANS, cube, pose, prepared};

type Random = rand_xoshiro::Xoshiro256PlusPlus;

/// A body of the test, its id and its pose.
type Known = (BodyId, Body<usize, (), Owned>, Pose);

type TestWorld<'a> = World<&'a PointHierarchy, &'a MeshHierarchy, Arc<Owned>>;

fn placed<'a>((_, body, pose): &'a Known, mesh: &'a MeshHierarchy) -> PlacedBody<'a> {
    match body {
        Body::Scan(which) => PlacedBody::Scan(SCANS[*which].at(pose)),
        Body::Mesh(()) => PlacedBody::Mesh(mesh.at(pose)),
        Body::Shape(shape) => PlacedBody::Shape(shape.at(pose)),
    }
}

/// A world of scans, meshes and shapes that has changed a few times.
fn crowd<'a>(
    mesh: &'a MeshHierarchy,
    count: u32,
    spread: f64,
    rng: &mut Random,
) -> (TestWorld<'a>, Vec<Known>) {
    let mut world = World::with_meshes_and_shapes();
    let mut known = Vec::new();
    for i in 0..count {
        let at = pose(spread, rng);
        known.push(match i % 5 {
            0 => (world.insert(&SCANS[i as usize % 2], &at), Body::Scan(i as usize % 2), at),
            1 => (world.insert_mesh(mesh, &at), Body::Mesh(()), at),
            _ => {
                let shape = Owned::random(rng.random_range(0..9), rng);
                (world.insert_shape(Arc::new(shape.clone()), &at), Body::Shape(shape), at)
            }
        });
    }
    for i in (0..known.len()).step_by(3) {
        let at = pose(spread, rng);
        assert!(world.move_to(known[i].0, &at), "it exists");
        known[i].2 = at;
    }
    for i in (0..known.len()).step_by(4) {
        if matches!(known[i].1, Body::Shape(_)) {
            let other = Owned::random(rng.random_range(0..9), rng);
            let changed = world.change(known[i].0, |body| *body = Body::Shape(Arc::new(other.clone())));
            assert!(changed.is_some(), "it exists");
            known[i].1 = Body::Shape(other);
        }
    }
    let (id, body, _) = known.remove(2);
    assert!(matches!(body, Body::Shape(_)) && world.remove(id).is_none(), "not removed as a scan");
    let is_shape = matches!(world.body(id), Some(PlacedBody::Shape(_)));
    assert!(is_shape && world.placed(id).is_none(), "it is still there, as a shape alone");
    let is_removed = matches!(world.remove_body(id), Some(Body::Shape(_)));
    assert!(is_removed && world.body(id).is_none() && world.len() == known.len(), "it is removed");
    (world, known)
}

#[test]
fn worlds_of_all_kinds_find_every_near_pair_and_the_nearest() {
    let rng = &mut rng(6104);
    let mesh = prepared(&cube(4));
    let plan = DistancePlan::new(&DistanceOptions::default(), &SCANS[0], &SCANS[1]).unwrap();
    let scratch = &mut Scratch::default();
    let (mut kinds, mut left_out) = ([0; 6], 0);
    for round in 0..12_u32 {
        let spread = [3.0, 8.0, 20.0][round as usize % 3];
        let (world, known) = crowd(&mesh, 26, spread, rng);
        let reach = [0.0, 0.3, 1.5][round as usize / 3 % 3];
        let mut near = Vec::new();
        world.near_pairs(Bodies::All, reach, &mut near);
        let counts = |a: BodyId, b: BodyId| !(a.0 + b.0).is_multiple_of(4);
        let (mut by, mut of_counting) = (Vec::new(), (f64::INFINITY, f64::INFINITY));
        world.near_pairs_by(Bodies::All, 1.5, |a, b| counts(a, b).then_some(reach), &mut by);
        assert!(near.iter().filter(|pair| counts(pair[0], pair[1])).eq(&by), "a reach for each pair");
        for (j, b) in known.iter().enumerate() {
            for a in &known[..j] {
                let expected = BodyPair::new(placed(a, &mesh), placed(b, &mesh)).distance(&plan, scratch);
                let found = world.body_pair([a.0, b.0]).unwrap().distance(&plan, scratch);
                assert_eq!(found, expected, "{a:?}, {b:?}");
                let found = found.unwrap();
                let context = format!("{found:?}, {a:?}, {b:?}");
                if found.upper > 0.0 {
                    for (k, of) in [a, b].into_iter().enumerate() {
                        let bounds = world.bounds(of.0).unwrap();
                        let more = 1e-6;
                        let inside = |x: [f64; 3]| {
                            (0..3).all(|k| x[k] >= bounds.min[k] - more && x[k] <= bounds.max[k] + more)
                        };
                        assert!(inside(found.points[k]), "the order of the points, {context}");
                    }
                }
                if found.upper <= reach {
                    assert!(near.contains(&[a.0, b.0]), "left out, {context}");
                    let kind = |body: &Known| match body.1 {
                        Body::Scan(_) => 0,
                        Body::Mesh(()) => 1,
                        Body::Shape(_) => 2,
                    };
                    let [low, high] = [kind(a).min(kind(b)), kind(a).max(kind(b))];
                    kinds[[0, 1, 2, 0, 3, 4, 0, 0, 5][3 * low + high]] += 1;
                } else {
                    left_out += u32::from(!near.contains(&[a.0, b.0]));
                }
                if counts(a.0, b.0) {
                    let (lower, upper) = of_counting;
                    of_counting = (found.lower.min(lower), found.upper.min(upper));
                }
            }
        }
        let found = world.nearest_pair(Bodies::All, f64::INFINITY, counts, &plan, scratch).unwrap();
        assert_eq!(found.upper, of_counting.1, "{found:?}");
        assert!(found.lower >= of_counting.0 && found.lower <= found.upper, "{found:?}, {of_counting:?}");
        let nearest = world.body_pair(found.ids).unwrap().distance(&plan, scratch).unwrap();
        assert_eq!((nearest.upper, nearest.points), (found.upper, found.points));
    }
    assert!(kinds.iter().all(|&count| count > 3) && left_out > 1000, "{kinds:?} near, {left_out} pruned");
}

#[test]
fn the_nearest_pair_knows_the_balls_about_points_and_its_reach() {
    let rng = &mut rng(6111);
    let mesh = prepared(&cube(4));
    let scratch = &mut Scratch::default();
    let (mut apart, mut beyond) = (0, 0);
    for round in 0..60_u32 {
        let (world, known) = crowd(&mesh, 8, [8.0, 20.0][round as usize % 2], rng);
        let thickened = [0.4, 1.5][round as usize / 2 % 2];
        let options = DistanceOptions::default().with_semantics(Semantics::Thickened(thickened));
        let plan = DistancePlan::new(&options, &SCANS[0], &SCANS[1]).unwrap();
        let mut least = (f64::INFINITY, f64::INFINITY);
        for (j, b) in known.iter().enumerate() {
            for a in &known[..j] {
                let found = BodyPair::new(placed(a, &mesh), placed(b, &mesh)).distance(&plan, scratch);
                let found = found.unwrap();
                least = (found.lower.min(least.0), found.upper.min(least.1));
            }
        }
        for reach in [f64::INFINITY, 0.5] {
            let found = world.nearest_pair(Bodies::All, reach, |_, _| true, &plan, scratch);
            assert!(
                found.is_none_or(|found| found.lower <= reach.min(least.1)),
                "round {round}: {found:?}, least {least:?}"
            );
            if least.1 < reach {
                assert_eq!(found.unwrap().upper, least.1, "round {round}");
            } else {
                beyond += usize::from(found.is_some());
            }
        }
        apart += usize::from(least.1 > 0.0);
    }
    assert!(apart > 20 && beyond > 5, "{apart} apart, {beyond} beyond the reach");
}

#[test]
fn no_shape_touches_a_scan_beyond_the_broad_phase() {
    let rng = &mut rng(6105);
    let scratch = &mut Scratch::default();
    let grid = (0..30).flat_map(|i| (0..30).map(move |j| [0.05 * f64::from(i), 0.05 * f64::from(j), 0.0]));
    let floor = PointCloud::from_positions(&grid.collect::<Vec<_>>()).unwrap();
    let floor = PointHierarchy::build(&floor, &BuildOptions::default()).unwrap();
    let (mut touching, mut pairs) = ([0; 2], Vec::new());
    for round in 0..3000_u32 {
        let is_flat = round % 2 == 0;
        let scan = if is_flat { &floor } else { &SCANS[round as usize / 2 % 2] };
        let plan = ShapePlan::new(&CollideOptions::default(), scan).unwrap();
        // Just beside the scan. The box of the floor is flat, its discs have a thickness.
        let of_scan = if is_flat { Pose::from_translation(point_in(rng, 1.0)) } else { pose(1.0, rng) };
        let centre = of_scan.apply(scan.bounds().centre());
        let (out, off) = if is_flat {
            ([0.0, 0.0, 1.0], rng.random_range(0.0..0.005))
        } else {
            let most = scan.bounds().half_extents().iter().fold(0.0_f64, |a, b| a.max(*b));
            (unit_vector(rng), most * of_scan.scale() + rng.random_range(-0.1..0.02))
        };
        let at = Pose::from_translation([0, 1, 2].map(|k| centre[k] + out[k] * (0.3 + off)));
        let mut world = World::with_shapes();
        let a = world.insert(scan, &of_scan);
        let b = world.insert_shape(Shape::Sphere { centre: [0.0; 3], radius: 0.3 }, &at);
        world.near_pairs(Bodies::All, 0.0, &mut pairs);
        let Some(BodyPair::ShapeAndScan { pair, shape_is_first: false }) = world.body_pair([a, b]) else {
            panic!("a scan and a shape");
        };
        if pair.touch(&plan, scratch).verdict.is_touching() {
            touching[usize::from(is_flat)] += 1;
            assert_eq!(pairs, [[a, b]], "{off}: {:?}", pair.distance(&plan, f64::INFINITY, scratch));
        }
    }
    assert!(touching.iter().all(|&count| count > 100), "{touching:?} touch");
}

#[test]
fn invalid_shapes_and_poses_are_near_everything_and_have_no_distance() {
    let mesh = prepared(&cube(2));
    let scratch = &mut Scratch::default();
    let ball = Shape::Sphere { centre: [0.0; 3], radius: 0.5 };
    let plan = ShapePlan::new(&CollideOptions::default(), &SCANS[0]).unwrap();
    let of_distance = DistancePlan::new(&DistanceOptions::default(), &SCANS[0], &SCANS[0]).unwrap();
    let nan = f64::NAN;
    let corners = [[0.0, nan, 0.0]];
    let broken = Ellipsoid { half: [nan; 3], pose: Pose::IDENTITY };
    let invalid: Vec<(Shape<'_>, Pose)> = vec![
        (Shape::Sphere { centre: [0.0; 3], radius: -1.0 }, Pose::IDENTITY),
        (Shape::Sphere { centre: [nan, 0.0, 0.0], radius: 1.0 }, Pose::IDENTITY),
        (Shape::Sphere { centre: [f64::INFINITY, 0.0, 0.0], radius: 1.0 }, Pose::IDENTITY),
        (Shape::Hull { points: &[], radius: 0.1 }, Pose::IDENTITY),
        (Shape::Hull { points: &corners, radius: 0.1 }, Pose::IDENTITY),
        (Shape::Own { map: &broken, radius: 0.1 }, Pose::IDENTITY),
        (ball, Pose::from_translation([nan, 0.0, 0.0])),
        (ball, Pose::from_translation([0.0, f64::INFINITY, 0.0])),
        (ball, Pose::IDENTITY.with_scale(0.0)),
        (ball, Pose::IDENTITY.with_scale(-1.0)),
        (ball, Pose::IDENTITY.with_scale(nan)),
        (ball, Pose::from_axis_angle([1.0, 0.0, 0.0], nan)),
    ];
    let mut contacts = vec![];
    for (i, (shape, at)) in invalid.iter().enumerate() {
        let mut world = World::with_meshes_and_shapes();
        let others = [
            world.insert(&SCANS[0], &Pose::IDENTITY),
            world.insert_mesh(&mesh, &Pose::from_translation([100.0, 0.0, 0.0])),
            world.insert_shape(*shape, at),
            world.insert_shape(ball, &Pose::from_translation([200.0, 0.0, 0.0])),
        ];
        let id = others[2];
        assert!(world.bounds(id).is_none(), "{i}");
        let mut near = Vec::new();
        world.near_pairs(Bodies::All, 0.0, &mut near);
        assert_eq!(near, [[others[0], id], [others[1], id], [id, others[3]]], "{i}");
        for other in [others[0], others[1], others[3]] {
            for pair in [[id, other], [other, id]] {
                assert_eq!(world.body_pair(pair).unwrap().distance(&of_distance, scratch), None, "{i}");
            }
        }
        let nearest = world.nearest_pair(Bodies::All, f64::INFINITY, |_, _| true, &of_distance, scratch);
        assert!(nearest.is_some_and(|nearest| !nearest.ids.contains(&id)), "{i}: {nearest:?}");
        let pair = ShapeScanPair::new(SCANS[0].at(&Pose::IDENTITY), PlacedShape::new(*shape, at));
        let expected = if i < 6 { Reason::Shape } else { Reason::Pose };
        assert_eq!(pair.touch(&plan, scratch).verdict, ShapeVerdict::Undecided(expected), "{i}");
        pair.contacts(&plan, &mut contacts, scratch);
        assert!(contacts.is_empty() && pair.distance(&plan, f64::INFINITY, scratch).is_none(), "{i}");
        // Once it is valid, it is an ordinary body.
        world.change(id, |body| *body = Body::Shape(ball));
        assert!(world.move_to(id, &Pose::from_translation([300.0, 0.0, 0.0])));
        world.near_pairs(Bodies::All, 0.0, &mut near);
        assert!(near.is_empty() && world.bounds(id).is_some(), "{i}");
    }
    // The scan, the mesh, or the other shape at an invalid pose.
    let bad = Pose::IDENTITY.with_scale(nan);
    let own = ball.at(&Pose::IDENTITY);
    for pair in [
        BodyPair::new(PlacedBody::Scan(SCANS[0].at(&bad)), PlacedBody::Shape(own)),
        BodyPair::new(PlacedBody::Shape(own), PlacedBody::Mesh(mesh.at(&bad))),
        BodyPair::new(PlacedBody::Shape(own), PlacedBody::Shape(ball.at(&bad))),
    ] {
        assert_eq!(pair.distance(&of_distance, scratch), None);
    }
    // A world of shapes alone.
    let mut world: World<&PointHierarchy, Infallible, Shape<'_>> = World::with_shapes();
    let ids = [0.0, 0.9, 5.0].map(|x| world.insert_shape(ball, &Pose::from_translation([x, 0.0, 0.0])));
    let mut near = Vec::new();
    world.near_pairs(Bodies::All, 0.0, &mut near);
    assert_eq!(near, [[ids[0], ids[1]]]);
    let mut beside = Vec::new();
    world.near_shape(&ball, 4.1, &mut beside);
    assert_eq!(beside, ids);
    world.near_shape(&ball, 0.0, &mut beside);
    assert_eq!(beside, ids[..2]);
}

/// Touches of all kinds of pairs agree with the distances of the same pairs, and with the questions about
/// each kind.
/// A number for the kinds of two bodies.
const fn kind_of(pair: &BodyPair<'_>) -> usize {
    match pair {
        BodyPair::Scans(_) => 0,
        BodyPair::MeshAndScan { .. } => 1,
        BodyPair::Meshes(_) => 2,
        BodyPair::ShapeAndScan { .. } => 3,
        BodyPair::ShapeAndMesh { .. } => 4,
        BodyPair::Shapes(_) => 5,
    }
}

#[test]
fn touches_of_all_kinds_agree_with_their_distances() {
    let rng = &mut rng(6105);
    let mesh = prepared(&cube(4));
    let apart = DistancePlan::new(&DistanceOptions::default(), &SCANS[0], &SCANS[1]).unwrap();
    let scratch = &mut Scratch::default();
    let mut kinds = [[0; 2]; 6];
    for round in 0..12_u32 {
        let margin = [0.0, 0.2][round as usize % 2];
        let options = CollideOptions::default().with_margin(margin);
        let plan = CollidePlan::new(&options, &SCANS[0], &SCANS[1]).unwrap();
        let (world, known) = crowd(&mesh, 26, [3.0, 6.0][round as usize / 2 % 2], rng);
        for (j, b) in known.iter().enumerate() {
            for a in &known[..j] {
                let pair = world.body_pair([a.0, b.0]).unwrap();
                let (found, distance) = (pair.touch(&plan, scratch), pair.distance(&apart, scratch).unwrap());
                let context = format!("{found:?}, {distance:?}, {a:?}, {b:?}");
                let kind = kind_of(&pair);
                if let BodyPair::ShapeAndScan { pair, .. } = &pair {
                    let own = pair.touch(&ShapePlan::new(&options, &SCANS[0]).unwrap(), scratch);
                    assert_eq!(
                        (own.verdict.is_touching(), own.band),
                        (found.verdict.is_touching(), found.band)
                    );
                }
                let is_exact = matches!(kind, 2 | 4 | 5);
                match found.verdict {
                    BodyVerdict::Touching { point, .. } => {
                        kinds[kind][1] += 1;
                        assert!(distance.lower <= margin + 1e-8, "{context}");
                        let bounds = [a, b].map(|body| world.bounds(body.0).unwrap());
                        let more = 0.5 * margin + found.band + 1e-6;
                        let is_near = |bounds: &nearmiss_geometry::Aabb| {
                            (0..3)
                                .all(|k| point[k] >= bounds.min[k] - more && point[k] <= bounds.max[k] + more)
                        };
                        assert!(bounds.iter().all(is_near), "the place, {context}");
                    }
                    BodyVerdict::Separated { .. } => {
                        kinds[kind][0] += 1;
                        let least = margin - if is_exact { 1e-8 } else { found.band };
                        assert!(distance.upper > least || distance.upper == 0.0 && !is_exact, "{context}");
                    }
                    BodyVerdict::Undecided(_) => assert!(!is_exact, "{context}"),
                }
                assert!(!is_exact || found.band == 0.0, "{context}");
            }
        }
    }
    assert!(kinds.iter().flatten().all(|&count| count >= 5), "all kinds touch and are apart: {kinds:?}");

    // A unit ball whose frame is out of proportion to that of the mesh, which passes through it.
    let small = Shape::Sphere { centre: [0.0; 3], radius: 1e-19 };
    let pose = Pose::IDENTITY.with_scale(1e19);
    let pair = BodyPair::new(PlacedBody::Mesh(mesh.at(&Pose::IDENTITY)), PlacedBody::Shape(small.at(&pose)));
    let plan = CollidePlan::new(&CollideOptions::default(), &SCANS[0], &SCANS[1]).unwrap();
    assert_eq!(pair.touch(&plan, scratch).verdict, BodyVerdict::Undecided(Reason::Pose));

    // Invalid poses and shapes.
    let plan = CollidePlan::new(&CollideOptions::default(), &SCANS[0], &SCANS[1]).unwrap();
    let lost = Pose::from_translation([f64::NAN, 0.0, 0.0]);
    let ball = Shape::Sphere { centre: [0.0; 3], radius: 1.0 };
    let bodies = |at: &Pose| {
        [PlacedBody::Scan(SCANS[0].at(at)), PlacedBody::Mesh(mesh.at(at)), PlacedBody::Shape(ball.at(at))]
    };
    for a in bodies(&lost) {
        for b in bodies(&Pose::IDENTITY) {
            for pair in [BodyPair::new(a, b), BodyPair::new(b, a)] {
                let found = pair.touch(&plan, scratch);
                let is_refused =
                    matches!(found.verdict, BodyVerdict::Undecided(Reason::Pose | Reason::Shape));
                assert!(is_refused && found.band == f64::INFINITY, "{found:?} {pair:?}");
            }
        }
    }
}

#[test]
fn bodies_of_all_kinds_are_apart_after_the_shift_that_penetration_tells() {
    let rng = &mut rng(6106);
    let mesh = prepared(&cube(4));
    let solid = MeshSolid::new(&mesh);
    let plan = CollidePlan::new(&CollideOptions::estimated(), &SCANS[0], &SCANS[1]).unwrap();
    let scratch = &mut Scratch::default();
    let budget = Budget::UNLIMITED;
    let interior = |body: &Body<usize, (), Owned>| match body {
        Body::Scan(_) => BodyInterior::Scan(Interior::Hollow),
        Body::Mesh(()) => BodyInterior::Mesh(&solid),
        Body::Shape(_) => BodyInterior::Shape,
    };
    let mut moved = [0; 6];
    for _ in 0..3 {
        let (mut world, known) = crowd(&mesh, 26, 1.5, rng);
        for (j, b) in known.iter().enumerate() {
            for a in &known[..j] {
                let (interiors, ids) = ([interior(&a.1), interior(&b.1)], [a.0, b.0]);
                let pair = world.body_pair(ids).unwrap();
                let kind = kind_of(&pair);
                if moved[kind] > 20 {
                    continue;
                }
                let found = pair.penetration(&plan, interiors, &budget, scratch);
                let context = format!("{found:?}, {a:?}, {b:?}");
                if pair.touch(&plan, scratch).verdict.is_separated() && matches!(kind, 0 | 3 | 5) {
                    assert_eq!(found.upper, 0.0, "{context}");
                }
                let turned = world.body_pair([b.0, a.0]).unwrap();
                let back = turned.penetration(&plan, [interiors[1], interiors[0]], &budget, scratch);
                if matches!(kind, 1 | 3 | 4) {
                    assert_eq!((back.lower, back.upper), (found.lower, found.upper), "{context}");
                    assert!((0..3).all(|k| back.direction[k] == -found.direction[k]), "{context}, {back:?}");
                }
                if found.upper == 0.0 {
                    continue;
                }
                moved[kind] += 1;
                assert!(found.upper.is_finite() && found.lower <= found.upper, "{context}");
                let by = found.upper * (1.0 + 1e-9) + 1e-9;
                let shift = Pose::from_translation(found.direction.map(|c| c * by));
                assert!(world.move_to(b.0, &shift.after(&b.2)), "it exists");
                let after = world.body_pair(ids).unwrap();
                assert!(after.touch(&plan, scratch).verdict.is_separated(), "after the shift, {context}");
                assert!(world.move_to(b.0, &b.2), "it exists");
            }
        }
    }
    assert!(moved.iter().all(|&count| count >= 2), "all kinds: {moved:?}");
}

#[test]
fn penetration_counts_the_inside_of_the_body_that_is_solid() {
    let mesh = prepared(&cube(4));
    let solid = MeshSolid::new(&mesh);
    let plan = CollidePlan::new(&CollideOptions::estimated(), &SCANS[0], &SCANS[1]).unwrap();
    let (scratch, budget) = (&mut Scratch::default(), Budget::UNLIMITED);

    // A scanned ball about smaller things, whichever comes first.
    let ball = Shape::Sphere { centre: [0.0; 3], radius: 0.1 };
    let (at, scan) = (Pose::IDENTITY, PlacedBody::Scan(SCANS[0].at(&Pose::IDENTITY)));
    for (mesh_or_shape, own) in [
        (PlacedBody::Shape(ball.at(&at)), BodyInterior::Shape),
        (PlacedBody::Mesh(mesh.at(&Pose::IDENTITY.with_scale(0.1))), BodyInterior::Mesh(&solid)),
    ] {
        for (interior, is_inside) in [(Interior::Hollow, false), (Interior::Solid, true)] {
            let of_scan = BodyInterior::Scan(interior);
            let first = BodyPair::new(scan, mesh_or_shape);
            let second = BodyPair::new(mesh_or_shape, scan);
            let found = first.penetration(&plan, [of_scan, own], &budget, scratch);
            let back = second.penetration(&plan, [own, of_scan], &budget, scratch);
            assert_eq!((found.upper > 0.9, back.upper > 0.9), (is_inside, is_inside), "{found:?}, {back:?}");
        }
    }
    let small = PlacedBody::Scan(SCANS[0].at(&Pose::IDENTITY.with_scale(0.2)));
    for (which, insides) in [[true, false], [false, true]].into_iter().enumerate() {
        let interiors =
            insides.map(|solid| BodyInterior::Scan(if solid { Interior::Solid } else { Interior::Hollow }));
        let found = BodyPair::new(scan, small).penetration(&plan, interiors, &budget, scratch);
        assert_eq!(found.upper > 0.5, which == 0, "the greater one is solid or not: {found:?}");
    }

    // Interiors of other kinds, and of another mesh.
    let (other, ball) = (prepared(&cube(3)), Shape::Sphere { centre: [0.0; 3], radius: 1.0 });
    let other = MeshSolid::new(&other);
    let at = Pose::IDENTITY;
    let pair = BodyPair::new(PlacedBody::Shape(ball.at(&at)), PlacedBody::Mesh(mesh.at(&at)));
    for (mesh, shape) in
        [(BodyInterior::Mesh(&other), BodyInterior::Shape), (BodyInterior::Shape, BodyInterior::Mesh(&solid))]
    {
        let found = pair.penetration(&plan, [shape, mesh], &budget, scratch);
        assert!(found.upper == f64::INFINITY && found.lower == 0.0, "{found:?}");
    }
}
