//! Collision of two maps, posed about the axis that points up.

use nearmiss_geometry::Pose;
use nearmiss_slices::{Floor, ObjectError, Occupancy, Pixel, SliceMap, SliceOptions, Up};
use nearmiss_testdata::arbitrary::rng;
use nearmiss_testdata::house::{STOREY, house, scanned};
use rand::RngExt;

use crate::built::built;

fn house_map() -> SliceMap {
    let options = SliceOptions::default().with_pixel(Pixel::Side(0.08));
    built(&scanned(&house(), 0.04, 0.0, 1), &options).unwrap()
}

/// A crate half a metre wide, with its base at 0; only corners and some points on its sides.
fn crate_points() -> Vec<[f64; 3]> {
    let rng = &mut rng(4);
    let mut points = vec![[-0.25, -0.25, 0.0], [0.25, 0.25, 0.5]];
    for _ in 0..400 {
        let mut p = [0, 1].map(|_| rng.random_range(-0.25..0.25));
        let side = rng.random_range(0..2_usize);
        p[side] = 0.25_f64.copysign(p[side]);
        points.push([p[0], p[1], rng.random_range(0.0..0.5)]);
    }
    points
}

/// Compares every pixel of the object with every pixel of the building: separating axes of two
/// squares, one of them rotated.
fn by_the_formulas(building: &SliceMap, object: &SliceMap, pose: &Pose) -> [u64; 2] {
    let (grid, own) = (building.grid(), object.grid());
    let place = |[x, y]: [f64; 2], z: f64| grid.up.to_map(pose.apply(own.up.from_map([x, y, z])));
    let mut counts = [0; 2];
    for slice in 0..own.counts[2] {
        for row in 0..own.counts[1] {
            for column in 0..own.counts[0] {
                if object.slice(slice).unwrap().pixel(column, row).is_none() {
                    continue;
                }
                let [x, y] = own.middle(column, row);
                let half = 0.5 * own.pixel;
                let bottom = own.origin[2] + f64::from(slice) * own.slice_height;
                let corners = [[-half, -half], [half, -half], [half, half], [-half, half]]
                    .map(|[dx, dy]| place([x + dx, y + dy], bottom));
                let low = corners[0][2];
                let high = place([x, y], bottom + own.slice_height)[2];
                let met = met(building, &corners.map(|c| [c[0], c[1]]), [low, high]);
                counts[0] += u64::from(met.is_some());
                counts[1] += u64::from(met == Some(true));
            }
        }
    }
    counts
}

fn met(building: &SliceMap, corners: &[[f64; 2]; 4], heights: [f64; 2]) -> Option<bool> {
    let grid = building.grid();
    let least = |k: usize| corners.iter().map(|c| c[k]).fold(f64::INFINITY, f64::min);
    let most = |k: usize| corners.iter().map(|c| c[k]).fold(f64::NEG_INFINITY, f64::max);
    let (columns, rows) = (grid.range(0, [least(0), most(0)])?, grid.range(1, [least(1), most(1)])?);
    let slices = grid.range(2, heights)?;
    let mut found = None;
    for row in rows {
        for column in columns.clone() {
            let [x, y] = grid.middle(column, row);
            let half = 0.5 * grid.pixel;
            let pixel =
                [[x - half, y - half], [x + half, y - half], [x + half, y + half], [x - half, y + half]];
            let side = |i: usize| [0, 1].map(|k| corners[i + 1][k] - corners[i][k]);
            let is_apart = [side(0), side(1)].iter().any(|axis| {
                let along = |points: &[[f64; 2]; 4]| {
                    let values = points.map(|p| p[0] * axis[0] + p[1] * axis[1]);
                    [
                        values.iter().copied().fold(f64::INFINITY, f64::min),
                        values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
                    ]
                };
                let (a, b) = (along(corners), along(&pixel));
                a[1] < b[0] || b[1] < a[0]
            });
            if !is_apart {
                for content in slices.clone().filter_map(|s| building.slice(s).unwrap().pixel(column, row)) {
                    found = Some(found == Some(true) || content.is_obstacle);
                }
            }
        }
    }
    found
}

#[test]
fn objects_meet_what_their_turned_pixels_meet() {
    let building = house_map();
    let object = built(&crate_points(), &SliceOptions::default().with_pixel(Pixel::Side(0.06))).unwrap();
    let rng = &mut rng(6);
    let mut kinds = [0; 3];
    for _ in 0..120 {
        let place = [rng.random_range(0.3..15.7), rng.random_range(0.3..11.7), rng.random_range(0.1..3.4)];
        let pose = Pose::from_axis_angle([0.0, 0.0, 1.0], rng.random_range(0.0..7.0)).with_translation(place);
        let found = building.meets(&object, &pose, Floor::Max).unwrap();
        let [pixels, obstacles] = by_the_formulas(&building, &object, &pose);
        assert_eq!(found.pixels, pixels, "at {place:?}");
        assert_eq!((found.collides, found.obstacle), (pixels > 0, obstacles > 0), "at {place:?}");
        kinds[0] += usize::from(found.collides);
        kinds[1] += usize::from(found.obstacle);
        let expected =
            if place[2] > STOREY + 0.3 && place[0] > 7.0 && place[1] > 6.5 { STOREY } else { continue };
        assert!((found.floor.unwrap() - expected).abs() < 0.01, "{:?} below {place:?}", found.floor);
        kinds[2] += 1;
    }
    assert!(kinds[0] > 15 && kinds[0] < 100 && kinds[1] > 5 && kinds[2] >= 2, "{kinds:?} of each kind");
}

#[test]
fn axes_may_differ_but_not_tilt() {
    let building = house_map();
    let upright = built(&crate_points(), &SliceOptions::default().with_pixel(Pixel::Side(0.06))).unwrap();
    let lying: Vec<[f64; 3]> = crate_points().iter().map(|p| Up::Y.from_map(*p)).collect();
    let lying = built(&lying, &SliceOptions::default().with_pixel(Pixel::Side(0.06)).with_up(Up::Y)).unwrap();
    // In the lying crate y points up. The pose rotates it about x to make it stand, then about z to
    // align it.
    let place = [9.0, 6.2, 0.05];
    let stand = Pose::from_quaternion([0.5, 0.5, 0.5, 0.5]).with_translation(place);
    let expected = building.meets(&upright, &Pose::from_translation(place), Floor::Mean).unwrap();
    let found = building.meets(&lying, &stand, Floor::Mean).unwrap();
    assert!(expected.obstacle, "in the wall");
    assert_eq!(Occupancy { floor: None, ..found }, Occupancy { floor: None, ..expected });
    assert!((found.floor.unwrap() - expected.floor.unwrap()).abs() < 1e-9, "{found:?}");
    let tilted = building.meets(&lying, &Pose::from_translation(place), Floor::Max).unwrap_err();
    assert!(matches!(tilted, ObjectError::Tilted { degrees } if (degrees - 90.0).abs() < 1e-6), "{tilted}");
}
