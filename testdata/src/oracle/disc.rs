//! Crossing of two flat discs in space: a first-order test of two tangent planes.

use nalgebra::Vector3;

/// A flat disc: a part of the tangent plane about a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disc {
    /// The middle.
    pub centre: [f64; 3],
    /// Unit normal; its sign is arbitrary.
    pub normal: [f64; 3],
    /// Radius, in the unit of `centre`.
    pub radius: f64,
}

impl Disc {
    /// Returns the greatest distance of a point of the disc from `x`.
    #[must_use]
    pub fn furthest(&self, x: [f64; 3]) -> f64 {
        let d = Vector3::from(x) - Vector3::from(self.centre);
        let height = d.dot(&Vector3::from(self.normal));
        height.hypot((d - height * Vector3::from(self.normal)).norm() + self.radius)
    }
}

/// The result of [`crossing`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// `true` if the closed discs have a point in common.
    pub crosses: bool,
    /// Margin of the decision: positive if the discs cross, negative if not, small in size if
    /// rounding decides. A length, but not a distance.
    pub slack: f64,
}

/// Greatest sine of the angle at which two planes count as parallel, and greatest distance relative
/// to the radii at which discs count as coplanar.
const PARALLEL: f64 = 1e-12;

/// Tests if `a` and `b` have a point in common.
///
/// Planes that are not parallel meet in a line with direction u = n × m, ‖u‖ = sin φ. Each disc
/// contains a chord of it. The centre of `a` is |m·(b − a)|/sin φ away from the line, so the
/// chord's half-length is √(R² − that²), about the projection of the centre. The discs cross iff
/// both chords exist and overlap. Parallel discs cross iff they are coplanar and their centres are
/// no further apart than the sum of the radii.
#[must_use]
pub fn crossing(a: &Disc, b: &Disc) -> Crossing {
    let (na, nb) = (Vector3::from(a.normal), Vector3::from(b.normal));
    let between = Vector3::from(b.centre) - Vector3::from(a.centre);
    let line = na.cross(&nb);
    let sine = line.norm();
    let slack = if sine < PARALLEL {
        let apart = na.dot(&between).abs() - PARALLEL * (a.radius + b.radius);
        (a.radius + b.radius - between.norm()).min(-apart)
    } else {
        let from_a = nb.dot(&between).abs() / sine;
        let from_b = na.dot(&between).abs() / sine;
        let chords = (a.radius - from_a).min(b.radius - from_b);
        if chords < 0.0 {
            chords * sine
        } else {
            let half_a = (a.radius * a.radius - from_a * from_a).sqrt();
            let half_b = (b.radius * b.radius - from_b * from_b).sqrt();
            let overlap = half_a + half_b - between.dot(&line).abs() / sine;
            overlap.min(chords * sine)
        }
    };
    Crossing { crosses: slack >= 0.0, slack }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arbitrary::unit_vector;
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    /// Returns points spread over a disc, as fine as `n` rings.
    fn samples(d: &Disc, n: u32) -> Vec<Vector3<f64>> {
        let normal = Vector3::from(d.normal);
        let u = normal.cross(&normal.map(|x| if x == normal.amin() { 1.0 } else { 0.3 }));
        let u = u.normalize();
        let v = normal.cross(&u);
        let mut all = vec![Vector3::from(d.centre)];
        for ring in 1..=n {
            let r = d.radius * f64::from(ring) / f64::from(n);
            for k in 0..6 * ring {
                let (s, c) = (std::f64::consts::TAU * f64::from(k) / f64::from(6 * ring)).sin_cos();
                all.push(Vector3::from(d.centre) + r * (c * u + s * v));
            }
        }
        all
    }

    /// Returns the distance of a dense sampling of `a` from the disc `b`.
    fn least_gap(a: &Disc, b: &Disc) -> f64 {
        let n = Vector3::from(b.normal);
        let gap = |x: &Vector3<f64>| {
            let d = x - Vector3::from(b.centre);
            let height = n.dot(&d);
            let flat = (d - height * n).norm();
            height.hypot((flat - b.radius).max(0.0))
        };
        samples(a, 60).iter().map(gap).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn agrees_with_sampling() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
        let (mut yes, mut no) = (0, 0);
        for _ in 0..400 {
            let mut disc = |spread: f64| Disc {
                centre: [0; 3].map(|_| rng.random_range(-spread..spread)),
                normal: unit_vector(&mut rng),
                radius: rng.random_range(0.3..1.0),
            };
            let (a, b) = (disc(0.1), disc(0.9));
            let found = crossing(&a, &b);
            assert_eq!(found.crosses, crossing(&b, &a).crosses, "symmetric");
            // Samples of a are at most 1/60 of its radius apart, so a crossing leaves a gap below
            // that.
            let gap = least_gap(&a, &b);
            if found.crosses {
                assert!(gap < a.radius / 60.0, "{a:?} {b:?}: {gap}");
                yes += 1;
            } else {
                no += 1;
                // Without a crossing, a tiny gap implies a tiny slack.
                assert!(gap > 0.0, "{a:?} {b:?}");
                if found.slack < -0.02 {
                    assert!(gap > 1e-4, "{a:?} {b:?}: {gap}, {found:?}");
                }
            }
        }
        assert!(yes > 50 && no > 50, "both answers are exercised: {yes} {no}");
    }

    #[test]
    fn parallel_discs_cross_only_in_one_plane() {
        let disc = |x: f64, z: f64| Disc { centre: [x, 0.0, z], normal: [0.0, 0.0, 1.0], radius: 1.0 };
        assert!(crossing(&disc(0.0, 0.0), &disc(1.9, 0.0)).crosses);
        assert!(!crossing(&disc(0.0, 0.0), &disc(2.1, 0.0)).crosses);
        assert!(!crossing(&disc(0.0, 0.0), &disc(0.5, 0.01)).crosses);
    }
}
