//! Shapes of the caller's own whose support maps return what is not a number, and degenerate or invalid
//! shapes.

use nearmiss_geometry::Pose;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_query::{
    CollideOptions, Placed, PlacedShape, Reason, Scratch, Semantics, Shape, ShapeIndex, ShapePlan,
    ShapeVerdict, SupportMap, Target,
};
use nearmiss_testdata::arbitrary::{CloudKind, point_in, rng, unit_vector};
use rand::RngExt;

use crate::solids::prepared;

type Vector = Vector3<f64>;

/// A unit ball about a place, whose support map returns what is not a number near one direction.
#[derive(Debug)]
struct Broken([f64; 3], [f64; 3]);

impl SupportMap for Broken {
    fn support(&self, direction: [f64; 3]) -> [f64; 3] {
        let d = Vector::from(direction).normalize();
        if d.dot(&Vector::from(self.1)) > 0.8 { [f64::NAN; 3] } else { (Vector::from(self.0) + d).into() }
    }

    fn centre(&self) -> [f64; 3] {
        self.0
    }
}

/// A shape of the caller's own that returns what is not a number gets finite answers.
#[test]
fn broken_support_maps_have_finite_answers() {
    let scan = prepared(CloudKind::Sphere, 800, 3, 16);
    let rng = &mut rng(9);
    let plan = ShapePlan::new(&CollideOptions::default(), &scan).unwrap();
    let placed = Placed::new(&scan, &Pose::IDENTITY);
    let (target, mut scratch) = (Target::new(placed, &plan), Scratch::default());
    for _ in 0..2000 {
        let own = Broken(point_in(rng, 3.0), unit_vector(rng));
        let shape = Shape::Own { map: &own, radius: 0.0 };
        if let ShapeVerdict::Touching { point, .. } = target.touch(&shape, &mut scratch).verdict {
            assert!(point.iter().all(|x| x.is_finite()), "{point:?} of {own:?}");
        }
        if let Some(found) = target.distance(&shape, f64::INFINITY, &mut scratch) {
            let numbers = found.points.concat();
            assert!(numbers.iter().chain([&found.lower, &found.upper]).all(|x| x.is_finite()), "{found:?}");
        }
    }
}

/// Triangles whose corners are on a line, or nearly, are the segments that they look like.
#[test]
fn triangles_without_area_are_segments() {
    let scan = prepared(CloudKind::Sphere, 800, 3, 16);
    let rng = &mut rng(8103);
    let plan = ShapePlan::new(&CollideOptions::default(), &scan).unwrap();
    let placed = Placed::new(&scan, &Pose::IDENTITY);
    let (target, mut scratch) = (Target::new(placed, &plan), Scratch::default());
    let mut touching = 0;
    for round in 0..2000_usize {
        let from = placed.point(round % scan.len());
        let p = [0, 1, 2].map(|k| from[k] + point_in(rng, 0.3)[k]);
        let along = unit_vector(rng);
        let q = [0, 1, 2].map(|k| p[k] + along[k]);
        let share = rng.random_range(0.0..1.0);
        let off = point_in(rng, [0.0, 1e-12, 1e-9][round % 3]);
        let on_line = [0, 1, 2].map(|k| p[k] + share * (q[k] - p[k]) + off[k]);
        let corners = [[p, q, on_line], [on_line, p, q], [p, q, q], [q, on_line, p]][round / 3 % 4];
        let (flat, thin) =
            (Shape::Triangle { points: corners, radius: 0.0 }, Shape::Capsule { ends: [p, q], radius: 0.0 });
        let found = [flat, thin].map(|shape| target.distance(&shape, f64::INFINITY, &mut scratch).unwrap());
        let context = format!("round {round}: {found:?} of {flat:?}");
        assert!((found[0].upper - found[1].upper).abs() < 1e-7, "{context}");
        assert!(found[0].lower <= found[1].upper + 1e-7, "{context}");
        let is_touching = [flat, thin].map(|shape| target.touch(&shape, &mut scratch).verdict.is_touching());
        assert!(is_touching[0] == is_touching[1] || found[1].upper < 1e-7, "{context}");
        touching += usize::from(is_touching[0]);
        let is_near = [flat, thin].map(|shape| placed.touches(&shape));
        assert_eq!(is_near[0], is_near[1], "{context}");
    }
    assert!(touching > 300, "{touching} touch");
}

/// A rotation that is not finite makes a shape invalid, for every question.
#[test]
fn shapes_with_broken_poses_are_refused() {
    let scan = prepared(CloudKind::Sphere, 800, 3, 16);
    let placed = Placed::new(&scan, &Pose::IDENTITY);
    let mut scratch = Scratch::default();
    for semantics in [Semantics::Obstacle, Semantics::Thickened(0.1)] {
        let plan = ShapePlan::new(&CollideOptions::default().with_semantics(semantics), &scan).unwrap();
        let index = ShapeIndex::new(&scan);
        for target in [Target::new(placed, &plan), Target::new(placed.with_shapes(&index), &plan)] {
            for angle in [f64::NAN, f64::INFINITY] {
                let pose = Pose::from_axis_angle([0.0, 0.0, 1.0], angle);
                for pose in [pose, pose.with_translation([0.0, 0.0, 1.0]), pose.with_translation([9.0; 3])] {
                    let shapes = [
                        Shape::Box { pose, half: [0.1; 3], radius: 0.0 },
                        Shape::Cylinder { pose, half_height: 0.1, radius: 0.1, rounding: 0.0 },
                        Shape::Cone { pose, half_height: 0.1, radius: 0.1, rounding: 0.0 },
                    ];
                    for shape in &shapes {
                        let verdict = target.touch(shape, &mut scratch).verdict;
                        assert_eq!(verdict, ShapeVerdict::Undecided(Reason::Shape), "{shape:?}");
                        let distance = target.distance(shape, f64::INFINITY, &mut scratch);
                        assert!(distance.is_none() && shape.bounds().is_none(), "{shape:?}: {distance:?}");
                    }
                }
            }
        }
    }
    let lost = [f64::NAN, 0.0, 0.0];
    let shapes = [
        Shape::Capsule { ends: [lost, [0.0; 3]], radius: 0.1 },
        Shape::Triangle { points: [[0.0; 3], lost, [1.0; 3]], radius: 0.1 },
        Shape::Sphere { centre: [0.0; 3], radius: f64::INFINITY },
    ];
    for shape in shapes {
        let placed = PlacedShape::new(shape, &Pose::IDENTITY);
        assert!(shape.bounds().is_none() && placed.bounds().is_none(), "{shape:?} has a box");
    }
}
