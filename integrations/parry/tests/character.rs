//! A character in a scanned room with stairs, walls, ramps and a table; with and without noise.

use std::sync::OnceLock;

use nearmiss::geometry::PointCloud;
use nearmiss::{BuildOptions, Scan};
use nearmiss_parry::{
    Character, CharacterError, CharacterOptions, Obstacle, ScanDispatcher, ScanShape, Stride,
};
use nearmiss_testdata::house::{Quad, scanned};
use parry3d::math::{Pose, Vector};
use parry3d::query::{DefaultQueryDispatcher, QueryDispatcher as _};
use parry3d::shape::{Cuboid, Shape};

/// The length of a step of the character, and its fall in one.
const WAY: f32 = 0.05;
const FALL: f32 = 0.04;

/// Rise and run of the stairs.
const RISE: f64 = 0.17;
const RUN: f64 = 0.28;

/// Surfaces of a room, z up: a floor from (0, 0) to (6, 4) at z = 0; a wall x = 6; along x from 3.5 to
/// 4.9, five stairs between y = 0 and y = 1; a ramp of 30° between y = 1.2 and 2.2, and one of 60°
/// between y = 2.4 and 3.4; a table of height 0.7 at x 1 to 2, y 3 to 4.
fn room() -> Vec<Quad> {
    let quad = |corner, u, v| Quad { corner, sides: [u, v] };
    let ramp = |y: f64, angle: f64| {
        let slope = angle.to_radians().tan();
        quad([3.5, y, 0.0], [1.4, 0.0, 1.4 * slope], [0.0, 1.0, 0.0])
    };
    let mut quads = vec![
        quad([0.0; 3], [6.0, 0.0, 0.0], [0.0, 4.0, 0.0]),
        quad([6.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 2.5]),
        ramp(1.2, 30.0),
        ramp(2.4, 60.0),
        quad([1.0, 3.0, 0.7], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
        quad([1.0, 3.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.7]),
        quad([1.0, 3.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.7]),
    ];
    for i in 0..5_u8 {
        let (x, z) = (3.5 + RUN * f64::from(i), RISE * f64::from(i));
        let run = if i < 4 { RUN } else { 1.0 };
        quads.push(quad([x, 0.0, z], [0.0, 1.0, 0.0], [0.0, 0.0, RISE]));
        quads.push(quad([x, 0.0, z + RISE], [run, 0.0, 0.0], [0.0, 1.0, 0.0]));
    }
    quads
}

/// The scans of the room, with a noise of 0 and of 4 mm.
fn rooms() -> &'static [ScanShape; 2] {
    static ROOMS: OnceLock<[ScanShape; 2]> = OnceLock::new();
    ROOMS.get_or_init(|| {
        [0.0, 0.004].map(|noise| {
            let cloud = PointCloud::from_positions(&scanned(&room(), 0.04, noise, 3)).expect("points");
            ScanShape::new(Scan::build(&cloud, &BuildOptions::default()).expect("a scan"))
                .expect("for shapes")
        })
    })
}

fn options() -> CharacterOptions {
    CharacterOptions { up: Vector::Z, ..CharacterOptions::default() }
}

/// A character at a place, and all that it meets.
struct Walker<'a> {
    character: Character,
    obstacles: Vec<Obstacle<'a>>,
    trail: Vec<Vector>,
}

impl<'a> Walker<'a> {
    fn new(room: &'a ScanShape, options: &CharacterOptions, [x, y, z]: [f32; 3]) -> Self {
        let character = Character::new(options, Vector::new(x, y, z)).expect("valid options");
        let obstacles = vec![Obstacle { pose: Pose::IDENTITY, shape: room }];
        Self { character, obstacles, trail: Vec::new() }
    }

    fn beside(mut self, shape: &'a dyn Shape, pose: Pose) -> Self {
        self.obstacles.push(Obstacle { pose, shape });
        self
    }

    fn step(&mut self, wanted: Vector) -> Stride {
        let dispatcher = ScanDispatcher.chain(DefaultQueryDispatcher);
        let stride = self.character.step(wanted, &dispatcher, &self.obstacles);
        self.trail.push(self.character.feet());
        stride
    }

    /// Walks in a direction, and falls, for a number of steps.
    fn walk(&mut self, [x, y]: [f32; 2], steps: u32) -> Stride {
        let wanted = Vector::new(x, y, 0.0).normalize() * WAY - Vector::Z * FALL;
        let mut last = None;
        for _ in 0..steps {
            last = Some(self.step(wanted));
        }
        last.expect("at least one step")
    }

    fn feet(&self) -> Vector {
        self.character.feet()
    }
}

#[test]
fn it_climbs_stairs_and_comes_down_again() {
    for (room, off) in rooms().iter().zip([0.01, 0.03]) {
        let mut walker = Walker::new(room, &options(), [2.5, 0.5, 0.1]);
        let stride = walker.walk([1.0, 0.0], 50);
        assert!(stride.is_grounded, "{stride:?}");
        let feet = walker.feet();
        let top = 5.0 * 0.17;
        assert!((feet.x - 5.0).abs() < 0.06 && (feet.z - top).abs() < off, "on the landing, at {feet}");
        let stride = walker.walk([-1.0, 0.0], 50);
        assert!(stride.is_grounded, "{stride:?}");
        assert!((walker.feet().x - 2.5).abs() < 0.06 && walker.feet().z.abs() < off, "at {}", walker.feet());
        // Never below a tread, and never more than a step and its noise above.
        for place in &walker.trail[5..] {
            let step = ((f64::from(place.x) - 3.5) / RUN).floor().clamp(-1.0, 4.0) + 1.0;
            let above = f64::from(place.z) - step * RISE;
            assert!(
                above > -f64::from(off) && above < RISE + 2.0 * f64::from(off),
                "{above} above a tread, at {place}"
            );
        }
    }
    // A block of exact height: steps that are higher than it climbs are walls.
    let block = Cuboid::new(Vector::new(0.5, 0.5, 0.085));
    for (step, climbs) in [(0.2, true), (0.16, false), (0.1, false), (0.02, false)] {
        let walker = Walker::new(&rooms()[0], &CharacterOptions { step, ..options() }, [1.0, 1.5, 0.02]);
        let mut walker = walker.beside(&block, Pose::translation(2.5, 1.5, 0.085));
        let stride = walker.walk([1.0, 0.0], 25);
        let feet = walker.feet();
        assert_eq!(stride.is_blocked, !climbs, "a step of {step}: {stride:?}, at {feet}");
        assert!((feet.z - if climbs { 0.17 } else { 0.0 }).abs() < 0.01, "a step of {step}: at {feet}");
    }
}

#[test]
fn it_walks_up_gentle_ramps_only_and_slides_down_steep_ones() {
    for (room, off) in rooms().iter().zip([0.01, 0.03]) {
        let mut walker = Walker::new(room, &options(), [3.0, 1.7, 0.1]);
        assert!(walker.walk([1.0, 0.0], 30).is_grounded, "on the ramp of 30°");
        let feet = walker.feet();
        let height = (feet.x - 3.5) * 30.0_f32.to_radians().tan();
        // A ball rests on a slope a little above the place below its centre.
        let above = feet.z - height - 0.15 * (1.0 / 30.0_f32.to_radians().cos() - 1.0);
        assert!(feet.x > 4.3 && above.abs() < off, "{above} above the ramp, at {feet}");
        let still = walker.walk([1e-6, 0.0], 1);
        assert!(still.is_grounded, "{still:?}");
        // It stands still on a gentle slope.
        let before = walker.feet();
        for _ in 0..60 {
            walker.step(Vector::Z * -FALL);
        }
        assert!((walker.feet() - before).length() < 0.01, "{before} to {}", walker.feet());

        let mut walker = Walker::new(room, &options(), [3.0, 2.9, 0.1]);
        let stride = walker.walk([1.0, 0.0], 60);
        assert!(
            stride.is_blocked && walker.feet().x < 3.6,
            "the ramp of 60°: {stride:?} at {}",
            walker.feet()
        );
        // Dropped onto it, it slides down to the floor.
        let mut walker = Walker::new(room, &options(), [4.0, 2.9, 1.6]);
        for _ in 0..120 {
            walker.step(Vector::Z * -FALL);
        }
        let feet = walker.feet();
        assert!(feet.x < 3.6 && feet.z.abs() < 0.1, "it slid down to {feet}");
        assert!(walker.trail.iter().all(|p| p.z > -off), "through the floor");
    }
}

#[test]
fn walls_stop_it_and_it_slides_along_them() {
    for (room, off) in rooms().iter().zip([0.006, 0.025]) {
        let mut walker = Walker::new(room, &options(), [5.3, 3.0, 0.1]);
        let stride = walker.walk([1.0, 0.0], 30);
        assert!(stride.is_blocked && stride.is_grounded, "{stride:?}");
        let gap = 6.0 - walker.feet().x - 0.3;
        assert!((gap - 0.02).abs() < off, "{gap} from the wall");
        let before = walker.feet();
        walker.walk([1.0, 1.0], 15);
        let feet = walker.feet();
        let along = feet.y - before.y;
        assert!((along - 15.0 * WAY * 0.5_f32.sqrt()).abs() < 0.06, "{along} along the wall");
        assert!(
            walker.trail[5..].iter().all(|p| p.x < 5.7 + off - 0.02 && p.z.abs() < off + 0.005),
            "at {feet}"
        );
        // Against the table, which is too high to climb.
        let mut walker = Walker::new(room, &options(), [0.5, 3.6, 0.1]);
        let stride = walker.walk([1.0, 0.0], 30);
        assert!(stride.is_blocked && walker.feet().x < 0.71, "{stride:?}");
        // A box of the world is an obstacle as well.
        let crate_ = Cuboid::new(Vector::splat(0.4));
        let walker = Walker::new(room, &options(), [1.0, 1.5, 0.1]);
        let mut walker = walker.beside(&crate_, Pose::translation(2.5, 1.5, 0.4));
        let stride = walker.walk([1.0, 0.0], 40);
        assert!(stride.is_blocked && (walker.feet().x - 1.78).abs() < 0.01, "{stride:?} {}", walker.feet());
    }
}

#[test]
fn it_falls_off_edges_jumps_and_stops_below_ceilings() {
    let room = &rooms()[0];
    let mut walker = Walker::new(room, &options(), [1.5, 3.4, 0.75]);
    assert!(walker.walk([0.0, -1.0], 3).is_grounded, "on the table");
    let mut fallen = 0;
    for _ in 0..40 {
        let stride = walker.walk([0.0, -1.0], 1);
        fallen += u32::from(!stride.is_grounded);
        assert!(stride.moved.z > -FALL - 0.36, "{stride:?}");
    }
    assert!(fallen > 5 && walker.feet().z.abs() < 0.01, "{fallen} steps in the air, at {}", walker.feet());

    let ceiling = Cuboid::new(Vector::new(2.0, 2.0, 0.1));
    let walker = Walker::new(room, &options(), [1.0, 1.0, 0.01]);
    let mut walker = walker.beside(&ceiling, Pose::translation(1.0, 1.0, 2.2));
    walker.step(Vector::Z * -FALL);
    let mut highest = 0.0_f32;
    for _ in 0..20 {
        let stride = walker.step(Vector::Z * 0.05);
        highest = highest.max(walker.feet().z);
        assert!(!stride.is_grounded || highest < 0.35, "{stride:?}");
    }
    assert!((highest - 0.28).abs() < 0.01, "its head stops below the ceiling, the feet at {highest}");
    for _ in 0..20 {
        walker.step(Vector::Z * -FALL);
    }
    assert!(walker.character.is_grounded() && walker.feet().z.abs() < 0.01, "it comes down again");
    // No step up where the head has no room.
    let lintel = Cuboid::new(Vector::new(1.0, 1.0, 0.1));
    let walker = Walker::new(room, &options(), [2.5, 0.5, 0.01]);
    let mut walker = walker.beside(&lintel, Pose::translation(3.5, 0.5, 2.0));
    let stride = walker.walk([1.0, 0.0], 30);
    assert!(stride.is_blocked && walker.feet().z < 0.1, "{stride:?} at {}", walker.feet());
}

#[test]
fn walks_are_deterministic_and_bad_input_is_told() {
    let wander = || {
        let mut walker = Walker::new(&rooms()[1], &options(), [2.0, 2.0, 0.1]);
        for k in 0..200_u8 {
            let angle = f32::from(k / 10) * 2.4;
            walker.walk([angle.cos(), angle.sin()], 1);
        }
        walker.trail
    };
    let trail = wander();
    assert_eq!(trail, wander(), "the same walk twice");
    assert!(trail.iter().all(|p| p.z > -0.05 || p.x < 0.2 || p.y < 0.2 || p.y > 3.8), "through the floor");

    let mut walker = Walker::new(&rooms()[0], &options(), [2.0, 2.0, 0.0]);
    let stride = walker.step(Vector::new(f32::NAN, 0.0, 0.0));
    assert!(stride.moved.length() < 0.01, "{stride:?}");
    // A way of any length ends at the wall.
    walker.step(Vector::new(1e9, 0.0, -FALL));
    assert!(walker.feet().x < 5.71, "at {}", walker.feet());
    let told =
        |options: CharacterOptions| Character::new(&options, Vector::ZERO).expect_err("invalid").to_string();
    let of = options();
    assert_eq!(told(CharacterOptions { step: 0.0, ..of }), "step must be positive and finite, got 0");
    assert_eq!(told(CharacterOptions { slope: 2.0, ..of }), "slope must be from 0 to below π/2, got 2");
    assert!(told(CharacterOptions { height: 0.5, ..of }).contains("at least step + 2 radius"), "height");
    assert!(told(CharacterOptions { up: Vector::ZERO, ..of }).starts_with("up must be"), "up");
    let feet = Character::new(&of, Vector::splat(f32::NAN));
    assert!(matches!(feet, Err(CharacterError::Feet { .. })), "{feet:?}");
}
