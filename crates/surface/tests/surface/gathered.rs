//! Gathered points and lists of blocks, compared with all blocks.

use fearless_simd::dispatch;
use nearmiss_index::PointBlock;
use nearmiss_surface::{
    Centre, Evaluation, Gathered, Kernel, Moments, Neighbourhood, SurfaceOptions, SurfacePlan,
};
use nearmiss_testdata::arbitrary::{point_in, rng, unit_vector};
use nearmiss_testdata::instructions::levels;

/// Returns the indices of the blocks with a point that has `x` within its support radius.
fn supporting(blocks: &[PointBlock], x: [f64; 3]) -> Vec<u32> {
    let supports = |block: &PointBlock| {
        (0..PointBlock::WIDTH).any(|i| {
            let d_sq: f64 = (0..3).map(|k| (f64::from(block.position[k][i]) - x[k]).powi(2)).sum();
            d_sq < f64::from(block.support_radius[i]).powi(2)
        })
    };
    (0..).zip(blocks).filter(|(_, block)| supports(block)).map(|(i, _)| i).collect()
}

/// Compares f at places up to `distance` from `place`, in these `directions`.
fn compare(
    plan: &SurfacePlan,
    blocks: &[PointBlock],
    place: [f32; 3],
    distance: f32,
    directions: &[[f64; 3]],
) {
    let all: Vec<u32> = (0..).take(blocks.len()).collect();
    for level in levels() {
        let mut gathered = Gathered::default();
        dispatch!(level, simd => gathered.gather(simd, plan, (blocks, &all), place, distance));
        for direction in directions {
            let x = [0, 1, 2].map(|k| f64::from(place[k]) + direction[k] * f64::from(distance));
            let found: Evaluation = dispatch!(level, simd => {
                let mut near = Neighbourhood::new(simd, plan, &Centre::new(x));
                near.offer_gathered(simd, &mut gathered);
                near.moments(simd).evaluate(plan, x)
            });
            let expected = Moments::about(level, plan, x, blocks.iter().copied()).evaluate(plan, x);
            assert_eq!(found, expected, "at {x:?}, {distance} about {place:?}, {level:?}");
            let decays: Vec<_> =
                blocks.iter().map(|block| block.support_radius.map(|radius| plan.decay(radius))).collect();
            for decays in [&decays[..], &[]] {
                let mut near = all.clone();
                let (found, count) = dispatch!(level, simd => {
                    let mut sums = Neighbourhood::new(simd, plan, &Centre::new(x));
                    let count = sums.offer_all(simd, (blocks, decays), &mut near, &mut Vec::new());
                    (sums.moments(simd).evaluate(plan, x), count)
                });
                assert_eq!(found, expected, "at {x:?}, {level:?}");
                assert_eq!(near[..count], supporting(blocks, x), "at {x:?}, {level:?}");
            }
        }
    }
}

#[test]
fn gathered_points_change_no_bit() {
    let rng = &mut rng(3);
    let mut compared = 0;
    for kernel in [Kernel::Gaussian, Kernel::Wendland] {
        let plan = SurfacePlan::new(&SurfaceOptions::default().with_kernel(kernel), 1.0, 1.0).unwrap();
        for round in 0..40 {
            // Far from the origin, positions are rounded as much as distances.
            let shift = [0.0, 3000.0, -2e5][round % 3];
            let places = (0..500 + round).map(|_| point_in(rng, 12.0));
            #[expect(clippy::cast_possible_truncation, reason = "positions are single precision")]
            let points: Vec<[f32; 3]> =
                places.map(|[x, y, z]| [x + shift, y - shift, 0.1 * z].map(|c| c as f32)).collect();
            let radii: Vec<f32> = points.iter().map(|p| 0.6 + 0.4 * p[2].sin()).collect();
            let blocks: Vec<PointBlock> = plan.blocks(&points, &radii).collect();
            let directions = [0.0, 0.3, 0.9, 1.0, 1.0, 1.0].map(|share| unit_vector(rng).map(|c| c * share));
            for (place, distance) in points.iter().step_by(90).zip([0.0, 0.25, 3.0, 0.0, 0.25, 3.0]) {
                compare(&plan, &blocks, *place, distance, &directions);
                compared += 1;
            }
        }
    }
    assert!(compared > 400, "{compared} places");
}

#[test]
fn nothing_is_gathered_from_nothing() {
    let plan = SurfacePlan::new(&SurfaceOptions::default(), 1.0, 1.0).unwrap();
    compare(&plan, &[], [0.0; 3], 1.0, &[[0.0; 3]]);
    compare(&plan, &[PointBlock::EMPTY], [0.0; 3], 1.0, &[[0.0; 3], [1.0, 0.0, 0.0]]);
}
