//! Shapes of the caller's own whose support maps return what is not a number.

use nearmiss_geometry::Pose;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_query::{CollideOptions, Placed, Scratch, Shape, ShapePlan, ShapeVerdict, SupportMap, Target};
use nearmiss_testdata::arbitrary::{CloudKind, point_in, rng, unit_vector};

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
