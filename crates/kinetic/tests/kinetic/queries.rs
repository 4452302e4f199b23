//! Queries of boxes, rays and frusta against loops over all primitives, and patches.

use nearmiss_geometry::Aabb;
use nearmiss_kinetic::{FlightPlan, KineticTree};
use nearmiss_testdata::arbitrary::{point_in, rng, unit_vector};
use rand::RngExt;

use crate::model::{MOTIONS, Model, plan};

fn sorted(mut found: Vec<u32>) -> Vec<u32> {
    found.sort_unstable();
    found
}

/// The entry of a ray into a box, by sampling none: the interval of each axis in turn.
fn entry(bounds: &Aabb, origin: [f64; 3], direction: [f64; 3], limit: f64) -> Option<f64> {
    let mut interval = [0.0, limit];
    for k in 0..3 {
        let [a, b] = [bounds.min[k], bounds.max[k]].map(|x| (x - origin[k]) / direction[k]);
        interval = [interval[0].max(a.min(b)), interval[1].min(a.max(b))];
    }
    (interval[0] <= interval[1]).then_some(interval[0])
}

#[test]
fn queries_find_what_loops_find() {
    let rng = &mut rng(8);
    for motion in MOTIONS {
        let mut model = Model::random(motion, 200, 3, rng);
        for _ in 0..10 {
            model.tree.advance(model.tree.clock() + rng.random_range(0.0..0.4)).unwrap();
            let all = model.alive();
            // Tiny amounts of room keep rounding from deciding.
            let [a, b] = [point_in(rng, 1.5), point_in(rng, 1.5)];
            let bounds = Aabb::of([a, b]);
            let mut found = Vec::new();
            model.tree.in_box(&bounds, |primitive| found.push(primitive));
            let meets =
                |own: &Aabb| (0..3).all(|k| own.min[k] <= bounds.max[k] && bounds.min[k] <= own.max[k]);
            let expected: Vec<u32> = all.iter().copied().filter(|&i| meets(&model.bounds(i))).collect();
            assert_eq!(sorted(found), expected, "{motion:?}: box {bounds:?}");

            let planes: [[f64; 4]; 4] = [0; 4].map(|_: i32| {
                let [x, y, z] = unit_vector(rng);
                [x, y, z, 0.7]
            });
            let mut found = Vec::new();
            model.tree.in_frustum(&planes, |primitive| found.push(primitive));
            let inside = |own: &Aabb, p: &[f64; 4]| {
                let furthest = own.corners().into_iter().map(|c| p[0] * c[0] + p[1] * c[1] + p[2] * c[2]);
                furthest.fold(f64::NEG_INFINITY, f64::max) + p[3] >= 0.0
            };
            let seen = |&i: &u32| planes.iter().all(|plane| inside(&model.bounds(i), plane));
            let expected: Vec<u32> = all.iter().copied().filter(seen).collect();
            assert_eq!(sorted(found), expected, "{motion:?}: frustum");

            let [origin, direction] = [point_in(rng, 2.0), unit_vector(rng)];
            let hits: Vec<(u32, f64)> = all
                .iter()
                .filter_map(|&i| Some((i, entry(&model.bounds(i), origin, direction, 3.0)?)))
                .collect();
            let mut found = Vec::new();
            model.tree.on_ray(origin, direction, 3.0, |primitive, _| {
                found.push(primitive);
                3.0
            });
            let expected: Vec<u32> = hits.iter().map(|&(i, _)| i).collect();
            assert_eq!(sorted(found), expected, "{motion:?}: ray");
            let mut nearest = f64::INFINITY;
            model.tree.on_ray(origin, direction, 3.0, |_, enter| {
                nearest = nearest.min(enter);
                nearest
            });
            let expected = hits.iter().map(|&(_, enter)| enter).fold(f64::INFINITY, f64::min);
            assert!(nearest == expected || (nearest - expected).abs() < 1e-12, "{nearest}, {expected}");
        }
    }
}

/// The Bernstein polynomials of degree 3.
fn bernstein(u: f64) -> [f64; 4] {
    let v = 1.0 - u;
    [v * v * v, 3.0 * u * v * v, 3.0 * u * u * v, u * u * u]
}

#[test]
fn patches_stay_in_their_boxes() {
    let rng = &mut rng(9);
    for motion in MOTIONS {
        let plans: Vec<FlightPlan> = (0..64).map(|_| plan(motion, 0.0, rng)).collect();
        let weights: Vec<f64> = (0..64).map(|_| rng.random_range(0.1..9.0)).collect();
        let patches: Vec<Vec<u32>> =
            (0..8).map(|_| (0..16).map(|_| rng.random_range(0..64)).collect()).collect();
        let mut tree = KineticTree::new(0.0, plans, &patches).unwrap();
        for step in 1..8_u32 {
            tree.advance(f64::from(step) * 0.3).unwrap();
            tree.for_each_node(|bounds, below| {
                let slack = |x: f64| 1e-12 * (20.0 + x.abs());
                for &patch in below {
                    let [bu, bv] = [0; 2].map(|_: i32| bernstein(rng.random_range(0.0..1.0)));
                    for is_rational in [false, true] {
                        let (mut sum, mut total) = ([0.0; 3], 0.0);
                        for (i, &point) in tree.primitive(patch).unwrap().iter().enumerate() {
                            let weight = if is_rational { weights[point as usize] } else { 1.0 };
                            let weight = weight * bu[i / 4] * bv[i % 4];
                            let place = tree.position(point).unwrap();
                            sum = [0, 1, 2].map(|k| sum[k] + weight * place[k]);
                            total += weight;
                        }
                        for k in 0..3 {
                            let x = sum[k] / total;
                            let is_inside = bounds.min[k] - slack(x) <= x && x <= bounds.max[k] + slack(x);
                            assert!(is_inside, "{motion:?}: {x} is outside {bounds:?}");
                        }
                    }
                }
            });
        }
    }
}
