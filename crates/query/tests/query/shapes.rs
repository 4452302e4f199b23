//! Shapes against brute force over all points, with independent formulas.
use nearmiss_geometry::{PointCloud, Pose};
use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
use nearmiss_query::{Placed, Shape, ShapeIndex};
use nearmiss_testdata::arbitrary::{self, CloudKind, point_in, rotation, unit_vector};
use rand::RngExt;

fn prepared(points: &[[f64; 3]], leaf_size: u32) -> PointHierarchy {
    let options = BuildOptions::default().with_leaf_size(leaf_size);
    PointHierarchy::build(&PointCloud::cleaned(points).unwrap(), &options).unwrap()
}

fn between(p: [f64; 3], q: [f64; 3]) -> f64 {
    (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt()
}

/// The distance of a world point from a shape.
fn gap(shape: &Shape<'_>, p: [f64; 3]) -> f64 {
    match *shape {
        Shape::Sphere { centre, radius } => between(p, centre) - radius,
        Shape::Capsule { ends: [from, to], radius } => {
            // The distance falls and then rises along the segment.
            let at = |t: f64| between(p, [0, 1, 2].map(|k| from[k] + t * (to[k] - from[k])));
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..100 {
                let third = (high - low) / 3.0;
                if at(low + third) < at(high - third) {
                    high -= third;
                } else {
                    low += third;
                }
            }
            at(0.5 * (low + high)) - radius
        }
        Shape::Box { pose, half, radius } => {
            let own = pose.apply_inverse(p);
            let nearest = [0, 1, 2].map(|k| own[k].clamp(-half[k], half[k]));
            between(own, nearest) * pose.scale() - radius
        }
        _ => panic!("no other shapes"),
    }
}

#[test]
fn shapes_touch_what_brute_force_says_and_the_nearest_point_is_nearest() {
    let mut rng = arbitrary::rng(91);
    let mut seen = [[0; 2]; 3];
    for (n, kind) in (0_u64..).zip(CloudKind::ALL.iter().cycle().take(28)) {
        let count = [30, 300, 2000, 1200][(n % 4) as usize];
        let scan = prepared(&arbitrary::cloud(*kind, count, n), [16, 4, 64][(n % 3) as usize]);
        let size = scan.bounds().half_extents().into_iter().fold(0.0, f64::max);
        let middle = scan.bounds().centre();
        let scale = [1.0, 1e-3, 1e4][(n % 3) as usize];
        let pose = rotation(&mut rng).with_scale(scale).with_translation(point_in(&mut rng, 3.0 * size));
        let (index, view) = (ShapeIndex::new(&scan), Placed::new(&scan, &pose));
        let placed = view.with_shapes(&index);
        for round in 0..60_usize {
            // Near a point, or anywhere near the scan.
            let about = view.point(rng.random_range(0..scan.len()));
            let reach = size * scale * [1.2, 0.02, 1e-4][round % 3];
            let d = point_in(&mut rng, reach);
            let centre = if round % 4 == 0 {
                pose.apply([0, 1, 2].map(|k| middle[k] + 1.3 * size * (rng.random::<f64>() * 2.0 - 1.0)))
            } else {
                [0, 1, 2].map(|k| about[k] + d[k])
            };
            let radius = reach * rng.random_range(0.01..1.0);
            let to = unit_vector(&mut rng).map(|x| 2.0 * radius * x);
            let shape = match round % 5 {
                0 | 1 => Shape::Sphere { centre, radius },
                2 => Shape::Capsule { ends: [centre, [0, 1, 2].map(|k| centre[k] + to[k])], radius },
                3 => Shape::Capsule { ends: [centre; 2], radius },
                _ => {
                    let half = [radius, 0.5 * radius, 2.0 * radius].map(|h| h / 3.0);
                    let pose = rotation(&mut rng).with_scale(3.0).with_translation(centre);
                    Shape::Box { pose, half, radius: 0.0 }
                }
            };
            let gaps: Vec<f64> = (0..scan.len()).map(|i| gap(&shape, view.point(i))).collect();
            let least = gaps.iter().copied().fold(f64::INFINITY, f64::min);
            // The rounding error of world coordinates in double precision, and of the search for
            // the foot on a segment.
            let lost = 1e-7 * radius + 1e-13 * (size * scale + between(centre, [0.0; 3]));
            let what = format!("{kind:?} {n}, {shape:?}: {least}");
            let touches = placed.touches(&shape);
            if least.abs() > lost {
                let inside = least < 0.0 || (matches!(shape, Shape::Box { .. }) && least <= 0.0);
                assert_eq!(touches, inside, "{what}");
            }
            let of = match shape {
                Shape::Sphere { .. } => 0,
                Shape::Capsule { .. } => 1,
                _ => 2,
            };
            seen[of][usize::from(touches)] += 1;
            let nearest = placed.nearest(&shape, f64::INFINITY).unwrap();
            // Without an index.
            assert_eq!(view.touches(&shape), touches, "{what}");
            assert_eq!(view.nearest(&shape, f64::INFINITY), Some(nearest), "{what}");
            assert!((nearest.gap - least).abs() <= lost + 1e-9 * least.abs(), "{what} for {nearest:?}");
            let own = gap(&shape, nearest.point);
            assert!(
                (own - nearest.gap).abs() <= lost + 1e-9 * own.abs(),
                "{what}: {nearest:?} is {own} away"
            );
            assert_eq!(touches, nearest.gap <= 0.0 || (touches && nearest.gap.abs() < lost), "{what}");
            let within = placed.nearest(&shape, least + radius);
            assert_eq!(view.nearest(&shape, least + radius), within, "{what}");
            assert_eq!(within, Some(nearest), "{what}");
            if least > lost {
                assert_eq!(placed.nearest(&shape, 0.5 * least - lost), None, "{what}");
            }
        }
    }
    assert!(seen.iter().flatten().all(|&n| n > 60), "both answers of every shape: {seen:?}");
}

#[test]
fn many_shapes_are_answered_as_one_by_one_on_any_number_of_threads() {
    let scan = prepared(&arbitrary::cloud(CloudKind::Sphere, 4000, 3), 16);
    let index = ShapeIndex::new(&scan);
    let placed = Placed::new(&scan, &Pose::from_translation([0.5, 0.0, 0.0])).with_shapes(&index);
    let mut rng = arbitrary::rng(92);
    let shapes: Vec<Shape<'_>> =
        (0..5000).map(|_| Shape::Sphere { centre: point_in(&mut rng, 1.5), radius: 0.1 }).collect();
    let one_by_one: Vec<bool> = shapes.iter().map(|shape| placed.touches(shape)).collect();
    for threads in [1, 2, 5] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut answers = vec![false; shapes.len()];
        pool.install(|| placed.touch_each(&shapes, &mut answers));
        assert_eq!(answers, one_by_one, "{threads} threads");
    }
    let hits = one_by_one.iter().filter(|&&hit| hit).count();
    assert!((100..4900).contains(&hits), "some touch, some do not: {hits}");
}

#[test]
fn what_is_no_shape_touches_nothing_and_what_is_endless_everything() {
    let scan = prepared(&arbitrary::cloud(CloudKind::Random, 200, 4), 16);
    let index = ShapeIndex::new(&scan);
    let view = Placed::new(&scan, &Pose::IDENTITY);
    let placed = view.with_shapes(&index);
    let sphere = |centre: [f64; 3], radius: f64| Shape::Sphere { centre, radius };
    for shape in [
        sphere([0.0; 3], -1.0),
        sphere([0.0; 3], f64::NAN),
        sphere([f64::NAN, 0.0, 0.0], 1.0),
        sphere([f64::INFINITY, 0.0, 0.0], 1.0),
        sphere([1e200, 0.0, 0.0], 1.0),
        Shape::Capsule { ends: [[0.0; 3], [f64::NAN; 3]], radius: 1.0 },
        Shape::Box { pose: Pose::IDENTITY, half: [1.0, -1.0, 1.0], radius: 0.0 },
        Shape::Box { pose: Pose::IDENTITY, half: [1.0, f64::NAN, 1.0], radius: 0.0 },
    ] {
        assert!(!placed.touches(&shape) && !view.touches(&shape), "{shape:?}");
    }
    for radius in [4.0, 1e10, 1e19, 1e30, 1e100] {
        let all = sphere([0.0; 3], radius);
        assert!(placed.touches(&all) && view.touches(&all), "{radius}");
        let far = sphere([2.0 * radius, 0.0, 0.0], radius);
        assert!(!placed.touches(&far), "beside it: {radius}");
        let nearest = placed.nearest(&far, f64::INFINITY).unwrap();
        assert!((nearest.gap / radius - 1.0).abs() < 0.3, "{radius}: {nearest:?}");
        assert_eq!(view.nearest(&far, f64::INFINITY), Some(nearest), "{radius}");
    }
}
