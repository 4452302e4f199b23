//! Spheres that end within the thickness of discs.

use nearmiss_geometry::Pose;
use nearmiss_hierarchy::THICKNESS;
use nearmiss_query::{CollideOptions, Detail, Placed, Scratch, Shape, ShapeIndex, ShapePlan, Target};
use nearmiss_testdata::arbitrary::{CloudKind, point_in, rng};
use rand::RngExt;

use crate::solids::{check, prepared};

#[test]
fn spheres_that_graze_discs_touch() {
    let rng = &mut rng(18);
    let mut seen = [0; 2];
    for (n, kind) in (0_u64..).zip(CloudKind::ALL) {
        let scan = prepared(kind, 600, n, 16);
        let (index, r) = (ShapeIndex::new(&scan), scan.sampling_radius() / scan.frame().scale);
        let plain = Placed::new(&scan, &Pose::IDENTITY);
        let options = CollideOptions::estimated().with_detail(Detail::Verdict);
        let plan = ShapePlan::new(&options, &scan).unwrap();
        let mut scratch = Scratch::default();
        for round in 0..40 {
            let about = plain.point(rng.random_range(0..scan.len()));
            let d = point_in(rng, 2.0 * r);
            let centre = [0, 1, 2].map(|k| about[k] + d[k]);
            let point = Shape::Sphere { centre, radius: 0.0 };
            let Some(nearest) = Target::new(plain, &plan).distance(&point, f64::INFINITY, &mut scratch)
            else {
                continue;
            };
            let radius = nearest.upper - f64::from(THICKNESS) * rng.random_range(0.0..1.2) * nearest.band;
            // Greater ones are off by the rounding of their radius.
            if nearest.upper > 0.0 && radius > 0.0 && radius < 50.0 * nearest.band {
                let sphere = Shape::Sphere { centre, radius };
                let what = format!("{kind:?}, round {round}, {sphere:?}");
                for placed in [plain, plain.with_shapes(&index)] {
                    if let Some(touches) = check(&placed, &sphere, &options, &what) {
                        seen[usize::from(touches)] += 1;
                    }
                }
            }
        }
    }
    assert!(seen.iter().all(|&n| n > 60), "both answers: {seen:?}");
}
