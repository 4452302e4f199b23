//! Tests of distances in lanes.

use nearmiss_mesh::nearest_on_triangle;
use nearmiss_testdata::arbitrary::{point_in, rng};
use nearmiss_testdata::instructions::levels;
use rand::RngExt;

use super::*;

#[expect(clippy::cast_possible_truncation, reason = "stored in single precision")]
fn single(v: [f64; 3]) -> [f32; 3] {
    v.map(|c| c as f32)
}

fn distances(level: Level, corners: [[f32; 3]; 3], slack: f32, positions: &[[f32; 16]; 3]) -> [f32; 16] {
    dispatch!(level, simd => {
        let corners = corners.map(|corner| corner.map(|x| f32x4::splat(simd, x)));
        Prepared::new(simd, corners, slack).get(2).distances(simd, &load(simd, positions)).to_array()
    })
}

#[test]
fn distances_are_below_those_in_double_precision_and_near_them() {
    let rng = &mut rng(61);
    let (mut share, mut count) = (0.0, 0.0);
    for round in 0..3000_usize {
        let wide = [1.0, 30.0, 1e-3, 1e4][round % 4];
        let [p, along] = [point_in(rng, 1.0), point_in(rng, wide)];
        // From a right triangle to a needle without area.
        let thin = [1.0, 1e-2, 1e-4, 1e-6, 0.0][round % 5] * wide;
        let [q, r] = [1.0, rng.random_range(-1.0..1.0)].map(|t: f64| {
            let beside = point_in(rng, thin);
            [0, 1, 2].map(|k| p[k] + t * along[k] + beside[k])
        });
        let corners = [p, q, r].map(single);
        let slack = 1e-7;
        let mut positions = [[0.0; 16]; 3];
        for lane in 0..16 {
            let place = single(point_in(rng, 2.0));
            (0..3).for_each(|k| positions[k][lane] = place[k]);
        }
        let found: Vec<_> =
            levels().into_iter().map(|level| distances(level, corners, slack, &positions)).collect();
        assert!(found.iter().all(|other| *other == found[0]), "every level: {found:?}");
        for lane in 0..16 {
            let place = [0, 1, 2].map(|k| f64::from(positions[k][lane]));
            let foot = nearest_on_triangle(&corners.map(|corner| corner.map(f64::from)), place);
            let exact = (0..3).map(|k| (place[k] - foot[k]).powi(2)).sum::<f64>().sqrt();
            let bound = f64::from(found[0][lane]);
            assert!(bound <= exact, "round {round}: {bound}, is {exact}, {corners:?}");
            if wide < 100.0 && exact > 0.1 {
                (share, count) = (share + bound / exact, count + 1.0);
            }
        }
    }
    assert!(count > 10_000.0 && share / count > 0.999, "{share} of {count}");
}

#[test]
fn triangles_out_of_range_bound_nothing() {
    for far in [1e20, f32::NAN] {
        let corners = [[far, 0.0, 0.0], [0.0; 3], [0.0, f32::INFINITY, 0.0]];
        let found = distances(Level::new(), corners, 1.0, &[[5.0; 16]; 3]);
        assert!(found.iter().all(|&bound| bound == f32::NEG_INFINITY), "{found:?}");
    }
}
