//! Penetrations of convex shapes with meshes and with each other.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_geometry::{Pose, TriangleMesh};
use nearmiss_hierarchy::{MeshBuildOptions, MeshHierarchy};
use nearmiss_query::{
    AsShape, Budget, Evidence, MeshPair, MeshScratch, MeshSolid, Penetration, PlacedMesh, Scratch, Shape,
    ShapeMeshPair, ShapePair,
};
use nearmiss_testdata::arbitrary::{point_in, rng, rotation, unit_vector};
use rand::RngExt;

use crate::mesh_scan_penetration::box_mesh;

type Vector = Vector3<f64>;

fn shifted(pose: &Pose, t: Vector) -> Pose {
    pose.with_translation((Vector::from(pose.translation()) + t).into())
}

fn of_mesh(
    (mesh, parts, at): (&MeshHierarchy, &MeshSolid, &Pose),
    (shape, pose): (&Shape<'_>, &Pose),
    budget: &Budget,
    scratch: &mut Scratch,
) -> Penetration {
    ShapeMeshPair::new(PlacedMesh::new(mesh, at), shape.at(pose)).penetration(parts, budget, scratch)
}

/// Two boxes as shapes, as a mesh and a shape, and as two meshes, at random poses with scales. The first is
/// exact.
#[test]
fn boxes_penetrate_alike_as_shapes_and_meshes() {
    let (rng, scratch, meshes) = (&mut rng(6617), &mut Scratch::default(), &mut MeshScratch::default());
    let (mut deep, mut same, mut best, mut half_way) = (0, 0, 0, 0);
    for _ in 0..200 {
        let halves = [(); 2].map(|()| [0, 1, 2].map(|_| rng.random_range(0.1..1.0)));
        let [a, b] = halves.map(|half| Shape::Box { pose: Pose::IDENTITY, half, radius: 0.0 });
        let boxes = halves.map(box_mesh);
        let parts = boxes.each_ref().map(MeshSolid::new);
        let scale = rng.random_range(0.1..10.0);
        let frame = rotation(rng).with_scale(scale).with_translation([3.0, -2.0, 1.0]);
        let pose = frame.after(&rotation(rng).with_translation(point_in(rng, 1.0)));
        let exact = ShapePair::new(a.at(&frame), b.at(&pose)).penetration();
        let found = of_mesh((&boxes[0], &parts[0], &frame), (&b, &pose), &Budget::UNLIMITED, scratch);
        let pair = MeshPair::new(PlacedMesh::new(&boxes[0], &frame), PlacedMesh::new(&boxes[1], &pose));
        let twin = pair.penetration([&parts[0], &parts[1]], meshes);
        let off = 1e-5 * scale;
        assert!(exact.upper - exact.lower <= off, "{exact:?}");
        assert!(found.complete && found.evidence == Evidence::Certified);
        for found in [&found, &twin] {
            assert!(
                found.lower <= exact.upper + off && found.upper >= exact.lower - off,
                "{exact:?} {found:?}"
            );
        }
        if exact.upper <= off {
            assert!(found.upper <= 2.0 * off, "{exact:?} {found:?}");
            continue;
        }
        deep += 1;
        same += u32::from(found.upper <= exact.upper * 1.01);
        best += u32::from(twin.upper <= exact.upper * 1.01);
        half_way += u32::from(found.lower >= 0.5 * found.upper);
        let parted = shifted(&pose, Vector::from(found.direction) * found.upper * (1.0 + 1e-6));
        let again = of_mesh((&boxes[0], &parts[0], &frame), (&b, &parted), &Budget::UNLIMITED, scratch);
        assert_eq!(again.upper, 0.0, "{found:?}");
    }
    assert!(deep > 80 && same * 10 > deep * 9, "{deep} deep, {same} exact, {best} of meshes");
    assert!(half_way * 10 > deep * 9, "{half_way} of {deep} with half the bound");
}

/// All shapes in random triangles that enclose nothing: no shorter shift than the lower bound parts them,
/// and the upper bound does. With and without a budget.
#[test]
fn shapes_in_open_meshes() {
    let (rng, scratch) = (&mut rng(6618), &mut Scratch::default());
    let (mut touching, mut useful) = (0, 0);
    for round in 0..150_u32 {
        let count = rng.random_range(1..30);
        let corners: Vec<[f64; 3]> = (0..3 * count).map(|_| point_in(rng, 1.0)).collect();
        let triangles = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mesh = TriangleMesh::new(corners, triangles).unwrap();
        let mesh = MeshHierarchy::build(&mesh, &MeshBuildOptions::default()).unwrap();
        let parts = MeshSolid::new(&mesh);
        let places: Vec<[f64; 3]> = (0..6).map(|_| point_in(rng, 0.4)).collect();
        let radius = rng.random_range(0.0..0.2);
        let (own, half) = (rotation(rng), [0, 1, 2].map(|_| rng.random_range(0.05..0.4)));
        let shape = match round % 6 {
            0 => Shape::Sphere { centre: places[0], radius },
            1 => Shape::Capsule { ends: [places[0], places[1]], radius },
            2 => Shape::Box { pose: own, half, radius },
            3 => Shape::Cylinder { pose: own, half_height: half[0], radius: half[1], rounding: radius },
            4 => Shape::Cone { pose: own, half_height: half[0], radius: half[1], rounding: 0.0 },
            _ => Shape::Hull { points: &places, radius: 0.0 },
        };
        let (at, pose) = (rotation(rng).with_scale(2.0), Pose::from_translation(point_in(rng, 1.5)));
        for budget in [Budget::UNLIMITED, Budget::UNLIMITED.with_work(40)] {
            let found = of_mesh((&mesh, &parts, &at), (&shape, &pose), &budget, scratch);
            assert!(found.lower <= found.upper && found.upper.is_finite(), "{found:?}");
            let distance = |t: Vector, scratch: &mut Scratch| {
                let pose = shifted(&pose, t);
                ShapeMeshPair::new(PlacedMesh::new(&mesh, &at), shape.at(&pose)).distance(0.0, scratch)
            };
            let out = Vector::from(found.direction) * found.upper;
            assert!(distance(out * (1.0 + 1e-6), scratch).is_none(), "{shape:?} {found:?}");
            if found.lower == 0.0 {
                assert!(!found.complete || found.upper == 0.0 || radius == 0.0, "{shape:?} {found:?}");
                continue;
            }
            if budget == Budget::UNLIMITED {
                touching += 1;
                useful += u32::from(found.lower >= 0.5 * found.upper);
            }
            for _ in 0..20 {
                let t = Vector::from(unit_vector(rng)) * (found.lower * rng.random_range(0.0..0.9999));
                assert!(distance(t, scratch).is_some(), "{t} of {found:?} parts {shape:?}");
            }
        }
    }
    assert!(touching > 50 && useful * 5 > touching * 4, "{touching} touching, {useful} with half the bound");
}

/// Spheres and boxes inside a closed box of a mesh, at scales, which no triangle touches.
#[test]
fn shapes_inside_closed_meshes() {
    let (rng, scratch) = (&mut rng(6619), &mut Scratch::default());
    let mesh = box_mesh([1.0, 1.2, 1.5]);
    let parts = MeshSolid::new(&mesh);
    let case = Shape::Box { pose: Pose::IDENTITY, half: [1.0, 1.2, 1.5], radius: 0.0 };
    for round in 0..60 {
        let scale = rng.random_range(0.1..10.0);
        let frame = rotation(rng).with_scale(scale).with_translation([3.0, -2.0, 1.0]);
        let half = [0, 1, 2].map(|_| rng.random_range(0.02..0.2));
        let shape = if round % 2 == 0 {
            Shape::Sphere { centre: [0.0; 3], radius: half[0] }
        } else {
            Shape::Box { pose: Pose::IDENTITY, half, radius: 0.0 }
        };
        let pose = frame.after(&rotation(rng).with_translation(point_in(rng, 0.6)));
        let exact = ShapePair::new(case.at(&frame), shape.at(&pose)).penetration();
        let found = of_mesh((&mesh, &parts, &frame), (&shape, &pose), &Budget::UNLIMITED, scratch);
        assert!((found.upper - exact.upper).abs() < 0.01 * exact.upper, "{exact:?} {found:?}");
        assert!(found.lower <= exact.upper * (1.0 + 1e-9), "{exact:?} {found:?}");
        assert!(found.lower >= 0.7 * exact.upper, "{exact:?} {found:?}");
    }
}

/// The work of a search ends near its limit.
#[test]
fn searches_end_with_their_budget() {
    let mesh = box_mesh([1.0, 1.2, 1.5]);
    let parts = MeshSolid::new(&mesh);
    let (shape, pose) =
        (Shape::Sphere { centre: [0.0; 3], radius: 0.3 }, Pose::from_translation([0.9, 0.1, 0.2]));
    let scratch = &mut Scratch::default();
    let mut ask =
        |budget: &Budget| of_mesh((&mesh, &parts, &Pose::IDENTITY), (&shape, &pose), budget, scratch);
    let whole = ask(&Budget::UNLIMITED);
    assert!(whole.complete && whole.statistics.evaluations > 500, "{whole:?}");
    for work in [1, 20, 200] {
        let found = ask(&Budget::UNLIMITED.with_work(work));
        // A shift looks at the triangles of the mesh once.
        assert!(!found.complete && found.statistics.evaluations <= work + 26, "{found:?}");
        assert!(found.lower <= whole.upper && found.upper >= whole.upper * (1.0 - 1e-5), "{found:?}");
    }
}

/// Cores that are flat together, apart by less than rounding, or far from the origin.
#[test]
fn flat_and_far_shapes_have_tight_bounds() {
    let ball = |centre, radius| Shape::Sphere { centre, radius };
    let pair = |a: &Shape<'_>, b: &Shape<'_>| {
        ShapePair::new(a.at(&Pose::IDENTITY), b.at(&Pose::IDENTITY)).penetration()
    };
    // Beside the longest edge, in the plane of the triangle.
    let triangle =
        Shape::Triangle { points: [[0.0; 3], [1000.0, 0.0, 0.0], [0.0, 1000.0, 0.0]], radius: 0.0 };
    let off = 4e-7 / 2.0_f64.sqrt();
    for radius in [1e-6, 4.1e-7] {
        let found = pair(&triangle, &ball([500.0 + off, 500.0 + off, 0.0], radius));
        let exact = radius - 4e-7;
        assert!((found.lower - exact).abs() < 1e-11 && (found.upper - exact).abs() < 1e-10, "{found:?}");
    }
    // A square that is tilted by 45 degrees.
    let h = 0.125_f64.sqrt();
    let square = [[-0.5, -h, -h], [0.5, -h, -h], [-0.5, h, h], [0.5, h, h]];
    let found = pair(&Shape::Hull { points: &square, radius: 0.0 }, &ball([0.0; 3], 0.1));
    assert!(found.lower > 0.1 - 1e-9 && found.upper < 0.1 + 1e-8, "{found:?}");
    assert!((found.direction[1] + found.direction[2]).abs() < 1e-6, "{found:?}");
    let line = [[0.0; 3], [1.0, 2.0, 3.0], [2.0, 4.0, 6.0]];
    let found = pair(&Shape::Hull { points: &line, radius: 0.0 }, &ball([0.5, 1.0, 1.5], 0.1));
    assert!(found.lower > 0.1 - 1e-9 && found.upper < 0.1 + 1e-8, "{found:?}");
    // The shift separates, without more.
    let rng = &mut rng(6620);
    for round in 0..300 {
        let far = [0.0, 1e3, 1e6][round % 3];
        let radius = [0.0, 0.2][round % 2];
        let at = |rng: &mut _| rotation(rng).with_translation(point_in(rng, 0.7).map(|c| c + far));
        let a = Shape::Box { pose: at(rng), half: [0.5, 0.4, 0.3], radius };
        let b = Shape::Cylinder { pose: at(rng), half_height: 0.4, radius: 0.3, rounding: 0.0 };
        let found = pair(&a, &b);
        if found.upper == 0.0 {
            continue;
        }
        let out = Pose::from_translation(found.direction.map(|c| c * found.upper));
        let gap = ShapePair::new(a.at(&Pose::IDENTITY), b.at(&out)).distance().unwrap();
        let off = 1e-9 + 1e-15 * far;
        assert!(gap.upper < 1e-6 + 1e2 * off, "{found:?} {gap:?}");
        assert!(gap.lower > 0.0 || far > 0.0, "{found:?} {gap:?}");
    }
}

/// An invalid shape, pose or solid gives no known penetration.
#[test]
fn invalid_pairs_have_no_penetration() {
    let (mesh, other) = (box_mesh([1.0; 3]), box_mesh([2.0; 3]));
    let scratch = &mut Scratch::default();
    let ball = |radius| Shape::Sphere { centre: [0.0; 3], radius };
    let mut ask = |parts: &MeshSolid, shape: &Shape<'_>, pose: &Pose| {
        of_mesh((&mesh, parts, &Pose::IDENTITY), (shape, pose), &Budget::UNLIMITED, scratch).upper
    };
    let own = MeshSolid::new(&mesh);
    assert!((ask(&own, &ball(0.5), &Pose::IDENTITY) - 1.5).abs() < 1e-5);
    assert_eq!(ask(&MeshSolid::new(&other), &ball(0.5), &Pose::IDENTITY), f64::INFINITY);
    assert_eq!(ask(&own, &ball(-0.5), &Pose::IDENTITY), f64::INFINITY);
    let nowhere = Pose::from_translation([f64::NAN; 3]);
    assert_eq!(ask(&own, &ball(0.5), &nowhere), f64::INFINITY);
    let pair = |a: Shape<'_>, b: Shape<'_>| {
        ShapePair::new(a.at(&Pose::IDENTITY), b.at(&Pose::IDENTITY)).penetration().upper
    };
    assert_eq!(pair(ball(0.5), ball(f64::NAN)), f64::INFINITY);
    assert!((pair(ball(0.5), ball(0.25)) - 0.75).abs() < 1e-8);
}
