//! Shapes that are cast at a scan stop where they touch it first.

use nearmiss::geometry::PointCloud;
use nearmiss::{BuildOptions, Scan};
use nearmiss_parry::{ScanDispatcher, ScanShape};
use nearmiss_testdata::dragon::{Dragon, dragon_mesh};
use parry3d::math::{Pose, Vector};
use parry3d::query::{
    NonlinearRigidMotion, QueryDispatcher as _, ShapeCastHit, ShapeCastOptions, ShapeCastStatus,
};
use parry3d::shape::{
    Ball, Capsule, Compound, Cone, ConvexPolyhedron, Cuboid, Cylinder, HalfSpace, RoundShape, Shape as _,
    SharedShape, TriMesh,
};
use rand::RngExt as _;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng as _;

/// A floor of y = 0 from 0 to 1 along x and z.
fn floor() -> ScanShape {
    let points: Vec<[f64; 3]> =
        (0..51 * 51_u32).map(|i| [f64::from(i % 51) * 0.02, 0.0, f64::from(i / 51) * 0.02]).collect();
    let cloud = PointCloud::from_positions(&points).expect("points");
    ScanShape::new(Scan::build(&cloud, &BuildOptions::default()).expect("a scan")).expect("for shapes")
}

fn dragon() -> ScanShape {
    let mesh = dragon_mesh(Dragon::Points5k).expect("the dragon");
    let cloud = PointCloud::from_positions(mesh.vertices()).expect("points");
    ScanShape::new(Scan::build(&cloud, &BuildOptions::default()).expect("a scan")).expect("for shapes")
}

fn hull(size: f32) -> ConvexPolyhedron {
    let corners = [[-1.0, -1.0, -1.0], [1.0, -1.0, 1.0], [-1.0, 1.0, 1.0], [1.0, 1.0, -1.0]];
    let corners = corners.map(|p: [f32; 3]| Vector::from_array(p.map(|c| c * size)));
    ConvexPolyhedron::from_convex_hull(&corners).expect("a hull")
}

/// Shapes of half height `size`, which reach as far below their centres.
fn shapes(size: f32) -> Vec<SharedShape> {
    let compound = Compound::new(vec![
        (Pose::translation(size, 0.0, 0.0), SharedShape::ball(size)),
        (Pose::translation(-size, 0.0, 0.0), SharedShape::cuboid(0.5 * size, size, 0.5 * size)),
    ]);
    let (vertices, triangles) = Cuboid::new(Vector::splat(size)).to_trimesh();
    let inner_shape = Cuboid::new(Vector::splat(0.6 * size));
    vec![
        SharedShape::new(Ball::new(size)),
        SharedShape::new(Cuboid::new(Vector::new(1.5, 1.0, 1.2) * size)),
        SharedShape::new(Capsule::new_x(size, size)),
        SharedShape::new(Cylinder::new(size, 0.8 * size)),
        SharedShape::new(Cone::new(size, 0.8 * size)),
        SharedShape::new(RoundShape { inner_shape, border_radius: 0.4 * size }),
        SharedShape::new(hull(size)),
        SharedShape::new(compound),
        SharedShape::new(TriMesh::new(vertices, triangles).expect("a mesh")),
    ]
}

#[test]
fn all_shapes_stop_at_a_floor_in_either_order() {
    let (floor, options) = (floor(), ShapeCastOptions::with_max_time_of_impact(f32::MAX));
    for shape in shapes(0.1) {
        let name = shape.shape_type();
        // In the frame of the floor, from a height of 1 with a speed of 2.
        let pose = Pose::new(Vector::new(0.5, 1.1, 0.5), Vector::new(0.0, 0.7, 0.0));
        let fall = Vector::new(0.0, -2.0, 0.0);
        let cast = |options: ShapeCastOptions| {
            let straight =
                ScanDispatcher.cast_shapes(&pose, fall, &floor, &*shape, options).expect("supported");
            let rise = pose.rotation.inverse() * -fall;
            let flipped = ScanDispatcher.cast_shapes(&pose.inverse(), rise, &*shape, &floor, options);
            (straight, flipped.expect("supported").map(ShapeCastHit::swapped))
        };
        let (straight, flipped) = cast(options);
        for hit in [straight, flipped] {
            let hit = hit.expect("a hit");
            // Within the thickness of a scan for shapes: a twentieth of a disc.
            assert!((hit.time_of_impact - 0.5).abs() < 1e-3, "{name:?}: {hit:?}");
            assert!(hit.normal1.y > 0.999 && hit.status == ShapeCastStatus::Converged, "{name:?}: {hit:?}");
            assert!(hit.witness1.y.abs() < 1e-4, "{name:?}: {hit:?}");
            let touching = pose * hit.witness2 + fall * hit.time_of_impact;
            assert!((touching - hit.witness1).length() < 3e-3, "{name:?}: {hit:?}");
            assert!((pose.rotation * hit.normal2 + hit.normal1).length() < 1e-4, "{name:?}: {hit:?}");
        }
        let (near, _) = cast(ShapeCastOptions { target_distance: 0.2, ..options });
        assert!((near.expect("a hit").time_of_impact - 0.4).abs() < 1e-3, "{name:?}: {near:?}");
        let (short, flipped) = cast(ShapeCastOptions::with_max_time_of_impact(0.49));
        assert!(
            short.is_none() && flipped.is_none(),
            "{name:?}: the floor is further: {short:?} {flipped:?}"
        );
        // In the floor at first.
        let inside = Pose::translation(0.5, 0.05, 0.5);
        for (velocity, stops, hits) in [(fall, false, true), (-fall, false, false), (-fall, true, true)] {
            let options = ShapeCastOptions { stop_at_penetration: stops, ..options };
            let hit =
                ScanDispatcher.cast_shapes(&inside, velocity, &floor, &*shape, options).expect("supported");
            assert_eq!(hit.is_some(), hits, "{name:?} with {velocity}: {hit:?}");
            let status = ShapeCastStatus::PenetratingOrWithinTargetDist;
            assert!(
                hit.is_none_or(|it| it.time_of_impact == 0.0 && it.status == status),
                "{name:?}: {hit:?}"
            );
        }
    }
    // A half-space that comes from below.
    let below = HalfSpace::new(Vector::Y);
    let pose = Pose::new(Vector::new(5.0, -1.0, 3.0), Vector::ZERO);
    let hit = ScanDispatcher.cast_shapes(&pose, Vector::Y * 4.0, &floor, &below, options).expect("supported");
    assert!((hit.expect("a hit").time_of_impact - 0.25).abs() < 1e-3, "{hit:?}");
}

#[test]
fn a_scan_stops_at_a_scan_where_small_steps_touch_first() {
    let (floor, dragon) = (floor(), dragon());
    let mut random = Xoshiro256PlusPlus::seed_from_u64(9);
    let mut vector = |size: f32| Vector::from_array([0; 3].map(|_| random.random_range(-size..size)));
    let small = dragon.placed(&nearmiss::Pose::IDENTITY.with_scale(2.0));
    let touches = |pose: &Pose| {
        let found = ScanDispatcher.intersection_test(pose, &floor, &small);
        found.expect("supported").intersecting
    };
    for round in 0..6 {
        let pose = Pose::new(Vector::new(0.5, 0.8, 0.5) + vector(0.1), vector(3.0));
        let velocity = Vector::new(0.0, -1.0, 0.0) + vector(0.2);
        let options = ShapeCastOptions::with_max_time_of_impact(2.0);
        let hit = ScanDispatcher.cast_shapes(&pose, velocity, &floor, &small, options).expect("supported");
        let hit = hit.expect("it falls on the floor");
        let away = pose.rotation.inverse() * -velocity;
        let flipped = ScanDispatcher.cast_shapes(&pose.inverse(), away, &small, &floor, options);
        let flipped = flipped.expect("supported").expect("a hit").swapped();
        assert!((hit.time_of_impact - flipped.time_of_impact).abs() < 0.008, "{hit:?} {flipped:?}");
        let moved = |time: f32| Pose::from_parts(pose.translation + velocity * time, pose.rotation);
        let first = (0..2000_u16).map(|k| f32::from(k) * 1e-3).find(|&time| touches(&moved(time)));
        let first = first.expect("small steps touch");
        // Tests are a quarter of a spacing of 0.02 apart, and contacts count within a twentieth of a disc.
        assert!((hit.time_of_impact - first).abs() < 0.008, "round {round}: {hit:?}, small steps {first}");
        // The normal is that of either surface; the dragon is round.
        assert!(hit.normal1.y > 0.9 && hit.witness1.y.abs() < 0.01, "round {round}: {hit:?}");
        let on_small = moved(hit.time_of_impact) * hit.witness2;
        assert!((on_small - hit.witness1).length() < 0.01, "round {round}: {hit:?} {on_small}");
        let short = ShapeCastOptions::with_max_time_of_impact(first - 0.01);
        let none = ScanDispatcher.cast_shapes(&pose, velocity, &floor, &small, short).expect("supported");
        assert!(none.is_none(), "round {round}: {none:?}, small steps {first}");
        // The same, while it turns about its middle.
        let middle = small.compute_local_aabb().center();
        let turning = NonlinearRigidMotion::new(pose, middle, velocity, vector(3.0));
        let still = NonlinearRigidMotion::constant_position(Pose::IDENTITY);
        let cast = |stops: bool| {
            let hit = ScanDispatcher.cast_shapes_nonlinear(&still, &floor, &turning, &small, 0.0, 2.0, stops);
            hit.expect("supported").expect("a hit").time_of_impact
        };
        let first = (0..2000_u16)
            .map(|k| f32::from(k) * 1e-3)
            .find(|&time| touches(&turning.position_at_time(time)))
            .expect("small steps touch");
        assert!((cast(true) - first).abs() < 0.008, "round {round}: {}, small steps {first}", cast(true));
        assert_eq!(cast(false), cast(true), "they are apart at first");
    }
}

#[test]
fn compounds_with_scans_are_refused_rather_than_passed() {
    let floor = floor();
    let compound = Compound::new(vec![(Pose::IDENTITY, floor.clone().shared())]);
    let found = ScanDispatcher.intersection_test(&Pose::IDENTITY, &floor, &compound);
    assert!(found.is_err(), "expected no answer, got {found:?}");
}

#[test]
fn turning_shapes_stop_where_small_steps_touch_first() {
    let dragon = dragon();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(4);
    let mut vector = |size: f32| Vector::from_array([0; 3].map(|_| random.random_range(-size..size)));
    let (mut hits, mut misses) = (0, 0);
    for round in 0..18 {
        let shape = &shapes(0.01)[round % 9];
        let of_scan = NonlinearRigidMotion::new(
            Pose::new(vector(1.0), vector(2.0)),
            vector(0.05),
            vector(1.0),
            vector(4.0),
        );
        let start = of_scan.start * Pose::new(vector(0.15) + Vector::new(0.2, 0.0, 0.0), vector(2.0));
        // Towards the scan, seen from it.
        let middle = of_scan.start * dragon.compute_local_aabb().center();
        let towards = of_scan.linvel + (middle - start.translation) * 6.0 + vector(0.3);
        let of_other = NonlinearRigidMotion::new(start, vector(0.005), towards, vector(10.0));
        let (from, to) = (0.02, 0.3);
        let touches = |time: f32| {
            let [a, b] = [of_scan, of_other].map(|it| it.position_at_time(time));
            let answer = ScanDispatcher.intersection_test(&a.inv_mul(&b), &dragon, &**shape);
            answer.expect("supported").intersecting
        };
        let steps = 2000_u16;
        let at = |k: u16| from + (to - from) * f32::from(k) / f32::from(steps);
        let first = (0..=steps).map(at).find(|&time| touches(time));
        let cast = |stops: bool| {
            ScanDispatcher
                .cast_shapes_nonlinear(&of_scan, &dragon, &of_other, &**shape, from, to, stops)
                .expect("supported")
        };
        let flipped = ScanDispatcher
            .cast_shapes_nonlinear(&of_other, &**shape, &of_scan, &dragon, from, to, true)
            .expect("supported");
        let hit = cast(true);
        let away = hit.zip(flipped).map_or(0.0, |(a, b)| (a.time_of_impact - b.time_of_impact).abs());
        assert!(hit.is_some() == flipped.is_some() && away < 1e-6, "round {round}: {hit:?} {flipped:?}");
        // Some 3 a second by the far end, and a path of pieces.
        let error = first.zip(hit).map_or(0.0, |(first, hit)| (first - hit.time_of_impact).abs() * 3.0);
        assert!(error < 0.004, "round {round}, {:?}: {hit:?}, in small steps {first:?}", shape.shape_type());
        match (first, hit) {
            (None, None) => misses += 1,
            (Some(_), None) => panic!("round {round}: it touches at {first:?}"),
            _ => hits += 1,
        }
    }
    assert!(hits >= 6 && misses >= 3, "{hits} hits, {misses} misses");
}

#[test]
fn a_shape_in_contact_does_not_pass_by_its_centre() {
    let floor = floor();
    let cube = Cuboid::new(Vector::splat(0.1));
    let still = NonlinearRigidMotion::constant_position(Pose::IDENTITY);
    // It touches the floor, and is thrown through it.
    let start = Pose::translation(0.5, 0.0999, 0.5);
    let thrown = NonlinearRigidMotion::new(
        start,
        Vector::ZERO,
        Vector::new(1.0, -4.0, 0.0),
        Vector::new(0.0, 0.0, 3.0),
    );
    let cast = |stops: bool| {
        let hit = ScanDispatcher.cast_shapes_nonlinear(&still, &floor, &thrown, &cube, 0.0, 0.1, stops);
        hit.expect("supported").expect("a hit")
    };
    assert_eq!(cast(true).time_of_impact, 0.0, "they touch");
    // The ball about the centre has a radius of 0.025.
    let hit = cast(false);
    assert!((hit.time_of_impact - 0.0749 / 4.0).abs() < 1e-3, "{hit:?}");
    let away = NonlinearRigidMotion { linvel: Vector::new(1.0, 4.0, 0.0), ..thrown };
    let hit = ScanDispatcher.cast_shapes_nonlinear(&still, &floor, &away, &cube, 0.0, 0.1, false);
    assert!(hit.expect("supported").is_none(), "it leaves");
}
