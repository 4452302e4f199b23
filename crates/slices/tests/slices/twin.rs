//! Equal to the twin, voxel by voxel and box by box.

use nearmiss_geometry::Aabb;
use nearmiss_slices::{Floor, Obstacle, Pixel, SliceMap, SliceOptions, Up};
use nearmiss_testdata::arbitrary::{CloudKind, cloud, rng};
use nearmiss_testdata::house::{house, scanned};
use nearmiss_testdata::oracle::SliceTwin;
use rand::{Rng, RngExt};

use crate::built::{built, dragon};

/// The twin of a map, of the same points.
pub(crate) fn twin(map: &SliceMap, points: &[[f64; 3]]) -> SliceTwin {
    let grid = map.grid();
    let turned: Vec<[f64; 3]> = points.iter().map(|p| grid.up.to_map(*p)).collect();
    SliceTwin::new(&turned, grid.origin, [grid.pixel, grid.slice_height], map.about().share)
}

/// Compares all voxels; returns the number of voxels and of obstacles.
fn compare(map: &SliceMap, points: &[[f64; 3]], what: &str) -> [u64; 2] {
    let twin = twin(map, points);
    let mut counts = [0; 2];
    for (at, expected) in twin.voxels() {
        let [column, row, slice] = at.map(|i| u32::try_from(i).unwrap());
        let found = map.slice(slice).unwrap().pixel(column, row);
        let found = found.unwrap_or_else(|| panic!("{what}: {at:?} is empty"));
        let told = (i64::from(found.top), i64::from(found.bottom), found.is_obstacle);
        assert_eq!(told, (expected.top, expected.low / 16 * 16, expected.is_obstacle), "{what}: {at:?}");
        counts[0] += 1;
        counts[1] += u64::from(expected.is_obstacle);
    }
    let mut all = [0; 2];
    for slice in map.slices().iter().flatten() {
        let more = slice.counts();
        all = [all[0] + more[0], all[1] + more[1]];
    }
    assert_eq!(all, counts, "{what}: nothing but what the twin has");
    counts
}

fn options(pixels: u32, obstacle: Obstacle, up: Up) -> SliceOptions {
    SliceOptions::default().with_pixel(Pixel::Count(pixels)).with_obstacle(obstacle).with_up(up)
}

const RULES: [Obstacle; 4] = [
    Obstacle::Share(0.07),
    Obstacle::Slope { degrees: 45.0, noise: None },
    Obstacle::Slope { degrees: 30.0, noise: Some(0.0) },
    Obstacle::Share(0.6),
];

#[test]
fn every_voxel_of_every_kind_of_cloud() {
    let (mut compared, mut obstacles) = (0, 0);
    for kind in CloudKind::ALL {
        let points = cloud(kind, 3000, 5);
        for (rule, up) in RULES.into_iter().zip([Up::Z, Up::Y, Up::NegX, Up::NegZ]) {
            // A cloud within rounding of a point has no extent to divide.
            let Ok(map) = built(&points, &options(24, rule, up)) else { continue };
            let counts = compare(&map, &points, &format!("{kind:?}, {rule:?}, {up}"));
            compared += 1;
            obstacles += counts[1];
        }
    }
    assert!(compared >= 52 && obstacles > 10_000, "{compared} maps, {obstacles} obstacles");
}

#[test]
fn every_voxel_of_a_real_scan_and_of_a_house() {
    let points = dragon();
    let counts = compare(&built(&points, &options(150, RULES[1], Up::Y)).unwrap(), &points, "dragon");
    assert!(counts[0] > 8000 && counts[1] > 1000, "{counts:?}");
    let points = scanned(&house(), 0.04, 0.004, 3);
    let counts = compare(&built(&points, &options(160, RULES[1], Up::Z)).unwrap(), &points, "house");
    assert!(counts[0] > 40_000 && counts[1] > 10_000, "{counts:?}");
}

/// Points that lie on the walls of voxels, and floors that straddle slices.
#[test]
fn every_voxel_where_points_lie_on_walls() {
    let rng = &mut rng(3);
    let mut points = vec![[0.0; 3], [8.0, 8.0, 8.0]];
    for _ in 0..20_000 {
        let at = [0, 1, 2].map(|_| f64::from(rng.random_range(0..16_u8)) * 0.5);
        // A level is 1.5/255: up to three above a wall or below.
        let off = f64::from(rng.random_range(-3..=3_i8)) * 1.5 / 255.0;
        points.push([at[0], at[1], (at[2] + off).clamp(0.0, 8.0)]);
    }
    for rule in RULES {
        let options = SliceOptions::default().with_pixel(Pixel::Side(0.5)).with_obstacle(rule);
        compare(&built(&points, &options).unwrap(), &points, &format!("{rule:?}"));
    }
}

#[test]
fn boxes_are_answered_as_by_the_twin() {
    let points = scanned(&house(), 0.1, 0.005, 4);
    let rng = &mut rng(8);
    for up in [Up::Z, Up::NegY, Up::X] {
        let turned: Vec<[f64; 3]> = points.iter().map(|p| up.from_map(*p)).collect();
        let map = built(&turned, &options(80, RULES[1], up)).unwrap();
        let twin = twin(&map, &turned);
        let counts = [0, 1].map(|k| i64::from(map.grid().counts[k]));
        let boxes: Vec<Aabb> = (0..120).map(|_| arbitrary_box(rng, &map)).collect();
        for floor in [Floor::Max, Floor::Mean] {
            let mut answers = vec![Ok(nearmiss_slices::Occupancy::default()); boxes.len()];
            map.query_each(&boxes, floor, &mut answers);
            let mut kinds = [0; 3];
            for (bounds, answer) in boxes.iter().zip(answers) {
                let answer = answer.unwrap();
                assert_eq!(answer, map.query(bounds, floor).unwrap(), "in a batch and alone");
                let turned = Aabb::of([bounds.min, bounds.max].map(|p| up.to_map(p)));
                let (pixels, obstacle, floors) = twin.query(turned.min, turned.max, counts);
                assert_eq!(answer.pixels, pixels as u64, "{bounds:?}");
                assert_eq!((answer.collides, answer.obstacle), (pixels > 0, obstacle), "{bounds:?}");
                assert_eq!(map.touches(bounds).unwrap(), pixels > 0, "{bounds:?}");
                let expected = match floor {
                    Floor::Max => floors.iter().copied().reduce(f64::max),
                    Floor::Mean => mean(&floors),
                };
                let expected = expected.map(|height| up.coordinate(height));
                let is_equal = match (answer.floor, expected) {
                    (Some(a), Some(b)) => (a - b).abs() < 1e-9,
                    (a, b) => a == b,
                };
                assert!(is_equal, "{bounds:?}: {:?}, the twin {expected:?}", answer.floor);
                kinds[0] += usize::from(pixels > 0);
                kinds[1] += usize::from(obstacle);
                kinds[2] += usize::from(answer.floor.is_some());
            }
            assert!(kinds.iter().all(|n| (20..110).contains(n)), "{kinds:?} of each kind");
        }
    }
}

fn mean(values: &[f64]) -> Option<f64> {
    let count = f64::from(u32::try_from(values.len()).unwrap());
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / count)
}

/// Returns a random box: mostly within the house, some on lines of the lattice, some beyond.
fn arbitrary_box(rng: &mut impl Rng, map: &SliceMap) -> Aabb {
    let grid = map.grid();
    let mut corner = [0, 1, 2].map(|k| rng.random_range([-1.0, -1.0, -1.0][k]..[17.0, 13.0, 6.5][k]));
    // Some with more rows and columns than are searched together.
    let most = if rng.random_range(0..6_u8) == 0 { 16.0 } else { 1.2 };
    let size = [most, most, 1.2].map(|most: f64| rng.random_range(0.0..most));
    if rng.random_range(0..3_u8) == 0 {
        for k in 0..2 {
            corner[k] = grid.origin[k] + ((corner[k] - grid.origin[k]) / grid.pixel).round() * grid.pixel;
        }
    }
    Aabb::of([corner, [0, 1, 2].map(|k| corner[k] + size[k])].map(|p| grid.up.from_map(p)))
}

#[test]
fn pieces_order_and_threads_change_nothing() {
    let points = scanned(&house(), 0.08, 0.004, 5);
    let options = options(200, RULES[1], Up::Z);
    let whole = built(&points, &options).unwrap();
    let bounds = Aabb::of(points.iter().copied());
    let plan = nearmiss_slices::SlicePlan::new(&options, &bounds).unwrap();
    for (threads, piece) in [(1, 1000), (2, 777), (3, 100_000)] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let map = pool.install(|| {
            let mut builder = nearmiss_slices::SliceBuilder::new(&plan).unwrap();
            let backwards: Vec<[f64; 3]> = points.iter().rev().copied().collect();
            backwards.chunks(piece).for_each(|piece| builder.add(piece));
            assert_eq!(builder.counts(), [points.len() as u64, 0]);
            builder.finish()
        });
        assert_eq!(map, whole, "{threads} threads, pieces of {piece}");
    }
}
