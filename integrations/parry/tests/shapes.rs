//! Answers about a scan agree with those of nearmiss itself, and of parry about the exact surface.

use nearmiss::geometry::PointCloud;
use nearmiss::{BuildOptions, CollideOptions, Scan, Scratch, Semantics, Shape, ShapePlan, Target};
use nearmiss_parry::{ScanDispatcher, ScanShape, from_pose, to_pose};
use parry3d::math::{Pose, Vector};
use parry3d::query::{
    ClosestPoints, ContactManifold, DefaultQueryDispatcher, PersistentQueryDispatcher, PointQuery,
    QueryDispatcher, Ray, RayCast, ShapeCastOptions, Unsupported,
};
use parry3d::shape::{
    Ball, Capsule, Compound, Cone, ConvexPolyhedron, Cuboid, Cylinder, HalfSpace, HeightField, RoundShape,
    Segment, Shape as ParryShape, SharedShape, TriMesh, Triangle,
};
use rand::RngExt as _;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng as _;

/// The distance of neighbouring points of the floor.
const STEP: f64 = 0.02;

/// A floor of y = 0 from 0 to 1 along x and z.
fn floor() -> ScanShape {
    let points: Vec<[f64; 3]> =
        (0..51 * 51_u32).map(|i| [f64::from(i % 51) * STEP, 0.0, f64::from(i / 51) * STEP]).collect();
    let cloud = PointCloud::from_positions(&points).expect("points");
    ScanShape::new(Scan::build(&cloud, &BuildOptions::default()).expect("a scan")).expect("for shapes")
}

fn tetrahedron() -> ConvexPolyhedron {
    let corners = [[-0.1, -0.1, -0.1], [0.1, -0.1, 0.1], [-0.1, 0.1, 0.1], [0.1, 0.1, -0.1]];
    ConvexPolyhedron::from_convex_hull(&corners.map(Vector::from_array)).expect("a hull")
}

/// Shapes with a half height of 0.1, and how far each reaches below its centre.
fn shapes() -> Vec<(SharedShape, f32)> {
    let compound = Compound::new(vec![
        (Pose::translation(0.1, 0.0, 0.0), SharedShape::ball(0.1)),
        (Pose::translation(-0.1, 0.0, 0.0), SharedShape::cuboid(0.05, 0.1, 0.05)),
    ]);
    let mesh = |it: (Vec<Vector>, Vec<[u32; 3]>)| TriMesh::new(it.0, it.1).expect("a mesh");
    vec![
        (SharedShape::new(Ball::new(0.1)), 0.1),
        (SharedShape::new(Cuboid::new(Vector::new(0.15, 0.1, 0.12))), 0.1),
        (SharedShape::new(Capsule::new_x(0.1, 0.1)), 0.1),
        (SharedShape::new(Cylinder::new(0.1, 0.08)), 0.1),
        (SharedShape::new(Cone::new(0.1, 0.08)), 0.1),
        (
            SharedShape::new(RoundShape {
                inner_shape: Cuboid::new(Vector::splat(0.06)),
                border_radius: 0.04,
            }),
            0.1,
        ),
        (SharedShape::new(RoundShape { inner_shape: Cylinder::new(0.06, 0.05), border_radius: 0.04 }), 0.1),
        (SharedShape::new(RoundShape { inner_shape: tetrahedron(), border_radius: 0.02 }), 0.12),
        (SharedShape::new(tetrahedron()), 0.1),
        (SharedShape::new(Segment::new(Vector::new(0.0, -0.1, 0.0), Vector::new(0.05, 0.1, 0.0))), 0.1),
        (
            SharedShape::new(Triangle::new(
                Vector::new(0.0, -0.1, 0.0),
                Vector::new(0.1, 0.1, 0.0),
                Vector::new(-0.1, 0.1, 0.05),
            )),
            0.1,
        ),
        (SharedShape::new(compound), 0.1),
        (SharedShape::new(mesh(Cuboid::new(Vector::splat(0.1)).to_trimesh())), 0.1),
        (SharedShape::new(mesh(Ball::new(0.1).to_trimesh(12, 12))), 0.1),
    ]
}

fn dispatcher() -> impl PersistentQueryDispatcher {
    ScanDispatcher.chain(DefaultQueryDispatcher)
}

#[test]
fn all_shapes_rest_on_a_floor_in_either_order() {
    let (floor, dispatcher) = (floor(), dispatcher());
    for (shape, below) in shapes() {
        let kind = shape.shape_type();
        for gap in [-0.005_f32, 0.005, 0.2] {
            let pose = Pose::translation(0.5, below + gap, 0.5);
            for flipped in [false, true] {
                let name = format!("{kind:?}, gap {gap}, flipped {flipped}");
                let (g1, g2, pos12): (&dyn ParryShape, &dyn ParryShape, Pose) =
                    if flipped { (&*shape, &floor, pose.inverse()) } else { (&floor, &*shape, pose) };
                let meets = dispatcher.intersection_test(&pos12, g1, g2).expect("supported").intersecting;
                assert_eq!(meets, gap < 0.0, "{name}");
                let distance = dispatcher.distance(&pos12, g1, g2).expect("supported").distance;
                assert!((distance - gap.max(0.0)).abs() < 2e-4, "{name}: distance {distance}");

                let contact = dispatcher.contact(&pos12, g1, g2, 0.02).expect("supported");
                if gap > 0.02 {
                    assert!(contact.is_none(), "{name}: {contact:?}");
                } else {
                    let contact = contact.unwrap_or_else(|| panic!("{name}: expected a contact"));
                    assert!((contact.dist - gap).abs() < 1e-3, "{name}: {contact:?}");
                    let up = if flipped { contact.normal2 } else { contact.normal1 };
                    assert!(up.y > 0.999, "{name}: {contact:?}");
                    // Both points are given in the frames of their shapes.
                    let apart = pos12 * contact.point2 - contact.point1;
                    assert!((apart.dot(contact.normal1) - contact.dist).abs() < 1e-4, "{name}: {contact:?}");
                }
                let nearest = dispatcher.closest_points(&pos12, g1, g2, 0.1).expect("supported");
                match nearest {
                    ClosestPoints::Intersecting => assert!(gap < 0.0, "{name}"),
                    ClosestPoints::Disjoint => assert!(gap > 0.1, "{name}"),
                    ClosestPoints::WithinMargin(p1, p2) => {
                        let apart = (pos12 * p2 - p1).length();
                        assert!((apart - gap).abs() < 2e-4, "{name}: {apart}");
                    }
                }
            }
        }
    }
}

#[test]
fn half_spaces_and_height_fields_meet_scans() {
    let (floor, dispatcher) = (floor(), dispatcher());
    for (height, meets) in [(-0.01_f32, false), (0.01, true)] {
        let tilted = HalfSpace::new(Vector::new(0.0, 1.0, 0.0));
        let pose = Pose::new(Vector::new(30.0, height, -40.0), Vector::new(0.0, 0.3, 0.0));
        let answer = dispatcher.intersection_test(&pose, &floor, &tilted).expect("supported");
        assert_eq!(answer.intersecting, meets, "a half-space at {height}");
        let heights = parry3d::utils::Array2::repeat(8, 8, 0.0);
        let field = HeightField::new(heights, Vector::new(2.0, 1.0, 2.0));
        // Parallel sheets meet within the thickness that a scan has for shapes.
        let pose = Pose::new(Vector::new(0.5, 0.001, 0.5), Vector::new(0.02, 0.0, 0.0));
        let answer = dispatcher.intersection_test(&pose, &floor, &field).expect("supported");
        assert!(answer.intersecting, "a height field");
        let pose = Pose::translation(0.5, 0.3, 0.5);
        let distance = dispatcher.distance(&pose, &floor, &field).expect("supported").distance;
        assert!((distance - 0.3).abs() < 1e-3, "a height field at {distance}");
    }
}

#[test]
fn answers_are_those_of_nearmiss() {
    let dragon = nearmiss_testdata::dragon::dragon_mesh(nearmiss_testdata::dragon::Dragon::Points5k);
    let cloud = PointCloud::from_positions(dragon.expect("the dragon").vertices()).expect("points");
    let scan = Scan::build(&cloud, &BuildOptions::default()).expect("a scan");
    let options = CollideOptions::estimated().with_detail(nearmiss::Detail::Verdict);
    let plan = ShapePlan::new(&options, &scan).expect("a plan");
    let shape = ScanShape::new(scan.clone()).expect("for shapes");
    let (dispatcher, mut scratch) = (dispatcher(), Scratch::default());
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
    let capsule = Capsule::new_y(0.02, 0.01);
    let mut touching = 0;
    for _ in 0..1000 {
        let place = [0; 3].map(|_| random.random_range(-0.15_f32..0.15));
        let turn = [0; 3].map(|_| random.random_range(-2.0_f32..2.0));
        let pose = Pose::new(Vector::from_array(place), Vector::from_array(turn));
        let placed = from_pose(&pose);
        let ends = [-0.02_f32, 0.02].map(|y| placed.apply([0.0, f64::from(y), 0.0]));
        let solid = Shape::Capsule { ends, radius: f64::from(0.01_f32) };
        let target = Target::new(scan.at(&nearmiss::Pose::IDENTITY), &plan);
        let expected = target.touch(&solid, &mut scratch).verdict.is_touching();
        let answer = dispatcher.intersection_test(&pose, &shape, &capsule).expect("supported").intersecting;
        let distance = target.distance(&solid, f64::INFINITY, &mut scratch).expect("valid").upper;
        // Single precision may round a pose across the boundary.
        assert!(answer == expected || distance < 1e-6, "at {place:?}");
        let theirs = f64::from(dispatcher.distance(&pose, &shape, &capsule).expect("supported").distance);
        assert!((theirs - distance).abs() < 1e-6, "{theirs} and {distance}");
        touching += usize::from(answer);
    }
    assert!((50..950).contains(&touching), "{touching} of 1000 touch");
}

/// Balls about the points reach beyond the box of the scan.
#[test]
fn thickened_points_are_found_by_all_questions() {
    let dispatcher = dispatcher();
    let options = CollideOptions::estimated().with_semantics(Semantics::Thickened(0.3));
    let floor = ScanShape::with_options(floor().scan().clone(), &options).expect("for shapes");
    let top = floor.compute_local_aabb().maxs.y;
    assert!((0.3..0.33).contains(&top), "the box ends at {top}");
    let ball: SharedShape = SharedShape::ball(0.1);
    let parts = SharedShape::compound(vec![(Pose::translation(0.0, 0.01, 0.0), ball.clone())]);
    for (shape, up) in [(&ball, 0.39), (&parts, 0.38)] {
        let pose = Pose::translation(0.5, up, 0.5);
        let meets = dispatcher.intersection_test(&pose, &floor, &**shape).expect("supported");
        assert!(meets.intersecting, "a ball at {up}");
        let above = Pose::translation(0.5, up + 0.7, 0.5);
        let (fall, options) = (Vector::new(0.0, -1.0, 0.0), ShapeCastOptions::with_max_time_of_impact(10.0));
        let hit = dispatcher.cast_shapes(&above, fall, &floor, &**shape, options).expect("supported");
        let time = hit.expect("a hit").time_of_impact;
        assert!((time - 0.69).abs() < 1e-3, "after {time}");
    }
    let ray = Ray::new(Vector::new(0.5, 1.0, 0.5), Vector::new(0.0, -1.0, 0.0));
    let time = floor.cast_local_ray(&ray, 10.0, true).expect("a hit");
    assert!((time - 0.7).abs() < 1e-3, "{time}");
    let distance = dispatcher.distance(&Pose::translation(0.0, 1.0, 0.0), &floor, &floor);
    let distance = distance.expect("supported").distance;
    assert!((distance - 0.4).abs() < 1e-5, "{distance}");
}

#[test]
fn rays_points_and_cast_balls_find_the_floor() {
    let (floor, dispatcher) = (floor(), dispatcher());
    let down = Ray::new(Vector::new(0.51, 2.0, 0.47), Vector::new(0.0, -2.0, 0.0));
    let hit = floor.cast_local_ray_and_get_normal(&down, 10.0, true).expect("a hit");
    assert!((hit.time_of_impact - 1.0).abs() < 1e-4 && hit.normal.y > 0.999, "{hit:?}");
    assert!(floor.cast_local_ray(&down, 0.9, true).is_none(), "the floor is further");
    assert!(floor.intersects_local_ray(&down, 1.1), "the floor is nearer");
    let beside = Ray::new(Vector::new(1.5, 2.0, 0.5), Vector::new(0.0, -1.0, 0.0));
    assert!(floor.cast_local_ray(&beside, 10.0, true).is_none(), "nothing is there");

    let projected = floor.project_local_point(Vector::new(0.4, -0.3, 0.6), true);
    assert!(!projected.is_inside, "a surface has no inside");
    assert!((projected.point - Vector::new(0.4, 0.0, 0.6)).length() < 1e-4, "{projected:?}");
    let far = floor.project_local_point_with_max_dist(Vector::new(0.4, -0.3, 0.6), true, 0.2);
    assert!(far.is_none(), "{far:?}");
    let nowhere = floor.project_local_point(Vector::new(f32::NAN, 0.0, 0.0), true);
    assert!(nowhere.point.x.is_nan(), "{nowhere:?}");

    let (ball, options) = (Ball::new(0.1), ShapeCastOptions::with_max_time_of_impact(10.0));
    let pose = Pose::translation(0.5, 1.1, 0.5);
    let fall = Vector::new(0.0, -2.0, 0.0);
    let hit = dispatcher.cast_shapes(&pose, fall, &floor, &ball, options).expect("supported").expect("a hit");
    assert!((hit.time_of_impact - 0.5).abs() < 1e-3 && hit.normal1.y > 0.999, "{hit:?}");
    // In the frame of the ball, the floor rises.
    let turned = Pose::new(Vector::new(0.5, 1.1, 0.5), Vector::new(0.4, 0.0, 0.0));
    let rise = turned.rotation.inverse() * -fall;
    let hit = dispatcher.cast_shapes(&turned.inverse(), rise, &ball, &floor, options);
    let hit = hit.expect("supported").expect("a hit");
    assert!((hit.time_of_impact - 0.5).abs() < 1e-3, "{hit:?}");
    let touching = turned.rotation * hit.witness1;
    assert!((touching - Vector::new(0.0, -0.1, 0.0)).length() < 1e-3, "{hit:?}");
}

#[test]
fn manifolds_keep_the_data_of_a_solver() {
    type List = Vec<ContactManifold<(), u32>>;
    let floor = floor();
    let cube = Cuboid::new(Vector::splat(0.1));
    let (mut manifolds, mut workspace) = (List::new(), None);
    let mut ask = |manifolds: &mut List, pose: &Pose, flipped: bool| {
        let (g1, g2, pos12): (&dyn ParryShape, &dyn ParryShape, Pose) =
            if flipped { (&cube, &floor, pose.inverse()) } else { (&floor, &cube, *pose) };
        ScanDispatcher.contact_manifolds(&pos12, g1, g2, 0.01, manifolds, &mut workspace)
    };
    for flipped in [false, true] {
        manifolds.clear();
        ask(&mut manifolds, &Pose::translation(0.5, 0.098, 0.5), flipped).expect("supported");
        assert!(manifolds.len() >= 4, "a cube rests on {} contacts", manifolds.len());
        for (k, manifold) in (1..).zip(&mut manifolds) {
            manifold.points[0].data = k;
        }
        let before = manifolds.clone();
        // A twentieth of a step.
        ask(&mut manifolds, &Pose::translation(0.501, 0.0981, 0.5), flipped).expect("supported");
        let kept = manifolds.iter().filter(|it| it.points[0].data != 0).count();
        assert!(kept * 10 >= before.len() * 9, "{kept} of {} contacts kept their data", before.len());
        let place = |it: &ContactManifold<(), u32>| {
            let point = it.points[0];
            if flipped { point.local_p2 } else { point.local_p1 }
        };
        for manifold in manifolds.iter().filter(|it| it.points[0].data != 0) {
            let old = before.iter().find(|it| it.points[0].data == manifold.points[0].data).expect("known");
            assert!((place(old) - place(manifold)).length() < 0.04, "the contact moved to another place");
        }
        ask(&mut manifolds, &Pose::translation(0.5, 1.0, 0.5), flipped).expect("supported");
        assert!(manifolds.is_empty(), "the cube is away");
    }
    let pair = (Cuboid::new(Vector::splat(0.1)), Ball::new(0.1));
    let answer = ScanDispatcher.intersection_test(&Pose::IDENTITY, &pair.0, &pair.1);
    assert_eq!(answer.map(|it| it.intersecting), Err(Unsupported), "there is no scan");
}

#[test]
fn scans_meet_scans_and_scale() {
    let (floor, dispatcher) = (floor(), dispatcher());
    let wall = floor.clone();
    // Upright, through the middle of the floor and 0.1 below it.
    let pose = Pose::new(Vector::new(0.0, -0.1, 0.5), Vector::new(-std::f32::consts::FRAC_PI_2, 0.0, 0.0));
    assert!(
        dispatcher.intersection_test(&pose, &floor, &wall).expect("supported").intersecting,
        "they cross"
    );
    let above = Pose::new(Vector::new(0.0, 0.2, 0.5), Vector::new(-std::f32::consts::FRAC_PI_2, 0.0, 0.0));
    let distance = dispatcher.distance(&above, &floor, &wall).expect("supported").distance;
    assert!((distance - 0.2).abs() < 0.02, "{distance}");

    let large = floor.scale_dyn(Vector::splat(3.0), 0).expect("a uniform scale");
    assert!((large.compute_local_aabb().maxs.x - 3.0).abs() < 0.5, "{:?}", large.compute_local_aabb());
    let ball = Ball::new(0.1);
    let distance = dispatcher.distance(&Pose::translation(2.5, 0.5, 2.5), &*large, &ball);
    assert!((distance.expect("supported").distance - 0.4).abs() < 1e-3, "the scaled floor is below");
    assert!(floor.scale_dyn(Vector::new(1.0, 2.0, 1.0), 0).is_none(), "not uniform");
}

#[test]
fn a_closed_scan_weighs_as_its_mesh() {
    let dragon = nearmiss_testdata::dragon::dragon_mesh(nearmiss_testdata::dragon::Dragon::Points23k);
    let dragon = dragon.expect("the dragon");
    let cloud = PointCloud::from_positions(dragon.vertices()).expect("points");
    let scan = Scan::build(&cloud, &BuildOptions::default()).expect("a scan");
    let shape = ScanShape::new(scan).expect("for shapes").solid().expect("it is closed");
    #[expect(clippy::cast_possible_truncation, reason = "parry computes in single precision")]
    let vertices: Vec<_> =
        dragon.vertices().iter().map(|v| Vector::from_array(v.map(|c| c as f32))).collect();
    let exact = parry3d::mass_properties::MassProperties::from_trimesh(1.0, &vertices, dragon.triangles());
    let ours = shape.mass_properties(1.0);
    let share = ours.mass() / exact.mass();
    assert!((share - 1.0).abs() < 0.02, "{} of the mass", share);
    let size = shape.compute_local_aabb().half_extents().length();
    let away = (ours.local_com - exact.local_com).length();
    assert!(away < 0.01 * size, "the centre of mass is {away} beside");
    let sorted = |it: Vector| {
        let mut it = it.to_array();
        it.sort_by(f32::total_cmp);
        it
    };
    let [ours, exact] = [ours, exact].map(|it| sorted(it.principal_inertia()));
    for (a, b) in ours.iter().zip(exact) {
        assert!((a / b - 1.0).abs() < 0.03, "{ours:?} and {exact:?}");
    }
    assert!(floor().solid().is_none(), "a floor encloses nothing");
}

/// An ellipsoid with semi-axes of 1, 0.8 and 0.5, about a centre.
fn ellipsoid(centre: [f64; 3]) -> ScanShape {
    let points: Vec<[f64; 3]> = (0..6000_u32)
        .map(|k| {
            let (height, turn) = (f64::from(2 * k + 1) / 6000.0 - 1.0, 2.399_963 * f64::from(k));
            let across = (1.0 - height * height).sqrt();
            let place = [across * turn.cos(), 0.8 * across * turn.sin(), 0.5 * height];
            [0, 1, 2].map(|axis| centre[axis] + place[axis])
        })
        .collect();
    let cloud = PointCloud::from_positions(&points).expect("points");
    ScanShape::new(Scan::build(&cloud, &BuildOptions::default()).expect("a scan")).expect("for shapes")
}

/// Compares masses, centres of mass and inertia, with a tolerance as a share of each.
fn assert_same_mass(a: &ScanShape, b: &ScanShape, tolerance: f32) {
    let [a, b] = [a, b].map(|it| it.mass_properties(3.0));
    assert!((a.mass() / b.mass() - 1.0).abs() < tolerance, "{} and {}", a.mass(), b.mass());
    assert!((a.local_com - b.local_com).length() < tolerance, "{} and {}", a.local_com, b.local_com);
    let most = b.principal_inertia().max_element();
    let apart = a.reconstruct_inertia_matrix() - b.reconstruct_inertia_matrix();
    let off = apart.to_cols_array().into_iter().fold(0.0_f32, |off, it| off.max(it.abs()));
    assert!(off < tolerance * most, "inertia differs by {off} of {most}");
}

#[test]
fn mass_moves_and_scales_with_the_scan() {
    let pose = nearmiss::Pose::from_axis_angle([1.0, 2.0, 3.0], 0.7).with_scale(0.5);
    let pose = pose.with_translation([3.0, -1.0, 2.0]);
    let raw = ellipsoid([0.3, 0.0, 0.0]);
    let solid = raw.clone().solid().expect("it is closed");
    let placed = solid.clone().placed(&pose);
    assert_same_mass(&placed, &raw.clone().placed(&pose).solid().expect("it is closed"), 0.01);
    let exact = 4.0 / 3.0 * std::f32::consts::PI * 0.8 * 0.5 * 0.125;
    let mass = placed.mass_properties(1.0).mass();
    assert!((mass / exact - 1.0).abs() < 0.02, "{mass}, exact {exact}");

    // The last pose counts, and the mass of a pose that is undone is the mass before.
    let other = nearmiss::Pose::from_axis_angle([0.0, 1.0, 0.0], -2.0).with_scale(7.0);
    assert_same_mass(&placed.clone().placed(&other).placed(&pose), &placed, 1e-4);
    assert_same_mass(&placed.clone().placed(&nearmiss::Pose::IDENTITY), &solid, 1e-4);
    let doubled = placed.scale_dyn(Vector::splat(2.0), 0).expect("a uniform scale");
    assert!((doubled.mass_properties(1.0).mass() / mass - 8.0).abs() < 1e-3, "eight times the mass");
    assert!(raw.placed(&pose).mass_properties(1.0).mass() == 0.0, "a surface has no mass");
}

#[test]
fn the_centre_of_mass_of_a_survey_is_exact() {
    let away = [5_300_000.25, -420_000.5, 310.125];
    let near = nearmiss::Pose::from_translation(away.map(|c| -c));
    let solid = ellipsoid(away).solid().expect("it is closed").placed(&near);
    let centre = solid.mass_properties(1.0).local_com;
    assert!(centre.length() < 2e-3, "{centre}");
}

#[test]
fn poses_convert_in_both_directions() {
    let pose = Pose::new(Vector::new(1.0, 2.0, 3.0), Vector::new(0.4, -1.2, 0.3));
    for scale in [0.001, 1.0, 40.0] {
        let back = to_pose(&from_pose(&pose).with_scale(scale));
        let apart = back.rotation.angle_between(pose.rotation);
        let unit = back.rotation.length();
        assert!(back.translation == pose.translation && apart < 1e-3, "{back:?}, scale {scale}");
        assert!((unit - 1.0).abs() < 1e-5, "a rotation of length {unit}, scale {scale}");
    }
}
