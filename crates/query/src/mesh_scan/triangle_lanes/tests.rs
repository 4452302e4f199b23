//! Tests of distances in lanes.

use nearmiss_mesh::nearest_on_triangle;
use nearmiss_testdata::arbitrary::{point_in, rng, unit_vector};
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

/// Gaps are below the distances of all places of the parts, and slabs raise them.
#[test]
fn gaps_of_parts_are_below_the_distances_of_their_places() {
    let rng = &mut rng(62);
    let mut better = 0;
    for round in 0..200 {
        let shift = [0.4, 0.8][round % 2];
        let corners = [(); 3].map(|()| {
            let [x, y, z] = point_in(rng, 0.5);
            single([x, y, 0.2 * z + shift])
        });
        let mut positions = [[0.0; 16]; 3];
        let mut parts = ObstacleParts { normals: [[0.0; 16]; 3], reaches: [0.0; 16], slabs: [0.0; 16] };
        for lane in 0..16 {
            let ([x, y, _], [nx, ny, _]) = (point_in(rng, 0.5), point_in(rng, 0.2));
            let length = (nx * nx + ny * ny + 1.0).sqrt();
            let (place, normal) = (single([x, y, 0.0]), single([nx / length, ny / length, 1.0 / length]));
            for k in 0..3 {
                (positions[k][lane], parts.normals[k][lane]) = (place[k], normal[k]);
            }
            parts.reaches[lane] = rng.random_range(0.1..0.5);
            parts.slabs[lane] = if lane % 5 == 4 { f32::INFINITY } else { 0.3 * parts.reaches[lane] };
        }
        let gaps = |level: Level, parts: &ObstacleParts| {
            dispatch!(level, simd => {
                let corners = corners.map(|corner| corner.map(|x| f32x4::splat(simd, x)));
                let triangle = Prepared::new(simd, corners, 1e-7).get(1);
                triangle.gaps_to_parts(simd, &load(simd, &positions), parts).to_array()
            })
        };
        let found: Vec<_> = levels().into_iter().map(|level| gaps(level, &parts)).collect();
        assert!(found.iter().all(|other| *other == found[0]), "every level: {found:?}");
        let whole = gaps(levels()[0], &ObstacleParts { slabs: [f32::INFINITY; 16], ..parts });
        for lane in 0..16 {
            let gap = found[0][lane];
            assert!(gap >= whole[lane], "{gap} {}", whole[lane]);
            better += usize::from(gap > whole[lane] + 0.02);
            let of = |rows: &[[f32; 16]; 3]| [0, 1, 2].map(|k| f64::from(rows[k][lane]));
            let (centre, normal, most) = (of(&positions), of(&parts.normals), f64::from(parts.slabs[lane]));
            for _ in 0..100 {
                let out = unit_vector(rng).map(|x| x * f64::from(parts.reaches[lane]));
                let height: f64 = (0..3).map(|k| out[k] * normal[k]).sum();
                let back = height - height.clamp(-most, most);
                let place = [0, 1, 2].map(|k| centre[k] + out[k] - back * normal[k]);
                let foot = nearest_on_triangle(&corners.map(|corner| corner.map(f64::from)), place);
                let exact = (0..3).map(|k| (place[k] - foot[k]).powi(2)).sum::<f64>().sqrt();
                assert!(f64::from(gap) <= exact + 1e-6, "round {round}: {gap}, is {exact}");
            }
        }
    }
    assert!(better > 500, "{better} better than by balls");
}
