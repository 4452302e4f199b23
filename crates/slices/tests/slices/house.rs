//! Floors and obstacles of a generated house, scanned with noise or sampled from its triangles.

use std::ops::RangeInclusive;

use nearmiss_geometry::Aabb;
use nearmiss_slices::{Content, Floor, Obstacle, Pixel, SliceMap, SliceOptions};
use nearmiss_testdata::house::{COLUMN, COLUMNS, STOREY, house, scanned};

use crate::built::{built, of_quads};

fn options(pixel: f64, obstacle: Obstacle) -> SliceOptions {
    SliceOptions::default().with_pixel(Pixel::Side(pixel)).with_obstacle(obstacle)
}

const SLOPE: Obstacle = Obstacle::Slope { degrees: 45.0, noise: None };

/// Contents of the pixels whose middles lie in a rectangle, between two heights, the highest of each column.
fn contents(map: &SliceMap, [x, y, z]: [RangeInclusive<f64>; 3]) -> Vec<Content> {
    let grid = map.grid();
    let mut found = Vec::new();
    for row in 0..grid.counts[1] {
        for column in 0..grid.counts[0] {
            let [px, py] = grid.middle(column, row);
            if x.contains(&px) && y.contains(&py) {
                let slices = grid.range(2, [*z.start(), *z.end()]).unwrap();
                let highest = slices.rev().find_map(|s| map.slice(s).unwrap().pixel(column, row));
                found.extend(highest);
            }
        }
    }
    found
}

fn share(contents: &[Content]) -> f64 {
    let obstacles = contents.iter().filter(|content| content.is_obstacle).count();
    ratio(obstacles, contents.len())
}

fn ratio(part: usize, whole: usize) -> f64 {
    let [part, whole] = [part, whole].map(|n| f64::from(u32::try_from(n).unwrap()));
    part / whole
}

#[test]
fn floors_are_floor_and_walls_are_obstacles() {
    for (noise, spacing) in [(0.0, 0.02), (0.004, 0.02), (0.01, 0.025), (0.02, 0.03)] {
        let map = built(&scanned(&house(), spacing, noise, 7), &options(0.05, SLOPE)).unwrap();
        let [low, upper] = [0.0, STOREY].map(|z| z - 0.1..=z + 0.1);
        // Away from walls, ramps and columns.
        let floors = [
            contents(&map, [1.0..=8.0, 3.5..=9.5, low.clone()]),
            contents(&map, [7.0..=15.5, 6.2..=11.5, upper]),
        ];
        for floor in floors {
            assert!(floor.len() > 10_000, "noise {noise}: {} pixels of floor", floor.len());
            assert!(share(&floor) < 0.02, "noise {noise}: {:.4} of a floor are obstacles", share(&floor));
        }
        let wall = obstacle_columns(&map, 11.9..=12.1, 1.5);
        assert!(wall > 0.99, "noise {noise}: {wall:.4} of a wall is an obstacle");
        let estimated = map.about().noise;
        assert!(
            estimated >= 1.5 * noise && estimated <= 6.0 * noise + 0.001,
            "noise {noise} is taken for {estimated}"
        );
    }
}

/// A floor just below the border of two slices and points just above it are joined to one floor. Its height
/// must be that of a point, not that of the border.
#[test]
fn floors_have_the_heights_of_points_where_slices_join() {
    let step = |i: u16| f64::from(i) * 0.02 + 0.01;
    let heights = [0.28, 0.32];
    let mut points = Vec::new();
    for (i, j) in (0..60).flat_map(|i| (0..60).map(move |j| (i, j))) {
        let [x, y] = [step(i), step(j)];
        points.push([x, y, 0.0]);
        // Both heights in every pixel; only the lower on a part of the table.
        points.extend(heights[..if i < 40 { 2 } else { 1 }].iter().map(|&z| [x, y, z]));
    }
    let map = built(&points, &options(0.05, Obstacle::Share(0.3))).unwrap();
    let grid = map.grid();
    let level = grid.slice_height / 255.0;
    let border = grid.origin[2] + 2.0 * grid.slice_height;
    assert!(heights[0] < border - 10.0 * level && heights[1] > border + 10.0 * level, "a border at {border}");

    let floor = |x: f64, base: f64, rule: Floor| {
        let bounds = Aabb { min: [x, 0.52, base], max: [x + 0.04, 0.56, base + 0.02] };
        map.query(&bounds, rule).unwrap().floor.unwrap()
    };
    for rule in [Floor::Max, Floor::Mean] {
        for (x, base, expected) in [
            (0.52, 0.27, 0.28),
            (0.52, 0.29, 0.28),
            (0.52, 0.33, 0.32),
            (1.0, 0.29, 0.28),
            (1.0, 0.4, 0.28),
            (0.52, 0.1, 0.0),
        ] {
            let found = floor(x, base, rule);
            assert!((found - expected).abs() <= level, "{found} at {x} below {base}, expected {expected}");
        }
    }
    // The floor below every box is the height of a point.
    let mut seen = 0;
    for i in 0..1000_u16 {
        let [x, base] = [f64::from(i % 25) * 0.04 + 0.1, f64::from(i / 25) * 0.01];
        let found = floor(x, base, Floor::Max);
        let off = [0.0, 0.28, 0.32].map(|z: f64| (found - z).abs()).into_iter().fold(f64::INFINITY, f64::min);
        assert!(off <= level, "{found} at {x} below {base} is {off} from every point");
        seen += usize::from(found > 0.1);
    }
    assert!(seen > 200, "{seen} times on the table");
}

/// Returns the share of the map's columns that have an obstacle in these rows, in the slice at a
/// height.
fn obstacle_columns(map: &SliceMap, y: RangeInclusive<f64>, z: f64) -> f64 {
    let grid = map.grid();
    let slice = map.slice(*grid.range(2, [z, z]).unwrap().start()).unwrap();
    let rows = grid.range(1, [*y.start(), *y.end()]).unwrap();
    let is_obstacle = |column: &u32| {
        rows.clone().any(|row| slice.pixel(*column, row).is_some_and(|content| content.is_obstacle))
    };
    ratio((0..grid.counts[0]).filter(is_obstacle).count(), grid.counts[0] as usize)
}

#[test]
fn the_papers_rule_calls_noise_and_gentle_slopes_obstacles() {
    let points = scanned(&house(), 0.02, 0.01, 7);
    let floor = |rule| {
        share(&contents(&built(&points, &options(0.05, rule)).unwrap(), [1.0..=8.0, 3.5..=9.5, -0.1..=0.1]))
    };
    let (paper, ours) = (floor(Obstacle::Share(0.07)), floor(SLOPE));
    assert!(paper > 0.5 && ours < 0.02, "{paper} of a floor by 7 %, {ours} by slope and noise");
}

#[test]
fn no_pixel_of_a_meshs_surface_stays_empty() {
    let quads = house();
    let map = of_quads(&quads, &options(0.07, SLOPE));
    let (mut seen, mut empty) = (0, 0);
    for p in scanned(&quads, 0.01, 0.0, 1) {
        let bounds = Aabb { min: p, max: p };
        seen += 1;
        empty += usize::from(!map.touches(&bounds).unwrap());
    }
    assert!(seen > 5_000_000 / 2, "{seen} places");
    assert_eq!(empty, 0, "places of the surface in empty pixels");
}

/// The pixels of a round column reach beyond it by less than their diagonal.
#[test]
fn columns_are_as_round_as_pixels_allow() {
    let pixel = 0.04;
    let map = built(&scanned(&house(), 0.01, 0.0, 9), &options(pixel, SLOPE)).unwrap();
    let grid = map.grid();
    let slice = map.slice(u32::try_from(5).unwrap()).unwrap();
    for [x, y] in COLUMNS {
        let (mut inside, mut obstacles, mut farthest) = (0, 0, 0.0_f64);
        for row in 0..grid.counts[1] {
            for column in 0..grid.counts[0] {
                let [px, py] = grid.middle(column, row);
                let away = (px - x).hypot(py - y);
                if let Some(content) = slice.pixel(column, row).filter(|_| away < 2.0 * COLUMN) {
                    inside += 1;
                    // Except for pixels that the column only grazes.
                    obstacles += usize::from(content.is_obstacle);
                    farthest = farthest.max((away - COLUMN).abs());
                }
            }
        }
        assert!(inside > 30 && ratio(obstacles, inside) > 0.9, "{obstacles} of {inside} pixels");
        assert!(farthest < 0.5 * pixel * 2.0_f64.sqrt() + 1e-3, "{farthest} off");
    }
}
