//! The deepest place of a sphere or capsule over a disc.
//!
//! A sphere of radius R whose centre is h above the plane of a disc and x beside the disc reaches
//! √(R² − x²) − h below the plane over the disc. Along the segment of a capsule this depth is concave.
//! Let w be the way of the segment, u and σ its parts across and down, and e the distance of a point of
//! the segment from the axis of the disc, whose radius is ρ. On the line of the segment e is at least d.
//! The depth is greatest where its derivative is zero: for x = e − ρ > 0 at
//!
//! x = R σ / √(σ² + u² (1 − d²/e²)),
//!
//! whose right side decreases in e and is convex. So Newton's method that starts at too small an e never
//! goes past the zero.

use nearmiss_geometry::nalgebra::Vector3;

use crate::leaf::disc_triangle::FlatDisc;
use crate::solid::core::Solid;

type Vector = Vector3<f64>;

/// Steps of Newton's method; three are enough in the mean.
const ROUNDS: u32 = 16;

/// The last step, in disc radii. The error that it leaves is of second order, and that of the depth smaller.
const PRECISION: f64 = 1e-3;

/// The error of a place, in disc radii.
const ROUNDING: f64 = 1e-9;

/// The square of the sine of the angle of a segment and the axis of a disc below which they are parallel.
const UPRIGHT_SQ: f64 = 1e-24;

/// The point of a segment about which a sphere reaches deepest over a disc.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Deepest {
    /// The height of the point above the plane of the disc.
    pub(crate) height: f64,
    /// Its distance from the cylinder over the disc, across the axis of the disc.
    pub(crate) beside: f64,
    /// The point of the disc over which the sphere is deepest.
    pub(crate) on_disc: Vector,
}

impl Solid<'_> {
    /// The deepest place of a shape whose core is a point or a segment, against `out`, over a disc with that
    /// axis. `None` if no part of the shape is over the disc. O(1).
    pub(crate) fn deepest_over(&self, disc: &FlatDisc, out: &Vector) -> Option<Deepest> {
        Deepest::of_capsule((self.centre, self.axes[0] * self.half.x), self.radius, (disc, out))
    }
}

impl Deepest {
    /// The deepest place of a capsule, given by its centre, the way from there to an end, and its radius,
    /// against `out` over a disc with that axis. `None` if no part of the capsule is over the disc.
    pub(crate) fn of_capsule(
        (centre, edge): (Vector, Vector),
        radius: f64,
        (disc, out): (&FlatDisc, &Vector),
    ) -> Option<Self> {
        let from = centre - disc.centre;
        let (middle, rise) = (out.dot(&from), out.dot(&edge));
        let (edge, fall) = if rise > 0.0 { (-edge, rise) } else { (edge, -rise) };
        let (from, way) = (from - out * middle, edge + out * fall);
        let share = deepest_share(&from, &way, fall, [disc.radius, radius]);
        let across = from + way * share;
        let away = across.norm();
        let beside = away - disc.radius;
        let inwards = if beside > 0.0 { disc.radius / away } else { 1.0 };
        (beside <= radius + ROUNDING * disc.radius).then(|| Self {
            height: middle - fall * share,
            beside: beside.clamp(0.0, radius),
            on_disc: disc.centre + across * inwards,
        })
    }

    /// The depth below the plane of the disc that the sphere of this radius about the point reaches.
    pub(crate) fn depth(&self, radius: f64) -> f64 {
        (radius * radius - self.beside * self.beside).sqrt() - self.height
    }
}

/// The place on a segment, from −1 at the upper end to 1 at the lower one, about which a sphere reaches
/// deepest over a disc. `from` and `way` are across the axis of the disc: from there to the middle of the
/// segment, and from there to the lower end, which is `fall` lower. The radii are those of the disc and of
/// the sphere.
fn deepest_share(from: &Vector, way: &Vector, fall: f64, [disc, radius]: [f64; 2]) -> f64 {
    let low_sq = (from + way).norm_squared();
    let square = way.norm_squared();
    if low_sq <= disc * disc || square <= UPRIGHT_SQ * fall * fall {
        return 1.0;
    }
    let nearest = -from.dot(way) / square;
    if nearest >= 1.0 {
        return 1.0;
    }
    // Distances from the axis: the least one of the line, and that of the place.
    let least = (from + way * nearest).norm();
    let (pull, fall_sq) = (radius * fall, fall * fall);
    let mut away = least.max(disc + pull / (square + fall_sq).sqrt());
    // The square of the way across between the two.
    let beyond_sq = |away: f64| ((away - least) * (away + least)).max(0.0);
    let bend = pull * square * least * least;
    for _ in 0..ROUNDS {
        let (away_sq, way_sq) = (away * away, beyond_sq(away));
        if away_sq >= low_sq {
            return 1.0;
        }
        // The radicand times e², so that a step takes one root and one division.
        let slope_sq = fall_sq * away_sq + square * way_sq;
        let slope = slope_sq.sqrt();
        let step = ((disc - away) * slope + pull * away) * slope_sq / (slope_sq * slope + bend);
        // If a level segment is beside the disc, the slope is 0.
        if step.is_nan() || step <= 0.0 {
            break;
        }
        away += step;
        // The place moves by step × away / way.
        if (step * away).powi(2) <= (PRECISION * disc).powi(2) * way_sq {
            break;
        }
    }
    (nearest + (beyond_sq(away) / square).sqrt()).clamp(-1.0, 1.0)
}

#[cfg(test)]
mod tests {
    use nearmiss_geometry::Pose;
    use nearmiss_testdata::arbitrary::{point_in, rng, unit_vector};
    use rand::RngExt;

    use super::*;
    use crate::solid::shape::Shape;

    /// The greatest depth over a disc of spheres about the points of a segment: concave where it is defined.
    fn searched(solid: &Solid<'_>, disc: &FlatDisc, out: &Vector) -> Option<f64> {
        let edge = solid.axes[0] * solid.half.x;
        let of = |share: f64| {
            let from = solid.centre + edge * share - disc.centre;
            let height = out.dot(&from);
            let beside = ((from - out * height).norm() - disc.radius).max(0.0);
            (beside, (solid.radius * solid.radius - beside * beside).sqrt() - height)
        };
        let least = |value: &dyn Fn(f64) -> f64, [mut low, mut high]: [f64; 2]| {
            for _ in 0..200 {
                let third = (high - low) / 3.0;
                if value(low + third) <= value(high - third) { high -= third } else { low += third }
            }
            0.5 * (low + high)
        };
        // Where the segment is nearest to the axis of the disc, and how far from there it is over the disc.
        let nearest = least(
            &|share| {
                let from = solid.centre + edge * share - disc.centre;
                (from - out * out.dot(&from)).norm()
            },
            [-1.0, 1.0],
        );
        if of(nearest).0 > solid.radius {
            return None;
        }
        let end = |mut out_of: f64| {
            let mut inside = nearest;
            for _ in 0..100 {
                let middle = 0.5 * (inside + out_of);
                if of(middle).0 <= solid.radius { inside = middle } else { out_of = middle }
            }
            if of(out_of).0 <= solid.radius { out_of } else { inside }
        };
        let range = [end(-1.0), end(1.0)];
        let best = least(&|share| -of(share).1, range);
        Some(
            [best, range[0], range[1]].map(|share| of(share).1).into_iter().fold(f64::NEG_INFINITY, f64::max),
        )
    }

    /// No sphere about a point of the segment is deeper, and the shape is as deep as told over the place.
    #[test]
    fn no_place_over_a_disc_is_deeper() {
        let rng = &mut rng(7357);
        let (mut over, mut beside, mut at_rims) = (0, 0, 0);
        for round in 0..20_000 {
            let size = [1.0, 1e-3, 1e4][round % 3];
            let normal = Vector::from(unit_vector(rng));
            let across = normal.cross(&Vector::from(unit_vector(rng))).normalize();
            // Any way, level, upright, nearly so, or no way at all.
            let way = match round % 7 {
                0 => across,
                1 => normal,
                2 => across + normal * 10.0_f64.powi(-rng.random_range(1..9)),
                3 => normal + across * 10.0_f64.powi(-rng.random_range(1..17)),
                4 => Vector::zeros(),
                _ => Vector::from(unit_vector(rng)),
            } * (size * rng.random_range(0.01..3.0));
            let middle = Vector::from(point_in(rng, 1.5 * size));
            let ends = [(middle - way).into(), (middle + way).into()];
            let radius = [0.0, 0.01, 0.3, 1.0][round % 4] * size;
            let solid = Solid::new(&Shape::Capsule { ends, radius }, &Pose::IDENTITY).unwrap();
            let disc_radius = [0.02, 0.2, 1.0][(round / 4) % 3] * size;
            let disc =
                FlatDisc { centre: Vector::from(point_in(rng, 0.5 * size)), normal, radius: disc_radius };
            let (found, expected) = (solid.deepest_over(&disc, &normal), searched(&solid, &disc, &normal));
            let (Some(found), Some(expected)) = (found, expected) else {
                beside += 1;
                assert_eq!(
                    found.is_none(),
                    expected.is_none(),
                    "round {round}: {solid:?} {disc:?} {found:?}"
                );
                continue;
            };
            over += 1;
            at_rims += usize::from(found.beside > 0.0);
            let depth = (radius * radius - found.beside * found.beside).sqrt() - found.height;
            // A place that is off along a steep flank is less deep in the first order.
            assert!(
                (depth - expected).abs() <= 1e-6 * size,
                "round {round}: {depth}, expected {expected}: {solid:?} {disc:?} {found:?}"
            );
            let off = found.on_disc - disc.centre;
            assert!(off.norm() <= disc_radius + 1e-9 * size && normal.dot(&off).abs() <= 1e-9 * size);
            let away = solid.distance(&(found.on_disc - normal * depth));
            assert!(away <= radius + 1e-7 * size, "round {round}: {away} {solid:?} {disc:?} {found:?}");
        }
        assert!(
            over > 7000 && beside > 3000 && at_rims > 4000,
            "{over} over, {beside} beside, {at_rims} at rims"
        );
    }
}
