//! Walks through the generated house.

use nearmiss_geometry::Aabb;
use nearmiss_slices::{
    Avatar, AvatarOptions, Back, Ended, Pixel, Response, Route, SliceMap, SliceOptions, Slide, Step, Up,
    WalkError, Walker, step_each,
};
use nearmiss_testdata::arbitrary::rng;
use nearmiss_testdata::house::{DOOR, LOW, STAIRS, STOREY, house, scanned};
use rand::RngExt;

use crate::built::built;

const PIXEL: f64 = 0.05;

fn scan() -> Vec<[f64; 3]> {
    scanned(&house(), 0.025, 0.003, 11)
}

fn map_of(points: &[[f64; 3]], up: Up) -> SliceMap {
    built(points, &SliceOptions::default().with_pixel(Pixel::Side(PIXEL)).with_up(up)).unwrap()
}

fn avatar() -> Avatar {
    Avatar::new(&AvatarOptions::default()).unwrap()
}

fn walk(map: &SliceMap, start: [f64; 3], points: &[[f64; 2]], response: &dyn Response) -> (Ended, Vec<Step>) {
    let mut steps = Vec::new();
    let route = Route { start, points: points.to_vec() };
    let ended = route.walk(&mut &*map, &avatar(), response, |_, step| {
        steps.push(*step);
        Ok(())
    });
    (ended.unwrap(), steps)
}

fn end(steps: &[Step]) -> [f64; 3] {
    steps.last().unwrap().position
}

/// The middle of the stairs, their foot and their head.
const Y: f64 = 0.5 * (STAIRS[0] + STAIRS[1]);
const UP_AND_DOWN: [[f64; 2]; 4] = [[1.2, Y], [8.0, Y], [8.0, 9.5], [14.0, 9.0]];

#[test]
fn stairs_lead_up_and_down_again() {
    let points = scan();
    let map = map_of(&points, Up::Z);
    let back: Vec<[f64; 2]> = UP_AND_DOWN.iter().rev().skip(1).copied().collect();
    let (ended, steps) = walk(&map, [1.2, 8.0, 0.2], &[&UP_AND_DOWN[..], &back].concat(), &Back);
    assert_eq!(ended, Ended::Arrived);
    let highest = steps.iter().map(|step| step.position[2]).fold(0.0, f64::max);
    assert!((highest - STOREY).abs() < 0.02, "the upper floor is at {STOREY}, not {highest}");
    let [x, y, z] = end(&steps);
    assert!((x - 1.2).abs() < 1e-9 && (y - Y).abs() < 1e-9 && z.abs() < 0.02, "back at {x}, {y}, {z}");
    assert!(steps.iter().all(|step| !step.blocked && !step.falling), "nothing was in the way");
    // Every step of the stairs was stood on: 16 heights between the floors, going up and going down.
    let stood =
        |i: u8| steps.iter().filter(|s| (s.position[2] - f64::from(i) * STOREY / 17.0).abs() < 0.02).count();
    assert!((1..17).all(|i| stood(i) >= 4), "{:?}", (1..17).map(stood).collect::<Vec<_>>());

    // The avatar is never inside anything: no point of the scan is well within its box above the
    // climb.
    let AvatarOptions { base, height, climb, .. } = *avatar().options();
    let mut near = 0;
    for step in &steps {
        let [x, y, z] = step.position;
        let inside = |p: &&[f64; 3]| {
            (p[0] - x).abs() < 0.5 * base[0]
                && (p[1] - y).abs() < 0.5 * base[1]
                && p[2] > z - 0.1
                && p[2] < z + height
        };
        for p in points.iter().filter(inside) {
            near += 1;
            assert!(p[2] <= z + climb, "{p:?} in the body at {:?}", step.position);
        }
    }
    assert!(near > 10_000, "{near} points under the feet");
}

#[test]
fn any_axis_may_point_up() {
    let points = scan();
    let (_, expected) = walk(&map_of(&points, Up::Z), [1.2, 8.0, 0.2], &UP_AND_DOWN, &Back);
    for up in [Up::X, Up::Y, Up::NegX, Up::NegY, Up::NegZ] {
        let turned: Vec<[f64; 3]> = points.iter().map(|p| up.from_map(*p)).collect();
        let map = map_of(&turned, up);
        // `across` is its own inverse.
        let route: Vec<[f64; 2]> = UP_AND_DOWN.iter().map(|p| up.across(*p)).collect();
        let (ended, steps) = walk(&map, up.from_map([1.2, 8.0, 0.2]), &route, &Back);
        assert_eq!(ended, Ended::Arrived, "{up}");
        assert_eq!(steps.len(), expected.len(), "{up}");
        for (step, expected) in steps.iter().zip(&expected) {
            let place = up.to_map(step.position);
            assert!((0..3).all(|k| (place[k] - expected.position[k]).abs() < 1e-9), "{up}: {place:?}");
        }
    }
}

#[test]
fn walls_gaps_and_low_ceilings_stop() {
    let map = map_of(&scan(), Up::Z);
    let half = 0.5 * avatar().options().base[0];
    // Start, target, and the coordinate that the avatar's front stops at.
    for (from, to, front) in [
        ([7.0, 6.5], [12.0, 6.5], 9.0),
        // The gap is 0.3 wide, the avatar 0.4.
        ([7.0, 8.95], [12.0, 8.95], 9.0),
        // A ceiling at 1.5 over an avatar of 1.6; from beyond the door.
        ([9.6, 8.0], [12.0, 8.0], LOW.0[0]),
        ([14.5, 3.0], [17.5, 3.0], 16.0),
    ] {
        let (ended, steps) = walk(&map, [from[0], from[1], 0.1], &[to], &Back);
        assert_eq!(ended, Ended::Stuck { point: 0 }, "towards {to:?}");
        assert!(steps.last().unwrap().blocked, "towards {to:?}");
        let gap = front - (end(&steps)[0] + half);
        // At most a step short, plus a pixel.
        assert!((-0.02..PIXEL + 0.05 + 0.02).contains(&gap), "towards {to:?}: {gap} before {front}");
    }
}

#[test]
fn doors_wider_than_the_avatar_let_it_through() {
    let map = map_of(&scan(), Up::Z);
    let middle = 0.5 * (DOOR[0] + DOOR[1]);
    let (ended, steps) = walk(&map, [7.0, middle, 0.1], &[[10.5, middle]], &Back);
    assert_eq!(ended, Ended::Arrived, "at {:?}", end(&steps));
    // Aslant and beside it, sliding along the wall finds the door.
    let slides = |response: &dyn Response| walk(&map, [7.0, 6.6, 0.1], &[[10.5, 7.6]], response).0;
    assert_eq!(slides(&Back), Ended::Stuck { point: 0 });
    assert_eq!(slides(&Slide), Ended::Arrived);
}

#[test]
fn edges_are_fallen_off_onto_the_floor_below() {
    let map = map_of(&scan(), Up::Z);
    let (ended, steps) = walk(&map, [10.0, 6.5, STOREY + 0.1], &[[10.0, 4.5]], &Back);
    assert_eq!(ended, Ended::Arrived);
    let falls = steps.iter().filter(|step| step.falling).count();
    let climb = avatar().options().climb;
    assert!((8..=11).contains(&falls), "{falls} steps of {climb} down {STOREY}");
    assert!(end(&steps)[2].abs() < 0.02, "on the lower floor: {:?}", end(&steps));
    for pair in steps.windows(2) {
        assert!(pair[1].position[2] > pair[0].position[2] - climb - 1e-9, "no faster than it climbs");
    }
    // Over the edge of the map: nothing below.
    let (ended, steps) = walk(&map, [20.0, 20.0, 1.0], &[[30.0, 30.0]], &Back);
    assert_eq!(ended, Ended::LeftMap { point: 0 });
    assert!(steps.len() < 10 && steps.iter().all(|step| step.falling), "{} steps", steps.len());
}

/// A barrier across, of this thickness and height.
fn barrier(x: f64, thick: f64, height: f64, depth: f64) -> Vec<[f64; 3]> {
    let heights = (0..).map(|i| 0.02 * f64::from(i)).take_while(|z| *z <= height);
    heights.flat_map(|z| level([x, 0.0], [x + thick, depth], z)).collect()
}

#[test]
fn nothing_is_stepped_over_however_long_steps_are() {
    let floor = level([0.0, 0.0], [8.0, 2.0], 0.0);
    for thick in [0.0, 0.1] {
        let map = map_of(&[&floor[..], &barrier(4.0, thick, 2.4, 2.0)].concat(), Up::Z);
        for step in [0.05, 0.2, 0.4, 0.41, 0.7, 1.0, 2.5, 5.0, 1e300] {
            for base in [[0.4, 0.4], [0.1, 0.6], [0.6, 0.1], [0.02, 0.02]] {
                for [from, to] in [[1.0, 7.0], [7.0, 1.0], [1.0, 4.1]] {
                    let options = AvatarOptions::default().with_box(base, 1.6).with_step(step);
                    let route = Route { start: [from, 0.8, 0.0], points: vec![[to, 1.1]] };
                    let mut steps = Vec::new();
                    let ended = route.walk(&mut &map, &Avatar::new(&options).unwrap(), &Back, |_, step| {
                        steps.push(*step);
                        Ok(())
                    });
                    let told = format!("steps of {step}, base {base:?}, from {from} to {to}: {ended:?}");
                    assert_eq!(ended, Ok(Ended::Stuck { point: 0 }), "{told}");
                    let x = end(&steps)[0];
                    // Before the wall, not farther from it than a step and a pixel.
                    let gap = if from < to { 4.0 - x } else { x - 4.0 - thick } - 0.5 * base[0];
                    let stride = step.min(base[0]).min(base[1]);
                    assert!((-0.001..stride + PIXEL + 0.001).contains(&gap), "{told}: {gap} before the wall");
                }
            }
        }
    }
    // An avatar cannot cross a pit as wide as itself plus a step without falling.
    let pit = [level([0.0, 0.0], [4.0, 2.0], 1.0), level([4.9, 0.0], [8.0, 2.0], 1.0)].concat();
    let map = map_of(&[&pit[..], &level([0.0, 0.0], [8.0, 2.0], 0.0)].concat(), Up::Z);
    for step in [0.05, 0.3, 5.0] {
        let options = AvatarOptions::default().with_step(step);
        let route = Route { start: [1.0, 1.0, 1.0], points: vec![[7.0, 1.0]] };
        let ended = route.walk(&mut &map, &Avatar::new(&options).unwrap(), &Back, |_, _| Ok(()));
        assert_eq!(ended, Ok(Ended::Stuck { point: 0 }), "steps of {step}");
    }
}

/// A level patch of points.
fn level(from: [f64; 2], to: [f64; 2], height: f64) -> Vec<[f64; 3]> {
    let steps =
        |from: f64, to: f64| (0..).map(move |i| from + 0.01 * f64::from(i)).take_while(move |x| *x <= to);
    let row = |y: f64| steps(from[0], to[0]).map(move |x| [x, y, height]);
    steps(from[1], to[1]).flat_map(row).collect()
}

#[test]
fn no_height_is_fallen_from_at_once() {
    let mut points = level([0.0, 0.0], [2.0, 2.0], 0.0);
    points.push([0.0, 0.0, 2.0]);
    let map = map_of(&points, Up::Z);
    for i in 0..4000_u32 {
        // A start within a climb of a floor stands on it; from any other start the feet come down
        // by at most a climb.
        let start = 0.36 + 0.0005 * f64::from(i);
        let (ended, steps) = walk(&map, [1.0, 1.0, start], &[[1.0, 1.0]], &Back);
        assert_eq!(ended, Ended::Arrived, "from {start}");
        let mut feet = start;
        for step in &steps {
            assert!(feet - step.position[2] <= 0.35 + 1e-9, "from {start}: {feet} to {:?}", step.position);
            feet = step.position[2];
        }
        assert!(feet.abs() < 0.001 && steps[0].falling, "from {start}: {steps:?}");
    }
}

#[test]
fn what_is_climbed_can_be_left_again() {
    // A floor, a lower one beyond its edge, and there a block whose top is a climb above the first, two above
    // the second.
    let mut stopped = 0;
    for block in 0..20_u32 {
        let x = 1.26 + 0.01 * f64::from(block);
        let mut points = level([0.0, 0.0], [0.99, 2.0], 0.0);
        points.extend(level([1.0, 0.0], [3.0, 2.0], -0.3));
        for i in 0..59_u32 {
            points.extend(level([x, 0.0], [x + 0.02, 2.0], -0.3 + 0.01 * f64::from(i)));
        }
        points.push([0.0, 0.0, 2.0]);
        let map = built(&points, &SliceOptions::default().with_pixel(Pixel::Side(0.04))).unwrap();
        let (ended, steps) = walk(&map, [0.4, 1.0, 0.0], &[[2.6, 1.0]], &Back);
        // Beyond the block there is no way back up; wherever else it comes to, it gets away from.
        if ended == Ended::Arrived {
            continue;
        }
        stopped += 1;
        let reached = end(&steps);
        let (ended, _) = walk(&map, [0.4, 1.0, 0.0], &[[reached[0], 1.0], [0.5, 1.0]], &Back);
        assert_eq!(ended, Ended::Arrived, "block at {x}: {reached:?}");
    }
    assert!(stopped > 3, "{stopped}");
}

#[test]
fn nothing_is_climbed_that_is_too_high_for_the_floor_below_it() {
    // A floor, a lower one beyond its edge, and there a block whose top is within a climb of the first, not
    // of the second.
    let mut points = level([0.0, 0.0], [0.99, 2.0], 0.0);
    points.extend(level([1.0, 0.0], [3.0, 2.0], -0.3));
    for i in 0..59_u32 {
        points.extend(level([1.41, 0.0], [1.43, 2.0], -0.3 + 0.01 * f64::from(i)));
    }
    points.push([0.0, 0.0, 2.0]);
    let map = built(&points, &SliceOptions::default().with_pixel(Pixel::Side(0.04))).unwrap();
    let (ended, steps) = walk(&map, [0.4, 1.0, 0.0], &[[2.6, 1.0]], &Back);
    // Before the block, which reaches back to where the first floor is not under its base any more.
    assert_eq!(ended, Ended::Stuck { point: 0 });
    let highest = steps.iter().map(|step| step.position[2]).fold(f64::NEG_INFINITY, f64::max);
    assert!(highest < 0.01, "never on the block, whose top is at 0.28: {highest}");
    assert!((end(&steps)[2] + 0.3).abs() < 0.01 || end(&steps)[2].abs() < 0.01, "{:?}", end(&steps));
}

#[test]
fn lengths_of_any_size_neither_overflow_nor_hang() {
    let points = level([0.0, 0.0], [2.0, 2.0], 0.0);
    let map = map_of(&[&points[..], &[[0.0, 0.0, 2.0]]].concat(), Up::Z);
    let walked = |options: &AvatarOptions, start: [f64; 3]| {
        let route = Route { start, points: vec![[1.5, 1.0]] };
        let mut steps = Vec::new();
        let ended = route.walk(&mut &map, &Avatar::new(options).unwrap(), &Back, |_, step| {
            steps.push(*step);
            Ok(())
        });
        ended.map(|ended| (ended, steps))
    };
    let default = AvatarOptions::default();
    let mut walks = 0;
    for start in [0.1, 1e18, 1e300, f64::MAX, -1e300, f64::MIN] {
        for climb in [1e18, 1e300, 1e308, 1.7e308] {
            let giant = default.with_box([0.4; 2], f64::MAX).with_climb(climb);
            match walked(&giant, [0.5, 1.0, start]) {
                Ok((ended, steps)) => {
                    assert!(steps.len() < 50, "{climb} from {start}: {ended:?}, {} steps", steps.len());
                    walks += 1;
                }
                Err(refused) => assert!(matches!(refused, WalkError::Blocked { .. }), "{refused}"),
            }
        }
    }
    assert!(walks >= 12, "{walks}");
    let wide = default.with_box([f64::MAX, 1e300], 1.6).with_step(f64::MAX);
    let (ended, steps) = walked(&wide, [0.5, 1.0, 0.1]).unwrap();
    assert_eq!((ended, steps.len()), (Ended::Arrived, 1));
    // Far along the axis that points up is not far to walk.
    let turned: Vec<[f64; 3]> = points.iter().map(|p| Up::Y.from_map([p[0], p[1], p[2] + 1e9])).collect();
    let high = map_of(&[&turned[..], &[Up::Y.from_map([0.0, 0.0, 1e9 + 2.0])]].concat(), Up::Y);
    let fine = Avatar::new(&default.with_step(0.01).with_box([0.2; 2], 1.6)).unwrap();
    let route = Route { start: Up::Y.from_map([0.5, 1.0, 1e9 + 0.1]), points: vec![[1.0, 0.6]] };
    assert_eq!(route.walk(&mut &high, &fine, &Back, |_, _| Ok(())).unwrap(), Ended::Arrived);
    for (options, what) in [
        (default.with_step(1e-300), "a step of"),
        (default.with_step(1e-12), "a step of"),
        (default.with_climb(1e-12), "a climb of"),
    ] {
        let refused = walked(&options, [0.5, 1.0, 0.1]).unwrap_err().to_string();
        assert!(refused.contains(what) && refused.contains("2^32"), "{refused}");
    }
}

#[test]
fn falls_from_the_sky_and_creeping_along_walls_end() {
    let map = map_of(&scan(), Up::Z);
    let (_, steps) = walk(&map, [1.2, 8.0, 1e9], &[[1.2, 8.0]], &Back);
    assert!(steps.len() < 100 && end(&steps)[2] < 4.0, "{} steps", steps.len());
    let (_, steps) = walk(&map, [-1e6, 8.0, 1e9], &[[-1e6, 8.0]], &Back);
    assert!(steps.len() < 100, "{} steps", steps.len());
    let points = [
        level([0.0, 0.0], [4.0, 4.0], 0.0),
        (0..50_u32).flat_map(|i| level([2.0, 0.0], [2.02, 4.0], 0.02 * f64::from(i))).collect(),
    ]
    .concat();
    let (ended, steps) = walk(&map_of(&points, Up::Z), [1.0, 0.5, 0.0], &[[3.0, 2.0]], &Slide);
    assert!(matches!(ended, Ended::Stuck { .. }) && steps.len() < 400, "{ended:?} after {}", steps.len());
    assert!((end(&steps)[1] - 2.0).abs() < 0.05, "{:?}", end(&steps));
}

#[test]
fn walks_end_as_they_are_told_to() {
    let map = map_of(&scan(), Up::Z);
    let walked = |start, points: &[[f64; 2]]| {
        let route = Route { start, points: points.to_vec() };
        let mut building = &map;
        let walker = route.stand(&mut building, &avatar())?;
        let mut steps = 0;
        let ended = route.follow(&mut building, walker, &Back, |_, _| {
            steps += 1;
            Ok::<(), WalkError>(())
        })?;
        Ok::<_, WalkError>((ended, steps, walker.position(map.grid())))
    };
    let off = Ended::LeftMap { point: 0 };
    // Starts where a fall is less than the resolution of heights; and a route without points.
    for start in [[2.0, 6.0, -1e300], [2.0, 6.0, -1e18], [2.0, 6.0, -5.0], [1e300, 1e300, -1e300]] {
        assert_eq!(walked(start, &[[start[0], start[1]]]).unwrap().0, off, "from {start:?}");
        assert_eq!(walked(start, &[]).unwrap().0, off, "from {start:?}, without points");
    }
    for start in [[1e300, 1e300, 0.0], [50.0, 6.0, 0.0], [50.0, 6.0, 1e300]] {
        let (ended, steps, _) = walked(start, &[]).unwrap();
        assert!(ended == off && (1..100).contains(&steps), "{ended:?} from {start:?} after {steps}");
    }
    // Put down at once, or after a fall.
    let (ended, steps, [x, y, z]) = walked([2.0, 6.0, 0.2], &[]).unwrap();
    assert!(ended == Ended::Arrived && steps == 0, "{ended:?} after {steps}");
    assert!(x == 2.0 && y == 6.0 && z.abs() < 0.02, "stands at {x}, {y}, {z}");
    let (ended, steps, [_, _, z]) = walked([2.0, 6.0, 1.2], &[]).unwrap();
    assert!(ended == Ended::Arrived && steps == 4 && z == 1.2, "{ended:?} from {z} after {steps}");

    for (start, points, index) in [
        ([2.0, 6.0, 0.0], vec![[3.0, 6.0], [1e300, 6.0]], 2),
        ([2.0, 6.0, 0.0], vec![[3.0, -1e12], [3.0, 6.0]], 1),
        ([1e13, 6.0, 0.0], vec![[3.0, 6.0]], 0),
    ] {
        let refused = walked(start, &points).unwrap_err();
        assert!(matches!(refused, WalkError::FarOff { index: i, .. } if i == index), "{points:?}: {refused}");
        assert!(refused.to_string().contains("off the map"), "{refused}");
    }
}

#[test]
fn starts_that_do_not_serve_are_refused() {
    let map = map_of(&scan(), Up::Z);
    let start = |place| Walker::new(avatar(), &map, place).map(|walker| walker.position(map.grid()));
    assert!(start([9.0, 6.5, 0.1]).unwrap_err().to_string().contains("inside an obstacle"));
    assert!(start([12.0, 8.0, 0.1]).unwrap_err().to_string().contains("ceiling"));
    assert!(start([2.0, 6.0, f64::NAN]).unwrap_err().to_string().contains("not finite"));
    assert!(start([2.0, 6.0, 0.2]).unwrap()[2].abs() < 0.02, "put onto the floor");
    let mut walker = Walker::new(avatar(), &map, [2.0, 6.0, 0.2]).unwrap();
    let before = walker;
    let step = walker.step(&map, [f64::NAN, 3.0], &Slide).unwrap();
    assert!(walker == before && !step.blocked, "nowhere to go");
    let route = Route { start: [2.0, 6.0, 0.2], points: vec![[2.0, 6.5], [f64::INFINITY, 0.0]] };
    let refused = route.walk(&mut &map, &avatar(), &Back, |_, _| Ok(())).unwrap_err();
    assert!(refused.to_string().contains("point 2"), "{refused}");
    for (what, options) in [
        ("width", AvatarOptions::default().with_box([0.0, 1.0], 1.7)),
        ("height", AvatarOptions::default().with_box([1.0, 1.0], f64::NAN)),
        ("step", AvatarOptions::default().with_step(-1.0)),
        ("climb", AvatarOptions::default().with_climb(2.0)),
    ] {
        let refused = Avatar::new(&options).unwrap_err().to_string();
        assert!(refused.contains(what), "{refused}");
    }
}

#[test]
fn many_avatars_walk_as_each_would_alone() {
    let map = map_of(&scan(), Up::Z);
    let rng = &mut rng(2);
    let mut walkers = Vec::new();
    while walkers.len() < 300 {
        let start =
            [rng.random_range(0.5..15.5), rng.random_range(0.5..11.5), [0.1, STOREY][walkers.len() % 2]];
        walkers.extend(Walker::new(avatar(), &map, start));
    }
    let targets: Vec<[f64; 2]> =
        walkers.iter().map(|_| [rng.random_range(0.0..16.0), rng.random_range(0.0..12.0)]).collect();
    let mut alone = walkers.clone();
    let mut steps = vec![Ok(alone[0].step(&map, targets[0], &Back).unwrap()); walkers.len()];
    alone[0] = walkers[0];
    let (mut blocked, mut falling) = (0, 0);
    for _ in 0..120 {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        pool.install(|| step_each(&map, &mut walkers, &targets, &Slide, &mut steps));
        for ((walker, target), step) in alone.iter_mut().zip(&targets).zip(&steps) {
            let expected = walker.step(&map, *target, &Slide).unwrap();
            assert_eq!(*step, Ok(expected));
            blocked += usize::from(expected.blocked);
            falling += usize::from(expected.falling);
        }
    }
    assert_eq!(walkers, alone);
    assert!(blocked > 1000 && falling > 10, "{blocked} blocked, {falling} falling");
    // No avatar ended inside anything: the box above the climb is free.
    let AvatarOptions { climb, .. } = *avatar().options();
    for walker in &walkers {
        let feet = walker.position(map.grid());
        let body = avatar().bounds(map.grid(), feet);
        let body = Aabb { min: [body.min[0], body.min[1], feet[2] + climb + 0.15], max: body.max };
        let body = Aabb { max: [body.max[0], body.max[1], body.max[2] - 0.15], ..body };
        assert!(!map.touches(&body).unwrap(), "{feet:?}");
    }
}
