//! The direction in which contacts move a shape out: of balls inside it, and on which side of surfaces.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
use nearmiss_query::{
    CollideOptions, Placed, Scratch, Semantics, Shape, ShapeContact, ShapeHint, ShapePlan, Target,
};
use nearmiss_testdata::arbitrary::{point_in, rng, rotation};

type Vector = Vector3<f64>;

const ZERO: Vector = Vector::new(0.0, 0.0, 0.0);

/// Scans sheets of 2 × 2, given by the middle of an edge and the two directions along each, with a spacing of
/// 0.05.
fn sheets(of: &[[Vector; 3]]) -> PointHierarchy {
    let steps = |n: u32| (0..=n).map(|i| 0.05 * f64::from(i));
    let points: Vec<[f64; 3]> = of
        .iter()
        .flat_map(|[from, side, up]| {
            steps(40).flat_map(move |a| steps(40).map(move |b| (from + side * (a - 1.0) + up * b).into()))
        })
        .collect();
    PointHierarchy::build(&PointCloud::from_positions(&points).unwrap(), &BuildOptions::default()).unwrap()
}

/// Asks for contacts with a hint at one place after the other.
fn follow(scan: &PointHierarchy, radius: f64, centres: &[[f64; 3]]) -> Vec<Vec<ShapeContact>> {
    let plan = ShapePlan::new(&CollideOptions::default(), scan).unwrap();
    let target = Target::new(Placed::new(scan, &Pose::IDENTITY), &plan);
    let (mut hint, mut scratch) = (ShapeHint::default(), Scratch::default());
    let contacts = centres.iter().map(|&centre| {
        let mut contacts = Vec::new();
        target.contacts_hinted(&Shape::Sphere { centre, radius }, &mut hint, &mut contacts, &mut scratch);
        contacts
    });
    contacts.collect()
}

/// A ball that touched one side of a groove stays inside the groove when it touches the other one.
#[test]
fn a_contact_does_not_decide_about_another_sheet() {
    for half_angle in [15.0_f64, 20.0, 30.0, 45.0, 60.0] {
        let (sin, cos) = half_angle.to_radians().sin_cos();
        let (left, right) = (Vector::new(-sin, 0.0, cos), Vector::new(sin, 0.0, cos));
        let scan = sheets(&[[ZERO, Vector::y(), left], [ZERO, Vector::y(), right]]);
        // Both sides are `radius` away from the middle.
        let radius = 0.1;
        let at = |x: f64| [x / cos, 0.0, radius / sin];
        let found = follow(&scan, radius, &[at(-0.02), at(0.02), at(-0.02)]);
        for (contacts, side) in found.iter().zip([1.0, -1.0, 1.0]) {
            let inwards = Vector::new(side * cos, 0.0, sin);
            let deepest = contacts.first().unwrap_or_else(|| panic!("no contact, {half_angle}° {side}"));
            let along = Vector::from(deepest.normal).dot(&inwards);
            assert!(along > 0.9 && (deepest.depth - 0.02).abs() < 0.02, "{half_angle}° {side}: {deepest:?}");
        }
    }
}

/// A ball between a floor and a ceiling is pushed away from both.
#[test]
fn a_contact_with_the_floor_does_not_decide_about_the_ceiling() {
    let ceiling = Vector::new(0.0, 0.0, 0.15);
    let scan = sheets(&[[ZERO, Vector::y(), Vector::x()], [ceiling, Vector::y(), Vector::x()]]);
    let found = follow(&scan, 0.08, &[[1.0, 0.0, 0.065], [1.0, 0.0, 0.075], [1.0, 0.0, 0.085]]);
    for (contacts, [up, down]) in found.iter().zip([[0.015, -1.0], [0.005, 0.005], [-1.0, 0.015]]) {
        for contact in contacts {
            let depth = if contact.normal[2] > 0.9 { up } else { down };
            assert!((contact.depth - depth).abs() < 4e-3, "{depth}: {contacts:?}");
        }
        assert!(!contacts.is_empty(), "it touches");
    }
}

/// A ball whose centre sinks below the floor is still pushed up, also while it touches a wall.
#[test]
fn a_contact_with_a_wall_leaves_the_floor_its_side() {
    let scan = sheets(&[[ZERO, Vector::y(), Vector::x()], [ZERO, Vector::y(), Vector::z()]]);
    let found = follow(&scan, 0.2, &[[0.19, 0.0, 0.19], [0.19, 0.0, 0.1], [0.19, 0.0, -0.001]]);
    for (contacts, depth) in found.iter().zip([0.01, 0.1, 0.201]) {
        let along = |k: usize| {
            let found = contacts.iter().filter(|contact| contact.normal[k] > 0.9);
            found.map(|contact| contact.depth).fold(f64::NEG_INFINITY, f64::max)
        };
        assert!((along(2) - depth).abs() < 0.01, "{depth} in the floor: {contacts:?}");
        assert!(along(0) > 0.0, "in the wall: {contacts:?}");
    }
}

/// Moved by the depth of a contact with a ball that is inside its core, a shape is out of the ball.
#[test]
fn contacts_with_balls_inside_a_shape_lead_out() {
    let scan = sheets(&[[ZERO, Vector::y(), Vector::x()]]);
    let rng = &mut rng(8102);
    let ball = 0.02;
    let options = CollideOptions::default().with_semantics(Semantics::Thickened(ball));
    let plan = ShapePlan::new(&options, &scan).unwrap();
    let target = Target::new(Placed::new(&scan, &Pose::IDENTITY), &plan);
    let (mut scratch, mut contacts, mut inside) = (Scratch::default(), Vec::new(), 0);
    for round in 0..600 {
        let [x, y, z] = point_in(rng, 0.2);
        let pose = rotation(rng).with_translation([1.0 + x, y, z]);
        let corners = [0, 1, 2, 3, 4, 5, 6, 7].map(|bits: u8| {
            let signs = [0, 1, 2].map(|k| if bits >> k & 1 == 1 { 1.0 } else { -1.0 });
            pose.apply([0.3 * signs[0], 0.2 * signs[1], 0.1 * signs[2]])
        });
        let shape = match round % 4 {
            0 => Shape::Box { pose, half: [0.3, 0.2, 0.1], radius: 0.0 },
            1 => Shape::Cylinder { pose, half_height: 0.2, radius: 0.15, rounding: 0.0 },
            2 => Shape::Cone { pose, half_height: 0.3, radius: 0.2, rounding: 0.02 },
            _ => Shape::Hull { points: &corners, radius: 0.0 },
        };
        target.contacts(&shape, &mut contacts, &mut scratch);
        for contact in &contacts {
            let normal = Vector::from(contact.normal);
            let centre: [f64; 3] = (Vector::from(contact.point) - normal * ball).into();
            let of_ball = Shape::Sphere { centre, radius: 0.0 };
            let is_inside = shape.gap_to(&of_ball).unwrap().upper == 0.0;
            inside += usize::from(is_inside);
            let [x, up, z] = pose.inverse().apply(centre);
            let [x, y, z] = [x, up, z].map(f64::abs);
            let of_box = (0.3 - x).min(0.2 - y).min(0.1 - z);
            // The side of the cone falls by 3 for a length of 1 across its axis.
            let of_side = (3.0 * (0.2 - x.hypot(z)) - 0.3 - up) / 10.0_f64.sqrt();
            let (shortest, precision) = match round % 4 {
                0 => (of_box, 1e-9),
                1 => ((0.2 - y).min(0.15 - x.hypot(z)), 1e-9),
                2 => (0.02 + of_side.min(0.3 + up), 1e-9),
                _ => (of_box, 1e-6),
            };
            let is_in_core = is_inside && (round % 4 != 2 || shortest > 0.02);
            if is_in_core {
                assert!(
                    (contact.depth - shortest - ball).abs() < precision,
                    "round {round}: {contact:?}, expected {shortest}, of {shape:?}"
                );
            }
            let way = normal * contact.depth;
            let moved_corners = corners.map(|corner| (Vector::from(corner) + way).into());
            let hull = Shape::Hull { points: &moved_corners, radius: 0.0 };
            let moved = shape.moved(&Pose::from_translation(way.into())).unwrap_or(hull);
            let left = moved.gap_to(&of_ball).unwrap().upper;
            assert!(left >= ball - 1e-9, "round {round}: {left} left of {contact:?} of {shape:?}");
        }
    }
    assert!(inside > 1000, "{inside} centres inside");
    // Across a core that is flat, not along it.
    let ends = [[0.5, 0.0, 0.0], [1.5, 0.0, 0.0]];
    let corners = [[0.5, 0.0, 0.0], [1.5, 0.0, 0.0], [1.0, 0.5, 0.0]];
    let (radius, pose) = (0.01, Pose::from_translation([1.0, 0.0, 0.0]));
    for shape in [
        Shape::Capsule { ends, radius },
        Shape::Triangle { points: corners, radius },
        Shape::Box { pose, half: [0.3, 0.3, 0.0], radius },
    ] {
        target.contacts(&shape, &mut contacts, &mut scratch);
        assert!((contacts[0].depth - radius - ball).abs() < 1e-9, "{shape:?}: {contacts:?}");
    }
}
