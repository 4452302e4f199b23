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
//! goes past the zero. The same code computes one place, or eight in SIMD lanes.

use nearmiss_lanes::lane::{Lane, difference, dot, sum};

use crate::solid::core::Solid;
use crate::solid::discs::{Discs, Over};

/// Steps of Newton's method; three are enough in the mean.
const ROUNDS: u32 = 16;

/// The last step, in disc radii. The error that it leaves is of second order, and that of the depth smaller.
const PRECISION: f64 = 1e-3;

/// The error of a place, in disc radii.
const ROUNDING: f64 = 1e-9;

/// The square of the sine of the angle of a segment and the axis of a disc below which they are parallel.
const UPRIGHT_SQ: f64 = 1e-24;

/// A capsule: its centre, the way from there to an end, and its radius.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Capsule {
    pub(crate) centre: [f64; 3],
    pub(crate) edge: [f64; 3],
    pub(crate) radius: f64,
}

impl Capsule {
    /// The shape, whose core must be a point or a segment.
    pub(crate) fn of(solid: &Solid<'_>) -> Self {
        let edge = solid.axes[0] * solid.half.x;
        Self { centre: solid.centre.into(), edge: edge.into(), radius: solid.radius }
    }

    /// The deepest places over discs.
    #[inline(always)]
    pub(crate) fn over<L: Lane>(&self, discs: &Discs<L>) -> Over<L> {
        let Discs { centre, out, radius: disc } = *discs;
        let (zero, radius) = (disc.splat(0.0), disc.splat(self.radius));
        let from = difference(disc.splat_all(self.centre), centre);
        let edge = disc.splat_all(self.edge);
        let (middle, rise) = (dot(out, from), dot(out, edge));
        // To the lower end.
        let is_up = zero.is_less(rise);
        let edge = L::select_all(is_up, [-edge[0], -edge[1], -edge[2]], edge);
        let fall = rise.abs();
        let from = difference(from, middle.scale_all(out));
        let way = sum(edge, fall.scale_all(out));
        let share = deepest_share(&from, &way, fall, [disc, radius]);
        let across = sum(from, share.scale_all(way));
        let away = dot(across, across).sqrt();
        let beside = away - disc;
        let is_beside = zero.is_less(beside);
        let inwards = L::select(is_beside, disc / away, disc.splat(1.0));
        let is_over = beside.is_at_most(radius + disc * ROUNDING);
        let beside = beside.within(0.0, self.radius);
        let height = middle - fall * share;
        Over {
            is_over,
            on_disc: sum(centre, inwards.scale_all(across)),
            depth: (radius * radius - beside * beside).sqrt() - height,
            is_beside,
            apart: (height * height + beside * beside).sqrt(),
        }
    }
}

/// The places on segments, from −1 at the upper end to 1 at the lower one, about which spheres reach deepest
/// over discs. `from` and `way` are across the axis of the disc: from there to the middle of the segment, and
/// from there to the lower end, which is `fall` lower. The radii are those of the disc and of the sphere.
#[inline(always)]
fn deepest_share<L: Lane>(from: &[L; 3], way: &[L; 3], fall: L, [disc, radius]: [L; 2]) -> L {
    let (zero, one) = (fall.splat(0.0), fall.splat(1.0));
    let low = sum(*from, *way);
    let (low_sq, square) = (dot(low, low), dot(*way, *way));
    let nearest = -dot(*from, *way) / square;
    // The lower end is the deepest place.
    let mut is_low = low_sq.is_at_most(disc * disc)
        | square.is_at_most(fall * fall * UPRIGHT_SQ)
        | one.is_at_most(nearest);
    if !L::any(!is_low) {
        return one;
    }
    // Distances from the axis: the least one of the line, and that of the place.
    let at_least = sum(*from, nearest.scale_all(*way));
    let least = dot(at_least, at_least).sqrt();
    let (pull, fall_sq) = (radius * fall, fall * fall);
    let mut away = least.greater(disc + pull / (square + fall_sq).sqrt());
    // The square of the way across between the two.
    let beyond_sq = |away: L| ((away - least) * (away + least)).greater(zero);
    let bend = pull * square * least * least;
    let mut is_open = !is_low;
    for _ in 0..ROUNDS {
        let (away_sq, way_sq) = (away * away, beyond_sq(away));
        is_low = is_low | (is_open & low_sq.is_at_most(away_sq));
        // The radicand times e², so that a step takes one root and one division.
        let slope_sq = fall_sq * away_sq + square * way_sq;
        let slope = slope_sq.sqrt();
        let step = ((disc - away) * slope + pull * away) * slope_sq / (slope_sq * slope + bend);
        // If a level segment is beside the disc, the slope is 0, and the step is not a number.
        is_open = is_open & !is_low & zero.is_less(step);
        away = L::select(is_open, away + step, away);
        // The place moves by step × away / way.
        let (moved, most) = (step * away, disc * PRECISION);
        is_open = is_open & !(moved * moved).is_at_most(most * most * way_sq);
        if !L::any(is_open) {
            break;
        }
    }
    let share = (nearest + (beyond_sq(away) / square).sqrt()).within(-1.0, 1.0);
    L::select(is_low, one, share)
}

#[cfg(test)]
mod tests {
    use nearmiss_geometry::Pose;
    use nearmiss_geometry::nalgebra::Vector3;
    use nearmiss_testdata::arbitrary::{point_in, rng, unit_vector};
    use rand::RngExt;

    use super::*;
    use crate::leaf::disc_triangle::FlatDisc;
    use crate::solid::shape::Shape;

    type Vector = Vector3<f64>;

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
            let found = Capsule::of(&solid).over(&Discs::of(&disc, &normal));
            let (found, expected) = (Some(found).filter(|it| it.is_over), searched(&solid, &disc, &normal));
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
            at_rims += usize::from(found.is_beside);
            let depth = found.depth;
            // A place that is off along a steep flank is less deep in the first order.
            assert!(
                (depth - expected).abs() <= 1e-6 * size,
                "round {round}: {depth}, expected {expected}: {solid:?} {disc:?} {found:?}"
            );
            let off = Vector::from(found.on_disc) - disc.centre;
            assert!(off.norm() <= disc_radius + 1e-9 * size && normal.dot(&off).abs() <= 1e-9 * size);
            let away = solid.distance(&(Vector::from(found.on_disc) - normal * depth));
            assert!(away <= radius + 1e-7 * size, "round {round}: {away} {solid:?} {disc:?} {found:?}");
        }
        assert!(
            over > 7000 && beside > 3000 && at_rims > 4000,
            "{over} over, {beside} beside, {at_rims} at rims"
        );
    }
}
