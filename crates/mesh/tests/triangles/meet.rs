//! The exact test against its twin.

use nearmiss_mesh::{Corners, triangles_meet};

use super::cases::{lattice_pair, mixed, nearly_touching, on_lattice, power_scaled, random};
use super::exact;

const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];

/// The answer for all orders of corners and of triangles, which must be the same.
fn meet_in_any_order(a: &Corners, b: &Corners) -> bool {
    let answer = triangles_meet(a, b);
    for of_a in ORDERS.map(|order| order.map(|k| a[k])) {
        for of_b in ORDERS.map(|order| order.map(|k| b[k])) {
            assert_eq!(triangles_meet(&of_a, &of_b), answer, "{of_a:?} {of_b:?}");
            assert_eq!(triangles_meet(&of_b, &of_a), answer, "{of_b:?} {of_a:?}");
        }
    }
    answer
}

#[expect(clippy::cast_possible_truncation, reason = "small integers")]
fn integers(t: &Corners) -> [[i128; 3]; 3] {
    t.map(|p| p.map(|x| x as i128))
}

#[test]
fn lattice_triangles_meet_exactly() {
    let rng = &mut random(1);
    let mut hits = 0;
    let total = 120_000;
    for _ in 0..total {
        let [a, b] = lattice_pair(rng);
        let expected = exact::meet(&integers(&a), &integers(&b));
        assert_eq!(meet_in_any_order(&a, &b), expected, "{a:?} {b:?}");
        hits += u32::from(expected);
    }
    assert!(hits > total / 4 && hits < total * 3 / 4, "{hits} of {total} meet");
}

/// Powers of two and shifts keep exactness but take the integers of both widths.
#[test]
fn extreme_coordinates_are_exact() {
    let rng = &mut random(2);
    for i in 0..6_000 {
        let [a, b] = lattice_pair(rng);
        let expected = exact::meet(&integers(&a), &integers(&b));
        for exponent in [-1070, -1000, -400, -252, 298, 350, 1000, 1015] {
            let scaled = |t: &Corners| t.map(|p| p.map(|x| power_scaled(x, exponent)));
            assert_eq!(triangles_meet(&scaled(&a), &scaled(&b)), expected, "{a:?} {b:?} 2^{exponent}");
        }
        // Each axis has a scale of its own, up to the whole range of doubles.
        if i % 20 == 0 {
            let stretched =
                |t: &Corners| t.map(|p| [0, 1, 2].map(|k| power_scaled(p[k], [1000, -1000, -1070][k])));
            assert_eq!(triangles_meet(&stretched(&a), &stretched(&b)), expected, "{a:?} {b:?} stretched");
        }
    }
}

#[test]
fn the_least_double_separates() {
    let floor = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let least = f64::from_bits(1);
    let above = |height| [[0.2, 0.2, height], [0.3, 0.2, 1.0], [0.2, 0.3, 1.0]];
    assert!(meet_in_any_order(&floor, &above(0.0)), "touching");
    assert!(!meet_in_any_order(&floor, &above(least)), "apart by the least double");
    assert!(meet_in_any_order(&floor, &above(-least)), "below by the least double");
    // Boxes meet, and the least coordinate decides.
    let slanted = [[0.0, 0.0, least], [1.0, 0.0, -1.0], [0.0, 1.0, 1.0]];
    let point = |z: f64| [[0.0, 0.0, z]; 3];
    assert!(meet_in_any_order(&slanted, &point(least)), "the corner itself");
    assert!(!meet_in_any_order(&slanted, &point(0.0)), "just below the corner");
    let f = f64::MAX;
    let huge = [[-f, -f, 0.0], [f, -f, 0.0], [0.0, f, 0.0]];
    assert!(meet_in_any_order(&huge, &[[0.0, 0.0, -f], [0.0, 0.0, f], [1.0, 0.0, f]]), "huge");
    assert!(!meet_in_any_order(&huge, &[[f, f, -f], [f, f, f], [f, 0.5 * f, f]]), "huge, beside");
}

#[test]
fn nearly_touching_triangles_meet_exactly() {
    let rng = &mut random(3);
    let (mut hits, total) = (0, 6_000);
    for _ in 0..total {
        let [a, b] = nearly_touching(rng);
        let expected = exact::floats_meet(&a, &b);
        assert_eq!(meet_in_any_order(&a, &b), expected, "{a:?} {b:?}");
        hits += u32::from(expected);
    }
    assert!(hits > total / 5 && hits < total * 4 / 5, "{hits} of {total} meet");
}

#[test]
fn triangles_without_area_are_segments_and_points() {
    let rng = &mut random(4);
    let mut hits = 0;
    for _ in 0..30_000 {
        let degenerate = |t: Corners, kind: u32| match kind {
            0 => [t[0], t[1], t[0]],
            // The middle of an even edge, so that it is exact.
            1 => [t[0].map(|x| 2.0 * x), mixed(&t, [1.0, 1.0, 0.0]), t[1].map(|x| 2.0 * x)],
            _ => [t[0]; 3],
        };
        let a = degenerate(on_lattice(rng, 2), rand::RngExt::random_range(rng, 0..3));
        let b = degenerate(on_lattice(rng, 2), rand::RngExt::random_range(rng, 0..3));
        let expected = exact::meet(&integers(&a), &integers(&b));
        assert_eq!(meet_in_any_order(&a, &b), expected, "{a:?} {b:?}");
        hits += u32::from(expected);
    }
    assert!(hits > 1_500, "{hits} meet");
}

#[test]
fn other_numbers_do_not_panic() {
    let rng = &mut random(5);
    let others = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, -0.0];
    for _ in 0..4000 {
        let mut pair = lattice_pair(rng);
        for _ in 0..rand::RngExt::random_range(rng, 1..4) {
            let [t, i, k] = [2, 3, 3].map(|n| rand::RngExt::random_range(rng, 0..n));
            pair[t][i][k] = others[rand::RngExt::random_range(rng, 0..others.len())];
        }
        let _ = triangles_meet(&pair[0], &pair[1]);
        let _ = nearmiss_mesh::triangle_contact(&pair[0], &pair[1]);
        let _ = nearmiss_mesh::triangle_distance(&pair[0], &pair[1]);
    }
}
