//! Contacts in corners and at the edges of steps.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
use nearmiss_query::{CollideOptions, Detail, Placed, Scratch, Shape, ShapeHint, ShapePlan, Target};
use nearmiss_testdata::arbitrary::{point_in, rng, rotation, unit_vector};
use rand::RngExt;

type Vector = Vector3<f64>;

const SPACING: f64 = 0.02;

/// A rectangle of points with the given corner and sides, about `SPACING` apart.
fn rectangle(corner: [f64; 3], sides: [[f64; 3]; 2], points: &mut Vec<[f64; 3]>) {
    let rng = &mut rng(points.len() as u64);
    let [a, b] = sides.map(Vector::from);
    let [rows, columns] = [a.norm(), b.norm()].map(|length| (length / SPACING).round());
    let (mut row, corner) = (0.5, Vector::from(corner));
    while row < rows {
        let mut column = 0.5;
        while column < columns {
            let [i, j] = [row, column].map(|at| at + rng.random_range(-0.2..0.2));
            points.push((corner + a * (i / rows) + b * (j / columns)).into());
            column += 1.0;
        }
        row += 1.0;
    }
}

fn built(points: &[[f64; 3]]) -> PointHierarchy {
    let cloud = PointCloud::from_positions(points).unwrap();
    PointHierarchy::build(&cloud, &BuildOptions::default()).unwrap()
}

/// Balls and capsules that touch two or three walls of a corner have a contact with each of them, as deep as
/// they are in that wall.
#[test]
fn each_wall_of_a_corner_has_its_deepest_contact() {
    let axes = [0, 1, 2].map(|k: usize| [0, 1, 2].map(|j| if j == k { 0.8 } else { 0.0 }));
    let mut points = Vec::new();
    for k in 0..3 {
        rectangle([0.0; 3], [axes[(k + 1) % 3], axes[(k + 2) % 3]], &mut points);
    }
    let scan = built(&points);
    let (r, rng) = (scan.sampling_radius(), &mut rng(91));
    let (mut scratch, mut contacts) = (Scratch::default(), Vec::new());
    let mut compared = 0;
    for round in 0..600 {
        let options = CollideOptions::default().with_margin([0.0, r][round % 2]);
        let options = if round % 4 < 2 { options } else { options.with_detail(Detail::Verdict) };
        let plan = ShapePlan::new(&options, &scan).unwrap();
        let target = Target::new(Placed::new(&scan, &Pose::IDENTITY), &plan);
        let radius = rng.random_range(0.1..0.25);
        let depths = [(); 3].map(|()| r * rng.random_range(0.0..0.8));
        let mut centre = depths.map(|depth| radius - depth);
        let shape = if round % 3 == 0 {
            // Along an edge.
            let along = round / 3 % 3;
            centre[along] = 0.3;
            let mut end = centre;
            end[along] += 0.2;
            Shape::Capsule { ends: [centre, end], radius }
        } else {
            Shape::Sphere { centre, radius }
        };
        target.contacts(&shape, &mut contacts, &mut scratch);
        for k in (0..3).filter(|&k| centre[k] < radius && depths[k] > 0.3 * r) {
            let of_wall = contacts.iter().filter(|contact| contact.normal[k] > 0.9);
            let depth = of_wall.map(|contact| contact.depth).fold(f64::NEG_INFINITY, f64::max);
            assert!(
                (depth - depths[k]).abs() < 0.1 * r,
                "round {round}, wall {k}: {depth}, expected {} with r {r}: {contacts:?}",
                depths[k]
            );
            compared += 1;
        }
    }
    assert!(compared > 800, "{compared} walls");
}

/// A contact that touches does not become a gap once it is moved onto the implicit surface, which is round at
/// the edges of steps. With a margin it was one, so that a ball that was pushed out by it sank into the edge.
#[test]
fn a_margin_does_not_lift_what_touches() {
    let mut points = Vec::new();
    for step in 0..3 {
        let [x, z] = [0.3, 0.2].map(|length| length * f64::from(step));
        rectangle([x, 0.0, z], [[0.3, 0.0, 0.0], [0.0, 0.8, 0.0]], &mut points);
        rectangle([x, 0.0, z], [[0.0, 0.0, -0.2], [0.0, 0.8, 0.0]], &mut points);
    }
    let scan = built(&points);
    let (r, rng) = (scan.sampling_radius(), &mut rng(92));
    let plans = [Detail::Verdict, Detail::Witness].map(|detail| {
        let options = CollideOptions::default().with_detail(detail).with_margin(0.7 * r);
        ShapePlan::new(&options, &scan).unwrap()
    });
    let [on_discs, moved] =
        plans.each_ref().map(|plan| Target::new(Placed::new(&scan, &Pose::IDENTITY), plan));
    let (mut scratch, mut contacts, mut all) = (Scratch::default(), Vec::new(), Vec::new());
    let (mut touching, mut differ) = (0, 0);
    for round in 0..2000 {
        let at = Vector::from(points[rng.random_range(0..points.len())]);
        let size = r * rng.random_range(1.0..4.0);
        let centre: [f64; 3] = (at + Vector::from(point_in(rng, size + r))).into();
        let pose = rotation(rng).with_translation(centre);
        let shape = match round % 3 {
            0 => Shape::Sphere { centre, radius: size },
            1 => {
                let end = Vector::from(centre) + Vector::from(unit_vector(rng)) * size;
                Shape::Capsule { ends: [centre, end.into()], radius: 0.5 * size }
            }
            _ => Shape::Box { pose, half: [size, 0.7 * size, 0.4 * size], radius: 0.0 },
        };
        on_discs.contacts(&shape, &mut contacts, &mut scratch);
        moved.contacts(&shape, &mut all, &mut scratch);
        for own in contacts.iter().filter(|own| own.depth >= 0.0) {
            let same =
                all.iter().find(|it| it.id == own.id).unwrap_or_else(|| panic!("round {round}: {own:?}"));
            assert!(same.depth > -0.05 * r, "round {round}: {same:?}, on its disc {own:?}");
            touching += 1;
            differ += usize::from(same.depth.to_bits() != own.depth.to_bits());
        }
    }
    assert!(touching > 4000 && differ > 1000, "{differ} of {touching} differ");
}

/// The treads and risers of ten steps along x, 0.28 long, 0.17 high and 1 wide.
fn steps() -> Vec<[f64; 3]> {
    let mut points = Vec::new();
    for step in 0..10_u8 {
        let [x, z] = [0.28, 0.17].map(|size| size * f64::from(step));
        rectangle([x, 0.0, z], [[0.28, 0.0, 0.0], [0.0, 1.0, 0.0]], &mut points);
        rectangle([x, 0.0, z - 0.17], [[0.0, 0.0, 0.17], [0.0, 1.0, 0.0]], &mut points);
    }
    points
}

/// A shape that touches nothing has only gaps within the margin, also where its centre is before the plane of
/// a disc and the shape is behind the disc.
#[test]
fn what_is_apart_is_nowhere_deep() {
    // A wall with a doorway, on a floor.
    let mut door = Vec::new();
    rectangle([0.0; 3], [[2.0, 0.0, 0.0], [0.0, 2.0, 0.0]], &mut door);
    for x in [0.0, 1.2] {
        rectangle([x, 1.0, 0.0], [[0.8, 0.0, 0.0], [0.0, 0.0, 2.0]], &mut door);
    }
    for (name, points) in [("door", door), ("steps", steps())] {
        let scan = built(&points);
        let (r, rng, scratch) = (scan.sampling_radius(), &mut rng(92), &mut Scratch::default());
        let margin = 0.5 * r;
        let options = CollideOptions::default().with_margin(margin);
        let plans = [CollideOptions::default(), options, options.with_detail(Detail::Verdict)]
            .map(|options| ShapePlan::new(&options, &scan).unwrap());
        let [bare, witness, verdict] =
            plans.each_ref().map(|plan| Target::new(Placed::new(&scan, &Pose::IDENTITY), plan));
        let (mut contacts, mut compared) = (Vec::new(), 0);
        for round in 0..60_000 {
            let radius = rng.random_range(2.0..6.0) * r;
            let half = rng.random_range(1.0..15.0) * r;
            let at = Vector::from(points[rng.random_range(0..points.len())]);
            let centre =
                (at + Vector::from(unit_vector(rng)) * rng.random_range(0.0..half + 2.0 * radius)).into();
            let pose = rotation(rng).with_translation(centre);
            let shape = match round % 3 {
                0 => {
                    let ends = [-half, half].map(|y| pose.apply([0.0, y, 0.0]));
                    Shape::Capsule { ends, radius }
                }
                1 => Shape::Box { pose, half: [radius, half, 0.5 * radius], radius: 0.0 },
                _ => Shape::Cylinder { pose, half_height: half, radius, rounding: 0.0 },
            };
            let found = bare.distance(&shape, margin, scratch);
            let Some(found) = found.filter(|found| found.upper > 0.05 * r) else { continue };
            for target in [&witness, &verdict] {
                target.contacts(&shape, &mut contacts, scratch);
                let deepest = contacts.first().unwrap_or_else(|| panic!("{name}: {shape:?} has no contact"));
                assert!(deepest.depth < 0.1 * r, "{name}: {shape:?}, {} apart: {contacts:?}", found.upper);
                compared += 1;
                // The hint keeps the side on which the shape is.
                let hint = &mut ShapeHint::default();
                for _ in 0..2 {
                    target.contacts_hinted(&shape, hint, &mut contacts, scratch);
                    let is_deep = contacts.iter().any(|contact| contact.depth > 0.1 * r);
                    assert!(!is_deep, "{name}: {shape:?}, {} apart, hinted: {contacts:?}", found.upper);
                }
            }
        }
        assert!(compared > 1000, "{compared} of {name}");
    }
}

/// Upright capsules on steps, whose feet reach into a tread, perhaps over its edge: the riser below is no way
/// out.
#[test]
fn feet_on_steps_leave_them_upwards() {
    let scan = built(&steps());
    let (r, rng, scratch) = (scan.sampling_radius(), &mut rng(93), &mut Scratch::default());
    let mut contacts = Vec::new();
    let mut most = 0.0_f64;
    for round in 0..2000 {
        let options = CollideOptions::default().with_margin([0.0, 0.3 * r][round % 2]);
        let plan = ShapePlan::new(&options, &scan).unwrap();
        let target = Target::new(Placed::new(&scan, &Pose::IDENTITY), &plan);
        let (radius, depth) = (0.1, rng.random_range(0.0..0.3) * r);
        let step = f64::from(rng.random_range(1..9_u8));
        let x = 0.28 * step + rng.random_range(0.0..0.28 - radius - 0.02);
        let foot = [x, rng.random_range(0.3..0.7), 0.17 * step + radius - depth];
        let head = [foot[0] + rng.random_range(-0.1..0.1), foot[1], foot[2] + 1.2];
        target.contacts(&Shape::Capsule { ends: [foot, head], radius }, &mut contacts, scratch);
        // Less than the thickness of a disc may lie between the foot and its contact.
        assert!(depth < 0.1 * r || contacts.first().is_some_and(|it| it.normal[2] > 0.0), "{contacts:?}");
        for contact in &contacts {
            assert!(contact.depth < depth + r, "{depth} in step {step}, {x}: {contact:?}");
            most = most.max(contact.depth - depth);
        }
    }
    println!("at most {:.2} r too deep", most / r);
}
