//! Passages of the generated house, scanned with different noise, by avatars of different sizes.

use std::ops::RangeInclusive;

use nearmiss_slices::{
    Avatar, AvatarOptions, Back, Ended, Obstacle, Pixel, Response, Route, SliceMap, SliceOptions, Slide,
    Step, WalkError, Walker,
};
use nearmiss_testdata::house::{COLUMN, COLUMNS, DOOR, GAP, LOW, STAIRS, STOREY, house, scanned};

use crate::built::built;

/// Standard deviation of the noise along the normal, and spacing of the points.
const NOISE: [[f64; 2]; 4] = [[0.0, 0.02], [0.003, 0.02], [0.006, 0.02], [0.012, 0.025]];

fn map_of([noise, spacing]: [f64; 2], pixel: f64) -> SliceMap {
    let points = scanned(&house(), spacing, noise, 21);
    built(&points, &SliceOptions::default().with_pixel(Pixel::Side(pixel))).unwrap()
}

/// An avatar of this width and height.
fn avatar(map: &SliceMap, [width, height]: [f64; 2]) -> Avatar {
    let options = AvatarOptions::default().with_box([width; 2], height).with_step(map.grid().pixel);
    Avatar::new(&options).unwrap()
}

/// Walks an avatar of this width and height.
fn walk(map: &SliceMap, body: [f64; 2], way: &[[f64; 3]], response: &dyn Response) -> (Ended, Vec<Step>) {
    let route = Route { start: way[0], points: way[1..].iter().map(|p| [p[0], p[1]]).collect() };
    let mut steps = Vec::new();
    let ended = route.walk(&mut &*map, &avatar(map, body), response, |_, step| {
        steps.push(*step);
        Ok::<(), WalkError>(())
    });
    (ended.unwrap(), steps)
}

/// Returns `true` if the avatar passes straight ahead on the lower floor, without sliding.
fn passes(map: &SliceMap, body: [f64; 2], from: [f64; 2], to: [f64; 2]) -> bool {
    let (ended, steps) = walk(map, body, &[[from[0], from[1], 0.05], [to[0], to[1], 0.0]], &Back);
    assert!(steps.iter().all(|step| !step.falling && step.position[2] < 0.36), "on the lower floor");
    ended == Ended::Arrived
}

#[test]
fn doors_are_passed_by_whoever_is_narrower() {
    for noise in NOISE {
        for pixel in [0.03, 0.05] {
            let map = map_of(noise, pixel);
            for [low, high] in [[DOOR[0], DOOR[1]], GAP] {
                let middle = 0.5 * (low + high);
                let passing = |width: f64| passes(&map, [width, 1.6], [7.6, middle], [10.4, middle]);
                // The pixels that a side of the door covers in part, and their noise.
                let lost = 2.0 * (pixel + 3.0 * noise[0]);
                let told = format!("noise {noise:?}, pixels of {pixel}, {:.1} wide", high - low);
                for width in [0.3, 0.6, 0.9].map(|share| share * (high - low - lost)) {
                    assert!(passing(width), "{told}: {width} does not pass");
                }
                for width in [1.02, 1.3, 2.0].map(|share| share * (high - low)) {
                    assert!(!passing(width), "{told}: {width} passes");
                }
            }
            // As high as the lintel permits.
            let middle = 0.5 * (DOOR[0] + DOOR[1]);
            let passing = |height| passes(&map, [0.4, height], [7.6, middle], [10.4, middle]);
            let fits = DOOR[2] - pixel - 6.0 * noise[0] - 0.02;
            assert!(passing(fits), "noise {noise:?}, pixels of {pixel}: {fits} does not fit");
            assert!(!passing(DOOR[2] + 0.05), "noise {noise:?}, pixels of {pixel}: higher than the lintel");
        }
    }
}

#[test]
fn low_ceilings_stop_whoever_is_higher() {
    let ([x, _], [y, _], ceiling) = LOW;
    for noise in NOISE {
        let map = map_of(noise, 0.05);
        let passing = |height| passes(&map, [0.4, height], [x - 0.6, y + 1.0], [x + 1.0, y + 1.0]);
        let fits = ceiling - 6.0 * noise[0] - 0.03;
        assert!(passing(fits), "noise {noise:?}: {fits} does not fit");
        assert!(!passing(ceiling + 0.02), "noise {noise:?}: higher than the ceiling");
    }
}

#[test]
fn columns_are_gone_round_by_sliding() {
    for noise in NOISE {
        for pixel in [0.03, 0.05] {
            let map = map_of(noise, pixel);
            for [x, y] in COLUMNS {
                // From four sides, leaving the column on the right or on the left.
                for way in 0..8_u8 {
                    let (s, c) = (f64::from(way / 2) * 90.0).to_radians().sin_cos();
                    let hand = if way % 2 == 0 { 1.0 } else { -1.0 };
                    let at = |ahead: f64, aside: f64| {
                        [x + ahead * c - hand * aside * s, y + ahead * s + hand * aside * c, 0.05]
                    };
                    let told = format!("noise {noise:?}, pixels of {pixel}, column at {x}, way {way}");
                    let (ended, steps) = walk(&map, [0.3, 1.6], &[at(-0.72, 0.02), at(0.72, 0.0)], &Back);
                    assert_eq!(ended, Ended::Stuck { point: 0 }, "{told}");
                    let stop = steps.last().unwrap().position;
                    // The distance from the box: at most what a step and the diagonal of a pixel
                    // add.
                    let away = [stop[0] - x, stop[1] - y].map(|d| (d.abs() - 0.15).max(0.0));
                    let gap = away[0].hypot(away[1]) - COLUMN;
                    let most = 2.5 * pixel + 4.0 * noise[0];
                    assert!((-0.01..most).contains(&gap), "{told}: {gap} before the column");
                    // Past the side of the column, after a straight approach.
                    let round = [at(-0.72, 0.02), at(0.3, 0.56), at(0.72, 0.0)];
                    let (ended, _) = walk(&map, [0.3, 1.6], &round, &Back);
                    assert_eq!(ended, Ended::Stuck { point: 0 }, "{told}");
                    let (ended, steps) = walk(&map, [0.3, 1.6], &round, &Slide);
                    let blocked = steps.iter().filter(|step| step.blocked).count();
                    let last = steps.last().unwrap().position;
                    assert_eq!(ended, Ended::Arrived, "{told}: at {last:?}");
                    assert!((1..60).contains(&blocked), "{told}: {blocked} times in the way");
                }
            }
        }
    }
}

#[test]
fn noise_stops_nobody_on_the_stairs_nor_at_the_edge() {
    for noise in NOISE {
        for pixel in [0.03, 0.05] {
            let map = map_of(noise, pixel);
            let told = format!("noise {noise:?}, pixels of {pixel}");
            let y = 0.5 * (STAIRS[0] + STAIRS[1]);
            // Up, to the open edge, and over it.
            let way = [[1.2, y, 0.1], [8.0, y, 0.0], [8.0, 7.0, 0.0], [8.0, 5.0, 0.0]];
            let (ended, steps) = walk(&map, [0.4, 1.6], &way, &Back);
            assert_eq!(ended, Ended::Arrived, "{told}: at {:?}", steps.last().unwrap().position);
            let highest = steps.iter().map(|step| step.position[2]).fold(0.0, f64::max);
            assert!((highest - STOREY).abs() < 0.01 + 5.0 * noise[0], "{told}: up to {highest}");
            let [x, y, z] = steps.last().unwrap().position;
            assert!(x == 8.0 && y == 5.0 && z.abs() < 0.01 + 5.0 * noise[0], "{told}: at {x}, {y}, {z}");
            assert!(steps.iter().all(|step| !step.blocked), "{told}: something was in the way");
            let falls = steps.iter().filter(|step| step.falling).count();
            assert!((8..=11).contains(&falls), "{told}: {falls} steps of falling");
        }
    }
}

#[test]
fn high_slices_let_pass_under_a_ceiling_that_low_ones_do() {
    // A floor a little below the wall between the slices, a ceiling in the upper one.
    let patch = |x: RangeInclusive<u32>, height: f64| {
        let across = |i: u32| 0.05 * f64::from(i);
        x.flat_map(move |i| (0..=60).map(move |j| [across(i), across(j), height]))
    };
    let (mut free, mut stopped) = (0, 0);
    for ceiling in (200..=298).map(|z| 0.01 * f64::from(z)) {
        let corners = [[0.0; 3], [3.0, 3.0, 3.1]];
        let points: Vec<[f64; 3]> =
            patch(0..=60, 1.3).chain(patch(30..=60, ceiling)).chain(corners).collect();
        let options =
            SliceOptions::default().with_pixel(Pixel::Side(0.5)).with_obstacle(Obstacle::Share(0.07));
        let map = built(&points, &options).unwrap();
        for height in [0.8, 1.2, 1.6] {
            let (ended, steps) = walk(&map, [0.4, height], &[[0.6, 1.5, 1.35], [2.4, 1.5, 0.0]], &Back);
            let room = ceiling - 1.3 - height;
            let told = format!("ceiling at {ceiling}, {height} high: {ended:?} at {:?}", steps.last());
            // Heights are exact to a level of 255, those of ceilings to 16 levels.
            let level = 1.5 / 255.0;
            if room > 17.0 * level {
                assert_eq!(ended, Ended::Arrived, "{told}");
                free += 1;
            } else if room < -level {
                assert_eq!(ended, Ended::Stuck { point: 0 }, "{told}");
                stopped += 1;
            }
            if ended == Ended::Arrived {
                let end = [2.4, 1.5, steps.last().unwrap().position[2]];
                let stands = Walker::new(avatar(&map, [0.4, height]), &map, end);
                assert!(stands.is_ok(), "{told}: no start where a walk comes to");
            }
        }
    }
    assert!(free > 80 && stopped > 80, "{free} free, {stopped} stopped");
}
