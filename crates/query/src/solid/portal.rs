//! The lowest place of a convex shape over a disc, by its support map.
//!
//! The differences of points of the shape and of the disc form a convex body. Its lowest point on the axis
//! of the disc is at the height of the lowest place over the disc. A triangle with vertices in the body that
//! the axis crosses tells a height that is not too low. The point of the body that is furthest below the
//! plane of the triangle tells how much lower the place may be, and takes the place of a vertex (after
//! Snethen 2008; there the ray is one from inside the body).

use nearmiss_geometry::nalgebra::Vector3;

use crate::leaf::disc_triangle::FlatDisc;
use crate::solid::core::Solid;
use crate::solid::deepest::Capsule;
use crate::solid::discs::Discs;

type Vector = Vector3<f64>;

/// The greatest number of vertices that are tried in each of the three steps.
const ROUNDS: u32 = 32;

/// The search ends if the place is at most this much too high, in disc radii.
const PRECISION: f64 = 1e-3;

/// A triangle is too narrow if its area, seen along the axis, is less than this share of the squared length
/// of an edge.
const NARROW: f64 = 1e-9;

/// The sine of the angle of a flat end and a disc below which they are parallel.
const FLAT: f64 = 1e-9;

/// The lowest place of a shape over a disc.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lowest {
    /// Its height above the plane of the disc.
    pub(crate) height: f64,
    /// The place of the disc below it or above it.
    pub(crate) on_disc: Vector,
    /// `true` if the core is beside the disc there, so that only its radius is over the disc.
    pub(crate) is_beside: bool,
    /// The height of some place of the shape over the disc, not below the lowest one.
    pub(crate) other: f64,
}

/// A point of the body: the point of the core and that of the disc, relative to the centre of the disc, and
/// their difference, with the radius about the core.
#[derive(Debug, Clone, Copy)]
struct Vertex {
    on_core: Vector,
    on_disc: Vector,
    apart: Vector,
}

/// A shape and a disc with this axis.
struct Body<'s> {
    solid: &'s Solid<'s>,
    disc: &'s FlatDisc,
    out: Vector,
}

impl Solid<'_> {
    /// The lowest place, against `out`, of a shape over a disc with that axis, up to a thousandth of the
    /// radius of the disc. `None` if no part of the shape is over the disc.
    pub(crate) fn lowest_place(&self, disc: &FlatDisc, out: &Vector) -> Option<Lowest> {
        let body = Body { solid: self, disc, out: *out };
        let low = body.vertex(&-out);
        let height = out.dot(&low.apart);
        let across = low.apart - out * height;
        if across.norm_squared() <= disc.radius * disc.radius {
            return Some(Lowest { height, on_disc: disc.centre + across, is_beside: false, other: height });
        }
        let flat = self.lowest_of_face(disc, out);
        flat.or_else(|| self.lowest_of_side(disc, out)).or_else(|| body.lowest(body.about_axis(low)?))
    }

    /// The lowest place if that is on the side of a cylinder: it is that of the capsule about the cylinder,
    /// where this is between the ends.
    fn lowest_of_side(&self, disc: &FlatDisc, out: &Vector) -> Option<Lowest> {
        let [radius, above] = self.round_ends()?;
        if above != radius || self.radius > 0.0 {
            return None;
        }
        let axis = self.axes[1];
        let edge = (axis * self.half.y).into();
        let found = Capsule { centre: self.centre.into(), edge, radius }.over(&Discs::of(disc, out));
        if !found.is_over {
            return None;
        }
        let (on_disc, height) = (Vector::from(found.on_disc), -found.depth);
        let lowest = on_disc + out * height - self.centre;
        let is_between = axis.dot(&lowest).abs() <= self.half.y * (1.0 + 1e-12);
        is_between.then_some(Lowest { height, on_disc, is_beside: false, other: height })
    }

    /// The lowest place if that is on a flat face of a box, a cylinder or a cone: the whole shape is above
    /// it.
    fn lowest_of_face(&self, disc: &FlatDisc, out: &Vector) -> Option<Lowest> {
        /// The cosine of the axes of the face and of the disc below which the face is too steep.
        const STEEP: f64 = 1e-3;
        let ends = self.round_ends();
        let axes = match ends {
            Some(_) => 1..2,
            None if self.is_box() => 0..3,
            None => 0..0,
        };
        for k in axes {
            let rise = out.dot(&self.axes[k]);
            if rise.abs() < STEEP {
                continue;
            }
            // From the face that looks down into the shape.
            let (inwards, rise) = (self.axes[k] * 1.0_f64.copysign(rise), rise.abs());
            let centre = self.centre - inwards * (self.half[k] + self.radius) - disc.centre;
            let across = inwards - out * rise;
            let slope = across.norm();
            // Where the plane of the face is lowest over the disc or, if it is level, near the face's centre.
            let on_disc = if slope > FLAT {
                across * (disc.radius / slope)
            } else {
                let way = centre - out * out.dot(&centre);
                way * (disc.radius / way.norm().max(disc.radius).max(f64::MIN_POSITIVE))
            };
            let height = inwards.dot(&(centre - on_disc)) / rise;
            let on_face = on_disc + out * height - centre;
            let is_on = match ends {
                Some([below, above]) => {
                    let radius = if inwards.dot(&self.axes[k]) > 0.0 { below } else { above };
                    on_face.norm_squared() <= radius * radius
                }
                None => (0..3).all(|j| j == k || on_face.dot(&self.axes[j]).abs() <= self.half[j]),
            };
            if is_on {
                // A radius about the face is above the core on one side.
                let is_beside = self.radius > 0.0 && slope > FLAT;
                return Some(Lowest { height, on_disc: disc.centre + on_disc, is_beside, other: height });
            }
        }
        None
    }
}

impl Body<'_> {
    /// The point of the body that is furthest along `d`.
    fn vertex(&self, d: &Vector) -> Vertex {
        let on_core = self.solid.support(d) - self.disc.centre;
        let on_disc = self.disc.rim(&-d);
        let round =
            if self.solid.radius > 0.0 { d * (self.solid.radius / d.norm()) } else { Vector::zeros() };
        Vertex { on_core, on_disc, apart: on_core + round - on_disc }
    }

    /// Twice the area of the triangle of the axis and two points, seen against the axis; positive if the
    /// second one is to the left.
    fn turn(&self, a: &Vector, b: &Vector) -> f64 {
        self.out.dot(&a.cross(b))
    }

    /// A triangle of points of the body that the axis crosses, anticlockwise. `None` if the axis is beside
    /// the body. `first` is any point of it.
    fn about_axis(&self, first: Vertex) -> Option<[Vertex; 3]> {
        let from = first.apart;
        let towards = self.out * self.out.dot(&from) - from;
        let mut right = self.vertex(&towards);
        if towards.dot(&right.apart) < 0.0 {
            return None;
        }
        // The axis is on the left side of the way to `right`, if `side` is 1.
        let side = 1.0_f64.copysign(self.turn(&(right.apart - from), &-from));
        let mut beyond = None;
        for _ in 0..ROUNDS {
            let across = self.out.cross(&(right.apart - from)) * side;
            let next = self.vertex(&across);
            if across.dot(&next.apart) < 0.0 {
                return None;
            }
            if self.turn(&(next.apart - from), &-from) * side <= 0.0 {
                beyond = Some(next);
                break;
            }
            right = next;
        }
        let mut left = beyond?;
        for _ in 0..ROUNDS {
            // Away from the first point.
            let across = self.out.cross(&(right.apart - left.apart)) * side;
            if across.dot(&right.apart) >= 0.0 {
                return Some(if side > 0.0 { [first, right, left] } else { [first, left, right] });
            }
            let next = self.vertex(&across);
            if across.dot(&next.apart) < 0.0 {
                return None;
            }
            if self.turn(&(next.apart - from), &-from) * side > 0.0 { right = next } else { left = next }
        }
        None
    }

    /// The lowest place, from a triangle of points of the body that the axis crosses. `None` if that has no
    /// area: the body is flat and upright.
    fn lowest(&self, mut corners: [Vertex; 3]) -> Option<Lowest> {
        let other = self.place(&corners)?.height;
        for _ in 0..ROUNDS {
            let [a, b, c] = corners.each_ref().map(|corner| &corner.apart);
            let (ab, ac) = (b - a, c - a);
            // Downwards, as the corners are anticlockwise.
            let down = ac.cross(&ab);
            let area = -self.out.dot(&down);
            if area.is_nan() || area <= NARROW * ab.norm_squared().max(ac.norm_squared()) {
                break;
            }
            let next = self.vertex(&down);
            let below = down.dot(&(next.apart - a)) / area;
            if below <= PRECISION * self.disc.radius {
                break;
            }
            let [of_a, of_b, of_c] = [a, b, c].map(|corner| self.turn(&next.apart, corner));
            corners = if of_a >= 0.0 && of_b <= 0.0 {
                [corners[0], corners[1], next]
            } else if of_b >= 0.0 && of_c <= 0.0 {
                [corners[1], corners[2], next]
            } else {
                [corners[2], corners[0], next]
            };
        }
        Some(Lowest { other, ..self.place(&corners)? })
    }

    /// The place where the axis crosses a triangle.
    fn place(&self, corners: &[Vertex; 3]) -> Option<Lowest> {
        let [a, b, c] = corners.each_ref().map(|corner| &corner.apart);
        let weights = [self.turn(b, c), self.turn(c, a), self.turn(a, b)].map(|weight| weight.max(0.0));
        let sum: f64 = weights.iter().sum();
        if sum.is_nan() || sum <= 0.0 {
            return None;
        }
        let weights = weights.map(|weight| weight / sum);
        let combined = |of: fn(&Vertex) -> &Vector| {
            weights.iter().zip(corners).map(|(&weight, corner)| of(corner) * weight).sum::<Vector>()
        };
        let (on_core, on_disc) = (combined(|it| &it.on_core), combined(|it| &it.on_disc));
        let across_sq = (on_core - self.out * self.out.dot(&on_core)).norm_squared();
        let height = self.out.dot(&combined(|it| &it.apart));
        let is_beside = across_sq > self.disc.radius * self.disc.radius * (1.0 + 1e-6);
        Some(Lowest { height, on_disc: self.disc.centre + on_disc, is_beside, other: height })
    }
}

#[cfg(test)]
mod tests {
    use nearmiss_geometry::Pose;
    use nearmiss_testdata::arbitrary::{point_in, rng, rotation, unit_vector};
    use rand::RngExt;

    use super::*;
    use crate::solid::shape::Shape;

    /// The height at which a line along `out` through `x` enters a shape: the distance is convex along it.
    fn enters(solid: &Solid<'_>, x: &Vector, out: &Vector) -> Option<f64> {
        let apart = |t: f64| solid.distance(&(x + out * t)) - solid.radius;
        let (mut low, mut high) = (-9.0, 9.0);
        for _ in 0..60 {
            let third = (high - low) / 3.0;
            if apart(low + third) <= apart(high - third) { high -= third } else { low += third }
        }
        let inside = 0.5 * (low + high);
        if apart(inside) > 1e-9 {
            return None;
        }
        let (mut out_of, mut inside) = (-9.0, inside);
        for _ in 0..50 {
            let middle = 0.5 * (out_of + inside);
            if apart(middle) > 1e-9 { out_of = middle } else { inside = middle }
        }
        Some(inside)
    }

    /// The lowest place over a disc of those on rings about its centre, and some that are near the best one.
    fn searched(solid: &Solid<'_>, disc: &FlatDisc, out: &Vector, rng: &mut impl rand::Rng) -> Option<f64> {
        let across = out.cross(&Vector::ith(out.iamin(), 1.0)).normalize();
        let other = out.cross(&across);
        let at = |r: f64, angle: f64| {
            enters(
                solid,
                &(disc.centre + (across * angle.cos() + other * angle.sin()) * (r * disc.radius)),
                out,
            )
        };
        let mut best: Option<(f64, f64, f64)> = None;
        let offer = |r: f64, angle: f64, best: &mut Option<(f64, f64, f64)>| {
            if let Some(height) = at(r, angle)
                && best.is_none_or(|(least, ..)| height < least)
            {
                *best = Some((height, r, angle));
            }
        };
        for ring in 0..=3 {
            for turn in 0..8 * ring.max(1) {
                let angle = std::f64::consts::TAU * f64::from(turn) / f64::from(8 * ring.max(1));
                offer(f64::from(ring) / 3.0, angle, &mut best);
            }
        }
        let mut step = 0.5;
        for _ in 0..60 {
            let Some((_, r, angle)) = best else { break };
            let [dr, da] = [0, 1].map(|_| step * rng.random_range(-1.0..1.0));
            offer((r + dr).clamp(0.0, 1.0), angle + da, &mut best);
            step *= 0.93;
        }
        best.map(|(height, ..)| height)
    }

    #[test]
    fn no_place_of_a_shape_over_a_disc_is_lower() {
        let rng = &mut rng(7363);
        let (mut over, mut beside, mut close) = (0, 0, 0);
        for round in 0..1500 {
            let pose = rotation(rng).with_translation(point_in(rng, 0.3));
            let points: Vec<[f64; 3]> = (0..8).map(|_| point_in(rng, 0.8)).collect();
            let [half_height, r] = [0, 1].map(|_| rng.random_range(0.05..0.6));
            let rounding = [0.0, 0.1][round % 2];
            let shape = match round / 2 % 6 {
                0 => Shape::Cylinder { pose, half_height, radius: r, rounding },
                1 => Shape::Cone { pose, half_height, radius: r, rounding },
                2 => Shape::Hull { points: &points, radius: rounding },
                3 => Shape::Triangle { points: [points[0], points[1], points[2]], radius: rounding },
                4 => Shape::Box { pose, half: [half_height, r, 0.2], radius: rounding },
                _ => Shape::Hull { points: &points[..4], radius: rounding },
            };
            let solid = Solid::new(&shape, &Pose::IDENTITY).unwrap();
            // Along an axis of the shape, or any.
            let out = if round % 5 == 0 { solid.axes[1] } else { unit_vector(rng).into() };
            let disc_radius = [0.02, 0.2, 0.6][round % 3];
            let disc = FlatDisc { centre: point_in(rng, 0.7).into(), normal: out, radius: disc_radius };
            let (found, expected) = (solid.lowest_place(&disc, &out), searched(&solid, &disc, &out, rng));
            let Some(found) = found else {
                beside += 1;
                assert_eq!(expected, None, "round {round}: {shape:?} {disc:?}");
                continue;
            };
            over += 1;
            let off = found.on_disc - disc.centre;
            assert!(off.norm() <= disc_radius * (1.0 + 1e-9) && out.dot(&off).abs() <= 1e-9);
            let height = enters(&solid, &found.on_disc, &out);
            assert!(
                solid.distance(&(found.on_disc + out * found.height)) <= solid.radius + 1e-6,
                "round {round}: {found:?} is outside {shape:?} {disc:?}, {height:?}"
            );
            if let Some(expected) = expected {
                assert!(
                    found.height <= expected + 1.1e-3 * disc_radius,
                    "round {round}: {found:?}, expected {expected}: {shape:?} {disc:?}"
                );
                close += usize::from(found.height > expected - 0.05 * disc_radius);
            }
        }
        assert!(
            over > 600 && beside > 200 && close * 10 > over * 9,
            "{over} over, {beside} beside, {close} close"
        );
    }
}
