//! Frames of a spinning laser scanner: rings, dense along and far apart across.

use crate::arbitrary::{gaussian, rng};

/// Height of the scanner above the floor.
pub const HEIGHT: f64 = 1.8;

/// Half the sides of the hall about the scanner, with vertical walls.
pub const HALL: [f64; 2] = [14.0, 9.0];

/// Parameters of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Beams, from 20° below the horizon to 10° above it.
    pub beams: u32,
    /// Returns of a beam in one turn.
    pub steps: u32,
    /// Standard deviation of the measured distance.
    pub noise: f64,
    /// Seed of the noise.
    pub seed: u64,
}

/// Returns one frame, ring by ring: the scanner at the origin, the floor at −[`HEIGHT`], the walls
/// at ±[`HALL`].
#[must_use]
pub fn frame(frame: &Frame) -> Vec<[f64; 3]> {
    let rng = &mut rng(frame.seed);
    let share = |i: u32, n: u32| f64::from(i) / f64::from(n.max(1));
    let mut points = Vec::new();
    for beam in 0..frame.beams {
        let (up, level) = (-20.0 + 30.0 * share(beam, frame.beams - 1)).to_radians().sin_cos();
        for step in 0..frame.steps {
            let (s, c) = (std::f64::consts::TAU * share(step, frame.steps)).sin_cos();
            let ray = [level * c, level * s, up];
            let floor = if up < 0.0 { HEIGHT / -up } else { f64::INFINITY };
            let walls = [0, 1].map(|k| HALL[k] / ray[k].abs());
            let reach = floor.min(walls[0]).min(walls[1]) + frame.noise * gaussian(rng);
            points.push(ray.map(|x| reach * x));
        }
    }
    points
}

/// Returns the distance of `x` from the nearest of floor and walls, and the unit normal there.
#[must_use]
pub fn off(x: [f64; 3]) -> (f64, [f64; 3]) {
    let floor = ((x[2] + HEIGHT).abs(), [0.0, 0.0, 1.0]);
    let walls =
        [((x[0].abs() - HALL[0]).abs(), [1.0, 0.0, 0.0]), ((x[1].abs() - HALL[1]).abs(), [0.0, 1.0, 0.0])];
    walls.into_iter().fold(floor, |best, wall| if wall.0 < best.0 { wall } else { best })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn returns_lie_on_floor_and_walls_and_rings_are_far_from_each_other() {
        let taken = Frame { beams: 16, steps: 900, noise: 0.0, seed: 1 };
        let points = frame(&taken);
        assert_eq!(points.len(), 16 * 900);
        assert!(points.iter().all(|&p| off(p).0 < 1e-9));
        let apart = |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
        // Beams 4 and 5 hit the floor at 12° and 10°.
        let (along, across) =
            (apart(points[4 * 900], points[4 * 900 + 1]), apart(points[4 * 900], points[5 * 900]));
        assert!(across > 20.0 * along, "{across} across, {along} along");
        assert_eq!(points, frame(&taken), "the same for the same seed");
    }
}
