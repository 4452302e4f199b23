//! Distances against exact ones, and against dense samples.

use nearmiss_mesh::{Corners, triangle_distance, triangles_meet};
use rand::RngExt;

use super::cases::{Random, extent, lattice_pair, magnitude, mixed, nearly_touching, power_scaled, random};
use super::exact;

/// The greatest error, relative to the extent of both triangles, over so many pairs.
fn worst_error(cases: u32, seed: u64, mut draw: impl FnMut(&mut Random) -> [Corners; 2]) -> f64 {
    let rng = &mut random(seed);
    let mut worst = 0.0_f64;
    for _ in 0..cases {
        let pair = draw(rng);
        let [a, b] = pair;
        let found = triangle_distance(&a, &b);
        assert_eq!(found.distance == 0.0, triangles_meet(&a, &b), "{a:?} {b:?}");
        let expected = exact::distance(&a, &b);
        let size = extent(&pair);
        if size > 0.0 {
            worst = worst.max((found.distance - expected).abs() / size);
        }
        assert!((found.distance - expected).abs() <= 1e-12 * size, "{a:?} {b:?} {found:?} {expected}");
        let [p, q] = found.points;
        let between = (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt();
        let rounding = 1e-12 * size + 8.0 * f64::EPSILON * magnitude(&pair);
        assert!((between - expected).abs() <= rounding, "{a:?} {b:?} {found:?} {between} {expected}");
        for (point, t) in [(p, &a), (q, &b)] {
            assert!(exact::distance_to(point, t) <= rounding, "{point:?} is off {t:?}");
        }
        let swapped = triangle_distance(&b, &a).distance;
        assert!((swapped - found.distance).abs() <= 1e-14 * size, "{a:?} {b:?} {swapped} {found:?}");
    }
    worst
}

#[test]
fn distances_of_lattice_triangles_are_exact_up_to_rounding() {
    let worst = worst_error(4_000, 21, lattice_pair);
    assert!(worst < 1e-14, "{worst}");
}

#[test]
fn distances_of_random_triangles_are_exact_up_to_rounding() {
    let worst = worst_error(3_000, 22, |rng| {
        [(); 2].map(|()| [(); 3].map(|()| [(); 3].map(|()| rng.random::<f64>())))
    });
    assert!(worst < 1e-14, "{worst}");
}

#[test]
fn distances_of_nearly_touching_triangles_are_accurate() {
    let worst = worst_error(3_000, 23, nearly_touching);
    assert!(worst < 1e-14, "{worst}");
}

/// Needles as thin as 1e-16 of their length, nearly parallel edges and planes, at gaps of all
/// sizes.
#[test]
fn distances_of_needles_are_accurate() {
    let worst = worst_error(2_500, 24, |rng| {
        let thin = 10.0_f64.powi(rng.random_range(-16..0));
        let gap = 10.0_f64.powi(rng.random_range(-15..1));
        let axis: [f64; 3] = [(); 3].map(|()| rng.random_range(-1.0..1.0));
        let needle = |rng: &mut Random, height: f64| {
            [0.0, 1.0, rng.random()].map(|along: f64| {
                let place = along + height * rng.random::<f64>();
                [0, 1, 2].map(|k| place * axis[k] + thin * rng.random_range(-1.0..1.0) + height * 0.3)
            })
        };
        [needle(rng, 0.0), needle(rng, gap)]
    });
    assert!(worst < 1e-14, "{worst}");
}

#[test]
fn distances_are_those_of_dense_samples() {
    let rng = &mut random(25);
    let steps = 24_u8;
    for _ in 0..300 {
        let pair = [(); 2].map(|()| [(); 3].map(|()| [(); 3].map(|()| rng.random::<f64>())));
        let [a, b] = pair;
        let samples = |t: &Corners| -> Vec<[f64; 3]> {
            let share = |i: u8| f64::from(i) / f64::from(steps);
            let places = (0..=steps).flat_map(|i| (0..=steps - i).map(move |j| [share(i), share(j)]));
            places.map(|[s, r]| mixed(t, [1.0 - s - r, s, r])).collect()
        };
        let (of_a, of_b) = (samples(&a), samples(&b));
        let square = |p: &[f64; 3], q: &[f64; 3]| (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>();
        let all = of_a.iter().flat_map(|p| of_b.iter().map(move |q| square(p, q)));
        let sampled = all.fold(f64::INFINITY, f64::min).sqrt();
        let found = triangle_distance(&a, &b).distance;
        // Within a step along each of two edges, which are shorter than √3, of every point is a
        // sample.
        let spacing = 2.0 * 2.0 * 3.0_f64.sqrt() / f64::from(steps);
        assert!(found <= sampled + 1e-15 && sampled <= found + spacing, "{a:?} {b:?} {found} {sampled}");
    }
}

#[test]
fn distances_of_extreme_coordinates_are_finite() {
    let floor = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let above = |height| [[0.2, 0.2, height], [0.3, 0.2, 1.0], [0.2, 0.3, 1.0]];
    let found = triangle_distance(&floor, &above(1e-300));
    assert!(found.distance > 0.0 && found.distance < 1e-15, "{found:?}");
    for exponent in [-1060, -500, 500, 1015] {
        let scaled = |t: &Corners, by: f64| t.map(|p| p.map(|x| power_scaled(by * x, exponent)));
        let far = above(3.0).map(|p| [p[0], p[1], p[2] + 2.0]);
        let found = triangle_distance(&scaled(&floor, 16.0), &scaled(&far, 16.0)).distance;
        // The lowest corners are at height 1 and lifted by 2.
        let expected = power_scaled(3.0 * 16.0, exponent);
        assert!((found / expected - 1.0).abs() < 1e-3, "2^{exponent}: {found} {expected}");
    }
    let f = f64::MAX;
    let corner = |x: f64| [[x, x, x], [x, 0.5 * x, x], [x, x, 0.5 * x]];
    let found = triangle_distance(&corner(f), &corner(-f));
    assert_eq!(found.distance, f);
    assert!(found.points.iter().flatten().all(|x| x.is_finite()), "{found:?}");
}
