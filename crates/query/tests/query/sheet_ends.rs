//! Contacts at the ends of sheets: shapes beside and across the border of a plate.

use std::f64::consts::{FRAC_PI_2, PI};

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_hierarchy::{BuildOptions, PointHierarchy, PointKind};
use nearmiss_query::{CollideOptions, Placed, Scratch, Shape, ShapeContact, ShapePlan, Target};
use nearmiss_testdata::arbitrary::{rng, rotation};
use rand::RngExt;

type Vector = Vector3<f64>;

const SPACING: f64 = 0.05;

/// A plate in the plane of x and y that ends at x = 0. Its points are off a lattice by up to this share of
/// the spacing in each direction, and by a tenth of that across the plate.
fn plate(jitter: f64) -> PointHierarchy {
    let rng = &mut rng(11);
    let mut points = Vec::new();
    for i in 0..40 {
        for j in -30..=30 {
            let lattice = [-f64::from(i), f64::from(j), 0.0];
            let off = [0.5, 0.5, 0.05].map(|share| share * jitter * rng.random_range(-1.0..=1.0));
            points.push([0, 1, 2].map(|k| (lattice[k] + off[k]) * SPACING));
        }
    }
    PointHierarchy::build(&PointCloud::from_positions(&points).unwrap(), &BuildOptions::default()).unwrap()
}

/// The number of forms of shapes.
const FORMS: usize = 5;

/// A shape of random size about `centre`, and its support map.
fn shape(
    rng: &mut impl RngExt,
    form: usize,
    centre: [f64; 3],
) -> (Shape<'static>, Box<dyn Fn(Vector) -> Vector>) {
    let pose = rotation(rng).with_translation(centre);
    let size = |rng: &mut dyn FnMut() -> f64| 0.05 + 0.35 * rng();
    let mut draw = || rng.random_range(0.0..1.0_f64);
    let [a, b, c] = [size(&mut draw), size(&mut draw), size(&mut draw)];
    let middle = Vector::from(centre);
    let own = move |d: Vector| Vector::from(pose.rotate_inverse(d.into()));
    let world = move |p: Vector| Vector::from(pose.apply(p.into()));
    match form {
        0 => (Shape::Sphere { centre, radius: a }, Box::new(move |d| middle + d.normalize() * a)),
        1 => {
            let ends = [[0.0, b, 0.0], [0.0, -b, 0.0]].map(|p| pose.apply(p));
            let support = move |d: Vector| {
                let [p, q] = ends.map(Vector::from);
                (if d.dot(&(p - q)) > 0.0 { p } else { q }) + d.normalize() * a
            };
            (Shape::Capsule { ends, radius: a }, Box::new(support))
        }
        2 => {
            let half = [a, b, c];
            let support = move |d: Vector| {
                let d = own(d);
                world(Vector::from_fn(|k, _| half[k].copysign(d[k])))
            };
            (Shape::Box { pose, half, radius: 0.0 }, Box::new(support))
        }
        3 => {
            let support = move |d: Vector| {
                let d = own(d);
                let across = Vector::new(d.x, 0.0, d.z);
                let out = across.try_normalize(1e-12).unwrap_or_else(Vector::zeros) * a;
                world(out + Vector::new(0.0, b.copysign(d.y), 0.0))
            };
            (Shape::Cylinder { pose, half_height: b, radius: a, rounding: 0.0 }, Box::new(support))
        }
        _ => {
            let points: Vec<[f64; 3]> = (0..12)
                .map(|_| {
                    pose.apply([a * (2.0 * draw() - 1.0), b * (2.0 * draw() - 1.0), c * (2.0 * draw() - 1.0)])
                })
                .collect();
            let points: &'static [[f64; 3]] = points.leak();
            let support = move |d: Vector| {
                let all = points.iter().map(|p| Vector::from(*p));
                all.max_by(|p, q| p.dot(&d).total_cmp(&q.dot(&d))).unwrap()
            };
            (Shape::Hull { points, radius: 0.0 }, Box::new(support))
        }
    }
}

/// The least shift along any way out that the half plane leaves, and the sine of its angle to the plate.
fn shortest(support: &dyn Fn(Vector) -> Vector, shift: Vector) -> (f64, f64) {
    let ways = (0..=720).map(|k| {
        let (sin, cos) = (PI * f64::from(k) / 720.0 - FRAC_PI_2).sin_cos();
        let way = Vector::new(cos, 0.0, sin);
        (-(support(-way) + shift).dot(&way), sin)
    });
    ways.min_by(|a, b| a.0.total_cmp(&b.0)).expect("some ways")
}

/// A shape at the border is apart once it has moved along its deepest contact, which is not much deeper than
/// the shortest way out is long. The discs at the border reach a little beyond the outermost points.
#[test]
fn shapes_move_out_past_the_border_of_a_plate() {
    for (jitter, overhang) in [(0.0, 0.5), (0.4, 0.7), (1.0, 1.0)] {
        let scan = plate(jitter);
        let r = scan.sampling_radius();
        let plan = ShapePlan::new(&CollideOptions::default(), &scan).unwrap();
        let target = Target::new(Placed::new(&scan, &Pose::IDENTITY), &plan);
        let (rng, mut contacts, mut scratch) = (&mut rng(5), Vec::new(), Scratch::default());
        for form in 0..FORMS {
            let (mut cases, mut aside, mut left, mut longer) = (0, 0, 0, 0);
            for _ in 0..1000 {
                let centre =
                    [rng.random_range(-0.1..0.5), rng.random_range(-0.5..0.5), rng.random_range(-0.4..0.4)];
                let (shape, support) = shape(rng, form, centre);
                let (length, sine) = shortest(&support, Vector::zeros());
                if length < 0.3 * r {
                    continue;
                }
                cases += 1;
                aside += usize::from(sine.abs() < 0.9);
                target.contacts(&shape, &mut contacts, &mut scratch);
                let first = contacts.first().unwrap_or_else(|| panic!("no contact of {shape:?}"));
                let moved = Vector::from(first.normal) * first.depth;
                left += usize::from(shortest(&support, moved).0 > 0.3 * r);
                longer += usize::from(first.depth > length + overhang * r);
            }
            let told = format!("jitter {jitter}, form {form}: {cases} {aside} {left} {longer}");
            println!("{told}");
            assert!(aside > 80 && left * 50 <= cases && longer * 20 <= cases, "{told}");
        }
    }
}

/// A floor at z = 0 and a table top above it that ends at x = 0.
fn room() -> PointHierarchy {
    let steps = || (-40..=40).map(|k| SPACING * f64::from(k));
    let points: Vec<[f64; 3]> = steps()
        .flat_map(|x| steps().flat_map(move |y| [[x, y, 0.0], [x, y, 0.7]]))
        .filter(|p| p[2] == 0.0 || p[0] <= 0.0)
        .collect();
    PointHierarchy::build(&PointCloud::from_positions(&points).unwrap(), &BuildOptions::default()).unwrap()
}

/// Bodies that stand on the floor are pushed away from the table, not onto it.
#[test]
fn a_body_beside_a_table_is_pushed_sideways() {
    let unoriented = room();
    let mut oriented = unoriented.clone();
    oriented.turn_normals(&vec![[0.0, 0.0, 1.0]; oriented.len()]);
    push_sideways(&unoriented);
    push_sideways(&oriented);
}

fn push_sideways(scan: &PointHierarchy) {
    let r = scan.sampling_radius();
    let plan = ShapePlan::new(&CollideOptions::default(), scan).unwrap();
    let target = Target::new(Placed::new(scan, &Pose::IDENTITY), &plan);
    let (mut contacts, mut scratch) = (Vec::new(), Scratch::default());
    for overlap in [0.02, 0.06, 0.15] {
        for y in [0.0, 0.013, 0.38] {
            let x = 0.3 - overlap;
            let stands = Pose::from_axis_angle([1.0, 0.0, 0.0], FRAC_PI_2).with_translation([x, y, 0.799]);
            let turned = Pose::IDENTITY.with_translation([x, y, 0.799]);
            let bodies = [
                Shape::Capsule { ends: [[x, y, 0.299], [x, y, 1.3]], radius: 0.3 },
                Shape::Cylinder { pose: stands, half_height: 0.8, radius: 0.3, rounding: 0.0 },
                Shape::Box { pose: turned, half: [0.3, 0.4, 0.8], radius: 0.0 },
            ];
            for body in bodies {
                target.contacts(&body, &mut contacts, &mut scratch);
                let (table, floor): (Vec<&ShapeContact>, Vec<&ShapeContact>) =
                    contacts.iter().partition(|it| it.point[2] > 0.5);
                assert!(!table.is_empty() && !floor.is_empty(), "{body:?}: {contacts:?}");
                for contact in &floor {
                    let is_up = contact.normal[2] > 0.999 && (-1e-3..0.001 + 1e-6).contains(&contact.depth);
                    assert!(is_up, "{body:?}: {contact:?}");
                }
                let deepest = table.iter().max_by(|a, b| a.depth.total_cmp(&b.depth)).unwrap();
                // The rims of the discs are beyond the outermost points.
                let beyond = deepest.depth - overlap;
                assert!(
                    deepest.normal[0] > 0.99 && (0.0..0.5 * r).contains(&beyond),
                    "{body:?}: {contacts:?}"
                );
                for contact in &table {
                    let is_level = contact.normal[2].abs() < 0.02 && contact.normal[0] > 0.3;
                    assert!(is_level, "{body:?}: {contact:?}");
                }
            }
        }
    }
}

/// Bodies that rest on a plate and reach beyond its border are held by it.
#[test]
fn a_body_on_the_border_of_a_plate_is_pushed_up() {
    for jitter in [0.0, 0.4, 1.0] {
        let scan = plate(jitter);
        let plan = ShapePlan::new(&CollideOptions::default(), &scan).unwrap();
        let target = Target::new(Placed::new(&scan, &Pose::IDENTITY), &plan);
        let (rng, mut contacts, mut scratch) = (&mut rng(9), Vec::new(), Scratch::default());
        for round in 0..300 {
            let (x, y) = (rng.random_range(-0.3..0.0), rng.random_range(-0.5..0.5));
            let (depth, turn) = (rng.random_range(0.002..0.01), rng.random_range(0.0..PI));
            let upright = |turn: f64| Pose::from_axis_angle([0.0, 0.0, 1.0], turn);
            let lies = upright(turn).with_translation([x, y, 0.2 - depth]);
            let (sin, cos) = turn.sin_cos();
            let ends = [-0.3, 0.3].map(|t| [x + t * cos, y + t * sin, 0.2 - depth]);
            let body = match round % 3 {
                0 => Shape::Box { pose: lies, half: [0.3, 0.2, 0.2], radius: 0.0 },
                1 => Shape::Capsule { ends, radius: 0.2 },
                _ => Shape::Sphere { centre: ends[0], radius: 0.2 },
            };
            target.contacts(&body, &mut contacts, &mut scratch);
            if round % 3 == 2 && ends[0][0] > 0.0 {
                continue;
            }
            let first = contacts.first().unwrap_or_else(|| panic!("no contact of {body:?}"));
            let rough = 0.001 + 0.01 * jitter;
            assert!(first.normal[2] > 0.98, "jitter {jitter}: {body:?} {contacts:?}");
            assert!((first.depth - depth).abs() < rough, "jitter {jitter}: {body:?} {contacts:?}");
        }
    }
}

/// A body with its centre past the border of the plate on which it rests, or above which it hovers, has no
/// contacts with the inside of the plate that push it sideways.
#[test]
fn a_body_across_the_border_has_no_contacts_against_the_plate() {
    let mut oriented = plate(0.0);
    oriented.turn_normals(&vec![[0.0, 0.0, 1.0]; oriented.len()]);
    for scan in [plate(0.0), plate(0.4), oriented] {
        let options = CollideOptions::default().with_margin(0.05);
        let plan = ShapePlan::new(&options, &scan).unwrap();
        let target = Target::new(Placed::new(&scan, &Pose::IDENTITY), &plan);
        let (mut contacts, mut scratch) = (Vec::new(), Scratch::default());
        for x in [0.03, 0.08, 0.15] {
            for depth in [-0.02, -0.002, 0.005, 0.02] {
                let pose = Pose::from_translation([x, 0.01, 0.2 - depth]);
                for radius in [0.0, 0.05] {
                    let half = [0.3, 0.2, 0.2].map(|h| h - radius);
                    target.contacts(&Shape::Box { pose, half, radius }, &mut contacts, &mut scratch);
                    assert!(!contacts.is_empty(), "x {x}, depth {depth}");
                    for contact in &contacts {
                        assert!(contact.normal[2] > 0.9, "x {x}, depth {depth}, {radius}: {contacts:?}");
                    }
                }
            }
        }
    }
}

/// Both halves of a wall with a doorway push a body back into it, each to its side.
#[test]
fn a_doorway_pushes_from_both_sides() {
    let steps = |n: i32| (0..=n).map(|k| SPACING * f64::from(k));
    let half =
        |side: f64| steps(30).flat_map(move |x| steps(50).map(move |z| [side * (0.35 + x), 0.0, z - 0.2]));
    let points: Vec<[f64; 3]> = half(-1.0).chain(half(1.0)).collect();
    let scan = PointHierarchy::build(&PointCloud::from_positions(&points).unwrap(), &BuildOptions::default());
    let scan = scan.unwrap();
    let (mut contacts, mut scratch) = (Vec::new(), Scratch::default());
    for (margin, radius, x) in [(0.15, 0.3, -0.07), (0.15, 0.3, 0.07), (0.0, 0.37, 0.0), (0.0, 0.37, 0.01)] {
        let options = CollideOptions::default().with_margin(margin);
        let plan = ShapePlan::new(&options, &scan).unwrap();
        let target = Target::new(Placed::new(&scan, &Pose::IDENTITY), &plan);
        let body = Shape::Capsule { ends: [[x, 0.0, 0.4], [x, 0.0, 1.4]], radius };
        target.contacts(&body, &mut contacts, &mut scratch);
        let mut sides = [0, 0];
        for contact in &contacts {
            let inwards = -contact.normal[0] * contact.point[0].signum();
            assert!(inwards > 0.6, "{body:?}: {contacts:?}");
            sides[usize::from(contact.point[0] > 0.0)] += 1;
        }
        assert!(sides.iter().all(|&count| count > 0), "{body:?}: {contacts:?}");
        let deepest = radius - 0.35 + x.abs();
        assert!((contacts[0].depth - deepest).abs() < 0.5 * scan.sampling_radius(), "{body:?}: {contacts:?}");
    }
}

/// A table top with two scanned sides holds a body that overhangs its border.
#[test]
fn the_far_side_of_a_thin_body_is_no_way_out() {
    for thickness in [0.03, 0.25] {
        let mut points = Vec::new();
        for i in 0..=40 {
            for j in -30..=30 {
                let [x, y] = [-SPACING * f64::from(i), SPACING * f64::from(j)];
                points.extend([[x, y, 0.0], [x, y, -thickness]]);
            }
        }
        let cloud = PointCloud::from_positions(&points).unwrap();
        let mut scan = PointHierarchy::build(&cloud, &BuildOptions::default()).unwrap();
        let normals: Vec<[f32; 3]> = (0..scan.len())
            .map(|i| {
                [
                    0.0,
                    0.0,
                    if Placed::new(&scan, &Pose::IDENTITY).point(i)[2] < -0.5 * thickness {
                        -1.0
                    } else {
                        1.0
                    },
                ]
            })
            .collect();
        scan.turn_normals(&normals);
        let plan = ShapePlan::new(&CollideOptions::default(), &scan).unwrap();
        let target = Target::new(Placed::new(&scan, &Pose::IDENTITY), &plan);
        let (mut contacts, mut scratch) = (Vec::new(), Scratch::default());
        let depth = thickness + 0.01;
        let pose = Pose::from_translation([0.0, 0.01, 0.5 - depth]);
        target.contacts(
            &Shape::Box { pose, half: [0.3, 0.2, 0.5], radius: 0.0 },
            &mut contacts,
            &mut scratch,
        );
        let first = contacts.first().expect("a contact");
        assert!(first.normal[2] > 0.9 && (first.depth - depth).abs() < 0.01, "{thickness}: {contacts:?}");
    }
}

/// A box beside a board that was scanned from both sides moves out past the end of the board. Each side is a
/// sheet of its own, or the board is so thin that its points are balls.
#[test]
fn boxes_move_out_past_the_end_of_a_board() {
    const LAST: i32 = 30;
    let end = f64::from(LAST) * SPACING;
    for thickness in [1.5, 2.0, 2.4, 3.0, 4.0] {
        let mut points = Vec::new();
        for (i, j) in (0..=LAST).flat_map(|i| (0..=LAST).map(move |j| (i, j))) {
            let [x, y] = [i, j].map(|n| f64::from(n) * SPACING);
            points.extend([[x, y, 0.0], [x, y, -thickness * SPACING]]);
        }
        let cloud = PointCloud::from_positions(&points).unwrap();
        let scan = PointHierarchy::build(&cloud, &BuildOptions::default()).unwrap();
        let placed = Placed::new(&scan, &Pose::IDENTITY);
        // Below the end of one side are the points of the other one.
        for i in (0..scan.len()).filter(|&i| scan.kind(i) == PointKind::Sheet) {
            let [x, y, _] = placed.point(i);
            let is_outermost = [x, y].iter().any(|c| c.min(end - c) < 0.5 * SPACING);
            assert_eq!(scan.is_at_border(i), is_outermost && thickness > 2.5, "{thickness}: {x}, {y}");
        }
        let plan = ShapePlan::new(&CollideOptions::estimated(), &scan).unwrap();
        let (target, rng) = (Target::new(placed, &plan), &mut rng(3));
        let (mut contacts, mut scratch, mut deeper) = (Vec::new(), Scratch::default(), 0);
        for _ in 0..300 {
            let half = [0.2, 0.2, 0.4].map(|most| rng.random_range(0.5 * most..most));
            let [overlap, off] = [rng.random_range(0.02..0.06), rng.random_range(-0.05..0.05)];
            let middle = -0.5 * thickness * SPACING + off;
            let pose = Pose::from_translation([end + half[0] - overlap, rng.random_range(0.4..1.1), middle]);
            target.contacts(&Shape::Box { pose, half, radius: 0.0 }, &mut contacts, &mut scratch);
            assert!(contacts[0].depth >= overlap, "{thickness}: {overlap}, {contacts:?}");
            deeper += usize::from(contacts[0].depth > overlap + SPACING);
        }
        assert_eq!(deeper, 0, "{thickness}: of 300, more than a spacing deeper");
    }
}
