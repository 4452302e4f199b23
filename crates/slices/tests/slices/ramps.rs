//! Ramps are floor or obstacle, and are climbed or not, depending on the given angle.

use nearmiss_slices::{
    Avatar, AvatarOptions, Back, Obstacle, Pixel, Route, SliceMap, SliceOptions, WalkError,
};
use nearmiss_testdata::house::{Quad, RAMP, RAMPS, house, ramp_corner, scanned};

use crate::built::{built, of_quads};

/// Breadth of a ramp, and its length on the ground.
const SIZE: [f64; 2] = [2.0, 3.0];

/// Margin at the edge of a ramp that does not count.
const EDGE: f64 = 0.25;

/// A ramp in a plane, with the ground before it.
struct Ramp {
    /// Horizontal direction upwards.
    along: [f64; 2],
    quads: Vec<Quad>,
}

impl Ramp {
    /// A ramp of this angle that climbs in this direction, both in degrees.
    fn new(angle: f64, towards: f64) -> Self {
        let (s, c) = towards.to_radians().sin_cos();
        let [breadth, length] = SIZE;
        let across = [-breadth * s, breadth * c, 0.0];
        let corner = [0.5 * breadth * s, -0.5 * breadth * c, 0.0];
        let up = [length * c, length * s, length * angle.to_radians().tan()];
        let before = [-2.0 * c, -2.0 * s, 0.0];
        // A patch below, so that the slices begin at an arbitrary height of the ramp.
        let below = Quad { corner: [0.0, 0.0, -0.41], sides: [[0.1, 0.0, 0.0], [0.0, 0.1, 0.0]] };
        let quads = [up, before].map(|side| Quad { corner, sides: [across, side] });
        Self { along: [c, s], quads: [&quads[..], &[below]].concat() }
    }

    /// The share of its pixels that are obstacles.
    fn share(&self, map: &SliceMap) -> f64 {
        let grid = map.grid();
        let (mut pixels, mut obstacles) = (0_u32, 0_u32);
        for row in 0..grid.counts[1] {
            for column in 0..grid.counts[0] {
                let [x, y] = grid.middle(column, row);
                let [c, s] = self.along;
                let (up, aside) = (c * x + s * y, c * y - s * x);
                if !(EDGE..=SIZE[1] - EDGE).contains(&up) || aside.abs() > 0.5 * SIZE[0] - EDGE {
                    continue;
                }
                let highest = map.slices().iter().flatten().rev().find_map(|slice| slice.pixel(column, row));
                pixels += 1;
                obstacles += u32::from(highest.unwrap().is_obstacle);
            }
        }
        assert!(pixels > 500, "{pixels} pixels");
        f64::from(obstacles) / f64::from(pixels)
    }
}

fn options(pixel: f64, degrees: f64, noise: Option<f64>) -> SliceOptions {
    SliceOptions::default().with_pixel(Pixel::Side(pixel)).with_obstacle(Obstacle::Slope { degrees, noise })
}

/// In a pixel of side t a surface rises by t·tan φ along an axis, by t·(|cos ψ| + |sin ψ|)·tan φ in direction
/// ψ.
#[test]
fn ramps_switch_at_the_angle_asked_for() {
    for angle in RAMPS {
        for towards in [0.0, 17.0, 45.0, 90.0, 201.0] {
            let ramp = Ramp::new(angle, towards);
            let (s, c): (f64, f64) = f64::to_radians(towards).sin_cos();
            let rise = (s.abs() + c.abs()) * angle.to_radians().tan();
            let switch = rise.atan().to_degrees();
            for pixel in [0.03, 0.05, 0.083] {
                let share = |degrees| ramp.share(&of_quads(&ramp.quads, &options(pixel, degrees, Some(0.0))));
                let told =
                    format!("{angle}° towards {towards}°, pixels of {pixel}, switching at {switch:.2}°");
                // Half of the pixels switch within half a degree.
                let (before, after) = (share(switch - 0.5), share(switch + 0.5));
                assert!(before > 0.5 && after < 0.5, "{told}: {before} and {after}");
                // All of them within a level, of which three pixels' height has 255.
                let level = |levels: f64| (rise + levels * 3.0 / 255.0).atan().to_degrees();
                let (before, after) = (share(level(-1.01)), share(level(1.01)));
                assert!(before > 1.0 - 1e-9 && after < 1e-9, "{told}: {before} and {after} a level off");
            }
        }
    }
}

#[test]
fn noise_lets_ramps_switch_later_by_no_more_than_itself() {
    const PIXEL: f64 = 0.06;
    let mut steep = 0;
    for (noise, most) in [(0.002, 0.01), (0.006, 0.2)] {
        for angle in RAMPS {
            let ramp = Ramp::new(angle, 90.0);
            let points = scanned(&ramp.quads, 0.006, noise, 5);
            let share = |degrees| {
                let map = built(&points, &options(PIXEL, degrees, None)).unwrap();
                (ramp.share(&map), map.about().noise)
            };
            // Noise a tenth of a pixel is too much for a slope of 60°: some more of its pixels are obstacles.
            let (after, estimated) = share(angle + 2.0);
            assert!(after < most, "{angle}°, noise {noise}: {after} are obstacles for {}°", angle + 2.0);
            // Below this angle the slope and the noise together span less than is allowed. A gentle
            // slope is lost in noise.
            let least = (angle.to_radians().tan() - estimated / PIXEL).atan().to_degrees() - 1.0;
            if least > 1.0 {
                steep += 1;
                let before = share(least).0;
                assert!(before > 0.95, "{angle}°, noise {noise}: {before} are obstacles for {least}°");
            }
        }
    }
    assert_eq!(steep, 7, "ramps that stand out");
}

/// Returns the height that an avatar reaches when it walks straight up.
fn reached(map: &SliceMap, from: [f64; 2], to: [f64; 2], pixel: f64) -> f64 {
    let avatar = Avatar::new(&AvatarOptions::default().with_step(pixel)).unwrap();
    let mut highest = f64::NEG_INFINITY;
    let route = Route { start: [from[0], from[1], 0.1], points: vec![to] };
    route
        .walk(&mut &*map, &avatar, &Back, |_, step| {
            highest = highest.max(step.position[2]);
            Ok::<(), WalkError>(())
        })
        .unwrap();
    highest
}

#[test]
fn ramps_are_climbed_from_their_angle_on() {
    let climb = AvatarOptions::default().climb;
    for angle in RAMPS {
        for towards in [0.0, 90.0] {
            let ramp = Ramp::new(angle, towards);
            let [c, s] = ramp.along;
            for pixel in [0.03, 0.05, 0.083] {
                let height = |degrees: f64| {
                    let map = of_quads(&ramp.quads, &options(pixel, degrees, Some(0.0)));
                    reached(&map, [-c, -s], [2.7 * c, 2.7 * s], pixel)
                };
                let (below, above) = (height(angle - 1.0), height(angle + 1.0));
                let top = 2.7 * angle.to_radians().tan();
                // The base reaches further up than its middle.
                assert!(above >= top, "{angle}° towards {towards}°, pixels of {pixel}: {above} of {top}");
                // The pixels of its foot are floor as long as there is little of it in them.
                let foot = pixel * angle.to_radians().tan();
                assert!(
                    below < climb + foot + 1e-3,
                    "{angle}° towards {towards}°, pixels of {pixel}: {below}"
                );
            }
        }
    }
}

#[test]
fn the_houses_ramps_are_climbed_up_to_45_degrees() {
    let map = of_quads(&house(), &options(0.05, 45.0, Some(0.0)));
    for (i, angle) in (0_u8..).zip(RAMPS) {
        let [x, y] = ramp_corner(i);
        let middle = x + 0.5 * RAMP[1];
        let reached = reached(&map, [middle, 0.4], [middle, y + RAMP[0] - 0.1], 0.05);
        let top = (RAMP[0] - 0.1) * angle.to_radians().tan();
        if angle < 45.0 {
            assert!(reached >= top, "{angle}°: {reached} of {top}");
        } else {
            assert!(reached < AvatarOptions::default().climb + 1e-3, "{angle}°: {reached} of {top}");
        }
    }
}
