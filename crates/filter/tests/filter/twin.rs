//! Compares the filters with naive twins on random, adversarial and degenerate clouds.
#![cfg(test)]

use nearmiss_filter::{FilterError, crop, min_neighbours, remove_outliers, voxel};
use nearmiss_geometry::PointCloud;
use proptest::prelude::*;

fn cloud(points: &[[f64; 3]]) -> PointCloud {
    PointCloud::cleaned(points).unwrap()
}

fn distance(a: [f32; 3], b: [f32; 3]) -> f64 {
    (0..3).map(|k| (f64::from(a[k]) - f64::from(b[k])).powi(2)).sum::<f64>().sqrt()
}

/// Distances from each point to all others, ascending, in the frame of the input.
fn all_distances(cloud: &PointCloud) -> Vec<Vec<f64>> {
    let positions = cloud.positions();
    let of = |i: usize| {
        let others = (0..positions.len()).filter(|j| *j != i);
        let mut distances: Vec<f64> =
            others.map(|j| distance(positions[i], positions[j]) * cloud.frame().scale).collect();
        distances.sort_by(f64::total_cmp);
        distances
    };
    (0..positions.len()).map(of).collect()
}

fn ids(count: usize) -> impl Iterator<Item = u32> {
    0..u32::try_from(count).unwrap()
}

/// Bounds on a filter's result in spite of rounding: the points that must stay, and those that may
/// stay.
struct Bracket {
    surely: Vec<u32>,
    maybe: Vec<u32>,
}

impl Bracket {
    /// Creates the bounds for a filter that keeps points with values up to `most`.
    fn new(values: &[f64], most: f64) -> Self {
        let up_to = |most: f64| ids(values.len()).filter(|i| values[*i as usize] <= most).collect();
        Self { surely: up_to(most * (1.0 - 1e-8)), maybe: up_to(most * (1.0 + 1e-8)) }
    }

    /// Accepts `TooFewLeft`, because the clouds here are small.
    fn check(&self, found: &Result<Vec<u32>, FilterError>) {
        match found {
            Ok(kept) => {
                assert!(kept.is_sorted_by(|a, b| a < b), "{kept:?} ascends");
                assert!(self.surely.iter().all(|i| kept.contains(i)), "{:?} of {kept:?}", self.surely);
                assert!(kept.iter().all(|i| self.maybe.contains(i)), "{kept:?} of {:?}", self.maybe);
            }
            Err(FilterError::TooFewLeft { left, .. }) => {
                assert!(*left < 8 && self.surely.len() <= *left && *left <= self.maybe.len(), "{left}");
            }
            Err(error) => panic!("{error}"),
        }
    }
}

fn check_outliers(cloud: &PointCloud, all: &[Vec<f64>], k: usize, sigma: f64) {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let distances: Vec<f64> = all.iter().map(|near| mean(&near[..k])).collect();
    let centre = mean(&distances);
    let variance = distances.iter().map(|d| (d - centre).powi(2)).sum::<f64>() / (distances.len() - 1) as f64;
    Bracket::new(&distances, centre + sigma * variance.sqrt()).check(&remove_outliers(cloud, k, sigma));
}

fn check_neighbours(cloud: &PointCloud, all: &[Vec<f64>], n: usize, radius: f64) {
    let nth: Vec<f64> = all.iter().map(|near| near[n - 1]).collect();
    Bracket::new(&nth, radius).check(&min_neighbours(cloud, n, radius));
}

/// Checks that one point of each cell is kept, and that no other point of the cell is nearer to the
/// mean. In a cell of two points, the first must be kept.
fn check_voxel(cloud: &PointCloud, size: f64) {
    let points: Vec<[f64; 3]> = (0..cloud.len()).map(|i| cloud.point(i)).collect();
    let cell = |p: [f64; 3]| p.map(|x| (x / size).floor());
    let mut cells: Vec<([f64; 3], Vec<u32>)> = Vec::new();
    for (i, p) in ids(points.len()).zip(&points) {
        match cells.iter_mut().find(|(at, _)| *at == cell(*p)) {
            Some((_, members)) => members.push(i),
            None => cells.push((cell(*p), vec![i])),
        }
    }
    let kept = match voxel(cloud, size) {
        Err(FilterError::TooFewLeft { left, .. }) => {
            assert_eq!(left, cells.len());
            assert!(left < 8, "{left} are enough");
            return;
        }
        kept => kept.unwrap(),
    };
    assert!(kept.is_sorted_by(|a, b| a < b), "{kept:?} ascends");
    assert_eq!(kept.len(), cells.len(), "one point a cell");
    for (_, members) in &cells {
        let local = |i: u32| cloud.positions()[i as usize].map(f64::from);
        let mean =
            [0, 1, 2].map(|k| members.iter().map(|i| local(*i)[k]).sum::<f64>() / members.len() as f64);
        let off = |i: u32| (0..3).map(|k| (local(i)[k] - mean[k]).powi(2)).sum::<f64>().sqrt();
        let chosen: Vec<u32> = members.iter().copied().filter(|i| kept.contains(i)).collect();
        let [chosen] = chosen[..] else { panic!("{chosen:?} of {members:?}") };
        let least = members.iter().map(|i| off(*i)).fold(f64::INFINITY, f64::min);
        let slack = 1e-9 * size / cloud.frame().scale;
        assert!(off(chosen) <= least + slack, "point {chosen} of {members:?}");
        if let [first, _] = members[..] {
            assert_eq!(chosen, first, "two points are equally near to their mean");
        }
    }
}

fn check_crop(cloud: &PointCloud, min: [f64; 3], max: [f64; 3]) {
    let within = |i: &u32| {
        let p = cloud.point(*i as usize);
        (0..3).all(|k| min[k] <= p[k] && p[k] <= max[k])
    };
    let expected: Vec<u32> = ids(cloud.len()).filter(within).collect();
    match crop(cloud, min, max) {
        Ok(kept) => assert_eq!(kept, expected),
        Err(FilterError::TooFewLeft { left, points, .. }) => {
            assert_eq!((left, points), (expected.len(), cloud.len()));
            assert!(left < 8, "{left} are enough");
        }
        Err(error) => panic!("{error}"),
    }
}

/// Pseudorandom numbers in 0..1.
fn noise(seed: u64, i: usize) -> f64 {
    let mut x = (i as u64).wrapping_add(seed << 32).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ x >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ x >> 32).wrapping_mul(0x94d0_49bb_1331_11eb);
    (x >> 11) as f64 / (1_u64 << 53) as f64
}

fn noisy(seed: u64, count: usize) -> Vec<[f64; 3]> {
    (0..count).map(|i| [0, 1, 2].map(|k| noise(seed, 3 * i + k))).collect()
}

/// Clouds that are hard for trees and grids.
fn hard_clouds() -> Vec<(&'static str, Vec<[f64; 3]>)> {
    let numbers = || (0..300_u16).map(f64::from);
    let far = [4_000_000.0, 5_000_000.0, -300.0];
    let mut bimodal: Vec<[f64; 3]> = noisy(1, 200);
    bimodal.extend(noisy(2, 100).iter().map(|p| p.map(|x| 1000.0 + 1e-3 * x)));
    vec![
        ("random", noisy(3, 300)),
        ("a row", numbers().map(|i| [i, 2.0, 3.0]).collect()),
        ("a row along z", numbers().map(|i| [-7.5, 0.0, 0.25 * i]).collect()),
        ("a plane", (0..300).map(|i| [0.1 * f64::from(i % 20), 4.0, 0.1 * f64::from(i / 20)]).collect()),
        ("a plane of noise", noisy(4, 300).iter().map(|p| [p[0], 0.5, p[2]]).collect()),
        ("a lattice", (0..343).map(|i| [i % 7, i / 7 % 7, i / 49].map(f64::from)).collect()),
        (
            "a lattice about zero",
            (0..343).map(|i| [i % 7 - 3, i / 7 % 7 - 3, i / 49 - 3].map(f64::from)).collect(),
        ),
        ("far away", noisy(5, 300).iter().map(|p| [0, 1, 2].map(|k| far[k] + p[k])).collect()),
        ("huge", noisy(6, 300).iter().map(|p| p.map(|x| 1e30 * x)).collect()),
        ("tiny", noisy(7, 300).iter().map(|p| p.map(|x| 1e-30 * x)).collect()),
        ("two densities", bimodal),
        ("growing", (0..60).map(|i| [2.0_f64.powi(i / 2), f64::from(i % 2), 0.0]).collect()),
        ("eight points", noisy(8, 8)),
    ]
}

#[test]
fn filters_agree_with_their_twins_on_hard_clouds() {
    for (name, points) in hard_clouds() {
        println!("{name}");
        let cloud = cloud(&points);
        let half = cloud.bounds().half_extents().into_iter().fold(0.0, f64::max);
        let all = all_distances(&cloud);
        for k in [1, 2, 6, cloud.len() - 1] {
            for sigma in [0.5, 1.0, 3.0] {
                check_outliers(&cloud, &all, k, sigma);
            }
            for share in [1e-3, 0.03, 0.1, 0.5, 10.0] {
                check_neighbours(&cloud, &all, k, share * half);
            }
        }
        for share in [1e-5, 1e-3, 0.03, 0.1, 1.0 / 3.0, 0.5, 10.0] {
            check_voxel(&cloud, share * half);
        }
        let centre = cloud.bounds().centre();
        check_crop(&cloud, cloud.bounds().min, cloud.bounds().max);
        check_crop(&cloud, cloud.bounds().min, centre);
        check_crop(&cloud, centre.map(|c| c - 0.4 * half), centre.map(|c| c + 0.4 * half));
    }
}

/// Scan lines and walls hold many points with one equal coordinate. Some k-d trees form endless or
/// wrong leaves of such points.
#[test]
fn many_equal_coordinates_are_no_trap() {
    for axis in 0..3 {
        let mut points = noisy(9, 40_000);
        for p in &mut points {
            p[axis] = 1.5;
        }
        // A few points off the plane, which a filter must find.
        for p in points.iter_mut().step_by(4000) {
            p[axis] = 2.5;
        }
        let cloud = cloud(&points);
        let lone: Vec<u32> = ids(points.len()).filter(|i| i % 4000 == 0).collect();
        let without =
            |kept: Vec<u32>| ids(points.len()).filter(|i| kept.binary_search(i).is_err()).collect::<Vec<_>>();
        assert_eq!(without(min_neighbours(&cloud, 3, 0.05).unwrap()), lone, "axis {axis}");
        assert_eq!(without(remove_outliers(&cloud, 6, 6.0).unwrap()), lone, "axis {axis}");
        let lines: Vec<[f64; 3]> =
            (0..40_000_u32).map(|i| [f64::from(i % 4), f64::from(i / 4), 0.0]).collect();
        let kept = min_neighbours(&self::cloud(&lines), 4, 1.0).unwrap();
        assert_eq!(kept.len(), 2 * 9998, "the inner two of four lines, without their ends");
    }
}

#[test]
fn equal_distances_leave_all_points() {
    let lattice: Vec<[f64; 3]> = (0..8).map(|i| [i & 1, i >> 1 & 1, i >> 2].map(f64::from)).collect();
    let shifted: Vec<[f64; 3]> = lattice.iter().map(|p| p.map(|x| 0.1 * x + 0.3)).collect();
    assert_eq!(remove_outliers(&cloud(&lattice), 3, 1e-6).unwrap().len(), 8);
    assert_eq!(remove_outliers(&cloud(&shifted), 7, 1.0).unwrap().len(), 8);
}

/// With a grid at 4,000 km, a voxel size, a radius and a box still resolve millimetres.
#[test]
fn far_from_the_origin_millimetres_count() {
    let at = [4_000_000.0, 4_000_000.0, 100.0];
    let points: Vec<[f64; 3]> = (0..400_u16)
        .map(|i| [f64::from(i % 20), f64::from(i / 20), 0.0])
        .map(|p| [0, 1, 2].map(|k| at[k] + 0.001 * p[k] + 0.000_25))
        .collect();
    let far = cloud(&points);
    assert_eq!(voxel(&far, 0.001).unwrap().len(), 400);
    assert_eq!(voxel(&far, 0.002).unwrap().len(), 100);
    assert_eq!(min_neighbours(&far, 4, 0.001_1).unwrap().len(), 18 * 18);
    let max = [at[0] + 0.009_5, at[1] + 0.004_5, at[2] + 1.0];
    assert_eq!(crop(&far, at, max).unwrap().len(), 50);
}

#[test]
fn ties_in_a_cell_go_to_the_first_point() {
    // The corners of a square in every cell are equally near to its centre, in any order.
    let corners = [[0.75, 0.25], [0.25, 0.25], [0.75, 0.75], [0.25, 0.75]];
    let points: Vec<[f64; 3]> = (0..40_usize)
        .map(|i| [(i / 4) as f64 * 3.0 + corners[(i * 7) % 4][0], corners[(i * 7) % 4][1], 0.5])
        .collect();
    let expected: Vec<u32> = (0..10).map(|i| 4 * i).collect();
    assert_eq!(voxel(&cloud(&points), 3.0).unwrap(), expected);
}

#[test]
fn bad_parameters_are_named() {
    let cloud = cloud(&noisy(10, 100));
    for value in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        for (what, refused) in [
            ("voxel size", voxel(&cloud, value)),
            ("sigma", remove_outliers(&cloud, 6, value)),
            ("radius", min_neighbours(&cloud, 6, value)),
        ] {
            let message = refused.unwrap_err().to_string();
            assert_eq!(message, format!("expected a positive finite {what}, got {value}"));
        }
    }
    assert_eq!(remove_outliers(&cloud, 0, 1.0), Err(FilterError::NoNeighbours));
    assert_eq!(min_neighbours(&cloud, 0, 1.0), Err(FilterError::NoNeighbours));
    let many = |neighbours| Err(FilterError::TooManyNeighbours { neighbours, points: 100 });
    assert_eq!(remove_outliers(&cloud, 100, 1.0), many(100));
    assert_eq!(min_neighbours(&cloud, usize::MAX, 1.0), many(usize::MAX));
    assert!(matches!(voxel(&cloud, 1e-19), Err(FilterError::VoxelTooSmall { .. })));
    let Err(FilterError::VoxelTooSmall { least, .. }) = voxel(&cloud, 1e-300) else { panic!("too small") };
    assert_eq!(voxel(&cloud, least).unwrap().len(), 100, "the size that is recommended serves");
    assert!(matches!(voxel(&cloud, 10.0), Err(FilterError::TooFewLeft { left: 1, points: 100, .. })));
    assert!(matches!(min_neighbours(&cloud, 1, 1e-9), Err(FilterError::TooFewLeft { left: 0, .. })));
    assert!(matches!(crop(&cloud, [2.0; 3], [3.0; 3]), Err(FilterError::TooFewLeft { left: 0, .. })));
    let nan = crop(&cloud, [0.0; 3], [1.0, f64::NAN, 1.0]);
    assert_eq!(nan, Err(FilterError::BoxNotANumber { axis: 1 }));
    let swapped = crop(&cloud, [0.0, 0.0, 1.0], [1.0, 1.0, 0.0]);
    assert_eq!(swapped, Err(FilterError::EmptyBox { axis: 2, min: 1.0, max: 0.0 }));
    assert_eq!(crop(&cloud, [f64::NEG_INFINITY; 3], [f64::INFINITY; 3]).unwrap().len(), 100);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Coordinates with few values produce equal distances, equal coordinates and points on cell
    /// walls.
    #[test]
    fn filters_agree_with_their_twins(
        points in proptest::collection::vec([-4_i8..5, -4_i8..5, -2_i8..3], 60..200),
        step in prop_oneof![Just(0.1), Just(0.25), Just(1.0), Just(1e4)],
        shift in prop_oneof![Just(0.0), Just(0.05), Just(4_000_000.0)],
        k in 1_usize..12,
        sigma in 0.1_f64..4.0,
        share in 0.05_f64..6.0,
    ) {
        let points: Vec<[f64; 3]> = points.iter().map(|p| p.map(|x| f64::from(x) * step + shift)).collect();
        if let Ok(cloud) = PointCloud::cleaned(&points) {
            let all = all_distances(&cloud);
            check_outliers(&cloud, &all, k.min(cloud.len() - 1), sigma);
            check_neighbours(&cloud, &all, k.min(cloud.len() - 1), share * step);
            check_voxel(&cloud, share * step);
            check_crop(&cloud, points[0].map(|x| x - share * step), points[0].map(|x| x + share * step));
        }
    }
}
