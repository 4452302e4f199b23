//! Upper bounds on the depths of a shape over the discs of a leaf, sixteen at a time, in single
//! precision.
//!
//! The depth over a disc is how far the shape reaches below the plane of the disc, within the cylinder
//! over it. Bounds are the lowest place of the whole shape; the planes of the faces of its box, where these
//! are over the disc; and, for a segment with a radius, the part of the radius that is left at the distance
//! of the disc from the segment's shadow on its plane. Cores that are no boxes are over a disc only if the
//! disc is not beyond the plane across the way to it. On a surface the bounds are tight up to the bend of the
//! surface within a disc, so few depths have to be computed.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, mask32x16};
use nearmiss_lanes::wide::{Vectors, along, product, squared};

use crate::solid::core::LaneCore;
use crate::solid::lanes::{LEVEL, LaneBox};

/// The cosine below which the plane of a face is too steep to bound the depth over a disc across it.
const STEEP: f32 = 0.1;

/// The discs of sixteen points, relative to the centre of a shape's box.
#[derive(Clone, Copy)]
pub(crate) struct LaneDiscs<S: Simd> {
    pub(crate) centres: Vectors<S>,
    /// Unit normals, on the side to which the shape moves out.
    pub(crate) out: Vectors<S>,
    pub(crate) radii: f32x16<S>,
    /// The errors of heights.
    pub(crate) slack: f32x16<S>,
}

impl LaneBox<'_> {
    /// Upper bounds on the depths of a shape with this box and this radius over discs. Negative infinity
    /// where no part of the shape is over the disc. O(1), or O(n) for a hull of n corners.
    #[inline(always)]
    pub(crate) fn depths<S: Simd>(&self, simd: S, discs: &LaneDiscs<S>, radius: f32) -> f32x16<S> {
        if !self.is_near {
            return f32x16::splat(simd, f32::INFINITY);
        }
        // Not a closure, which would be compiled without the vector instructions.
        let [x, y, z] = self.axes;
        let rises = [along(discs.out, x), along(discs.out, y), along(discs.out, z)];
        let mut reach = f32x16::splat(simd, 0.0);
        for k in 0..3 {
            reach += rises[k].abs() * self.half[k];
        }
        // The height of the disc's plane over the centre of the box.
        let height = product(discs.centres, discs.out);
        if self.is_segment {
            self.over_segment(simd, discs, (rises[0], reach, height), radius)
        } else if let LaneCore::Box = self.core {
            self.over_box(simd, discs, (rises, reach, height), radius)
        } else {
            let [x, y, z] = discs.out;
            let reach = reach.min(self.core.extents(simd, [-x, -y, -z]));
            let most = self.over_box(simd, discs, (rises, reach, height), radius);
            is_beside(simd, discs, height, (self.core, radius))
                .select(f32x16::splat(simd, f32::NEG_INFINITY), most)
        }
    }

    #[inline(always)]
    fn over_box<S: Simd>(
        &self,
        simd: S,
        discs: &LaneDiscs<S>,
        (rises, reach, height): ([f32x16<S>; 3], f32x16<S>, f32x16<S>),
        radius: f32,
    ) -> f32x16<S> {
        let (zero, none) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, f32::INFINITY));
        let mut most = reach + height + discs.slack + radius;
        for k in 0..3 {
            let (rise, at) = (rises[k], along(discs.centres, self.axes[k]));
            let cosine = rise.abs();
            let is_steep: mask32x16<S> = cosine.simd_lt(STEEP);
            // The face that looks down.
            let is_upper: mask32x16<S> = rise.simd_gt(zero);
            let beyond = is_upper.select(at, -at) + (self.half[k] + radius);
            let slope = ((1.0 - rise * rise).max(zero) + LEVEL).sqrt();
            // Negative if the disc is outside the face.
            let within = beyond + discs.radii * slope + discs.slack;
            let is_outside: mask32x16<S> = within.simd_lt(zero);
            let by_face = within / cosine.max(STEEP);
            most = most.min((is_steep & !is_outside).select(none, by_face));
        }
        most
    }

    #[inline(always)]
    fn over_segment<S: Simd>(
        &self,
        simd: S,
        discs: &LaneDiscs<S>,
        (rise, reach, height): (f32x16<S>, f32x16<S>, f32x16<S>),
        radius: f32,
    ) -> f32x16<S> {
        let zero = f32x16::splat(simd, 0.0);
        let least = f32x16::splat(simd, f32::NEG_INFINITY);
        let axis = self.axes[0];
        let at = along(discs.centres, axis);
        let [x, y, z] = discs.centres;
        // From the axis to the disc, which cancels less than what is far along the axis.
        let away = [x - at * axis[0], y - at * axis[1], z - at * axis[2]];
        let up = product(away, discs.out);
        // The length of the axis' shadow, and the disc's distances from the shadow and along it.
        let shadow = (1.0 - rise * rise).max(zero).sqrt();
        let is_steep: mask32x16<S> = shadow.simd_lt(STEEP);
        let across = up / shadow.max(STEEP);
        let beside = (squared(away) - across * across).max(zero).sqrt();
        let beside = is_steep.select(zero, (beside - discs.radii - discs.slack).max(zero));
        let radial = (squared(discs.centres) - height * height).max(zero).sqrt();
        let place = (at - height * rise) / shadow.max(STEEP);
        let along_it = is_steep.select(radial, place.abs());
        let slack = discs.slack / shadow.max(STEEP);
        let beyond = (along_it - discs.radii - slack - shadow * self.half[0]).max(zero);
        // Half the height of the shape over a place at that distance from the shadow.
        let across_left_sq = radius * radius - beside * beside;
        let left_sq = across_left_sq - beyond * beyond;
        let is_over: mask32x16<S> = left_sq.simd_ge(zero);
        let by_end = reach + height + discs.slack + left_sq.max(zero).sqrt();
        // Seen along its axis, the shape is a circle.
        let left = across_left_sq.max(zero).sqrt();
        let by_side = (left * shadow + up + discs.slack + discs.radii * rise.abs() * shadow)
            / (shadow * shadow).max(STEEP * STEEP);
        let by_side = is_steep.select(by_end, by_side);
        is_over.select(by_end.min(by_side), least)
    }
}

/// The lanes whose disc is beside the core, seen along the axis of the disc: beyond the plane across the way
/// from the centre of the core.
#[inline(always)]
fn is_beside<S: Simd>(
    simd: S,
    discs: &LaneDiscs<S>,
    height: f32x16<S>,
    (core, radius): (LaneCore<'_>, f32),
) -> mask32x16<S> {
    let ([x, y, z], [a, b, c]) = (discs.centres, discs.out);
    // Stored normals are not quite of unit length.
    let share = height / squared(discs.out);
    let across = [x - share * a, y - share * b, z - share * c];
    let away = squared(across).sqrt();
    let per_unit = 1.0 / away.max(f32::MIN_POSITIVE);
    let [x, y, z] = across;
    let towards = core.extents(simd, [x * per_unit, y * per_unit, z * per_unit]);
    (away - 2.0 * discs.slack).simd_gt(towards + discs.radii + radius)
}

#[cfg(test)]
mod tests {
    use fearless_simd::dispatch;
    use nearmiss_geometry::Pose;
    use nearmiss_geometry::nalgebra::Vector3;
    use nearmiss_testdata::arbitrary::{point_in, rng, rotation, unit_vector};
    use nearmiss_testdata::instructions::levels;
    use rand::RngExt;

    use super::*;
    use crate::solid::core::Solid;
    use crate::solid::shape::Shape;

    type Vector = Vector3<f64>;

    /// The greatest t for which `x` − t `out` is in the shape: the distance from the core is convex along
    /// the line.
    fn depth_below(solid: &Solid<'_>, x: Vector, out: Vector) -> Option<f64> {
        let apart = |t: f64| solid.distance(&(x - out * t)) - solid.radius;
        let (mut low, mut high) = (-10.0, 10.0);
        for _ in 0..100 {
            let [p, q] = [low + (high - low) / 3.0, high - (high - low) / 3.0];
            if apart(p) < apart(q) { high = q } else { low = p }
        }
        let inside = 0.5 * (low + high);
        if apart(inside) > 1e-9 {
            return None;
        }
        let (mut low, mut high) = (inside, 10.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if apart(middle) > 1e-9 { high = middle } else { low = middle }
        }
        Some(low)
    }

    /// The greatest depth over places of a disc.
    fn sampled(solid: &Solid<'_>, centre: Vector, out: Vector, radius: f64) -> Option<f64> {
        let across = out.cross(&Vector::ith(out.iamin(), 1.0)).normalize();
        let other = out.cross(&across);
        let places = (0..=4).flat_map(|ring| (0..16).map(move |turn| (ring, turn)));
        let depths = places.filter_map(|(ring, turn)| {
            let (angle, r) = (std::f64::consts::TAU * f64::from(turn) / 16.0, radius * f64::from(ring) / 4.0);
            depth_below(solid, centre + (across * angle.cos() + other * angle.sin()) * r, out)
        });
        depths.reduce(f64::max)
    }

    #[test]
    fn depths_are_bounded_closely_by_any_instructions() {
        let rng = &mut rng(5);
        const KINDS: usize = 9;
        let (mut over, mut loose, mut left_out) = ([0; KINDS], [0.0; KINDS], [0; KINDS]);
        for round in 0..120 {
            let pose = rotation(rng).with_translation(point_in(rng, 1.0));
            let end = [0, 1, 2].map(|k| pose.translation()[k] + point_in(rng, 1.0)[k]);
            let kind = round % KINDS;
            let points: Vec<[f64; 3]> = (0..7).map(|_| point_in(rng, 0.5)).collect();
            let points: Vec<[f64; 3]> = points.iter().map(|&p| pose.apply(p)).collect();
            let shape = match kind {
                0 => Shape::Sphere { centre: pose.translation(), radius: 0.4 },
                1 => Shape::Capsule { ends: [pose.translation(), end], radius: 0.3 },
                2 => Shape::Box { pose, half: [0.5, 0.3, 0.1], radius: 0.0 },
                3 => Shape::Box { pose, half: [0.3, 0.3, 0.05], radius: 0.1 },
                4 => Shape::Cylinder { pose, half_height: 0.3, radius: 0.2, rounding: 0.0 },
                5 => Shape::Cone { pose, half_height: 0.3, radius: 0.3, rounding: 0.05 },
                6 => Shape::Hull { points: &points, radius: 0.05 },
                7 => Shape::Triangle { points: [points[0], points[1], points[2]], radius: 0.02 },
                // A pole.
                _ => Shape::Cylinder { pose, half_height: 3.0, radius: 0.01, rounding: 0.0 },
            };
            let solid = Solid::new(&shape, &Pose::IDENTITY).unwrap();
            let mut corners = Vec::new();
            let lane_box = LaneBox::new(&solid, 2.0, solid.lane_core(&mut corners));
            let discs: [(Vector, Vector, f64); 16] = [(); 16].map(|()| {
                let mut out = Vector::from(unit_vector(rng));
                let mut size = 0.5;
                if kind == KINDS - 1 {
                    // A pole stands on the disc and leans.
                    (out, size) = ((solid.axes[1] + out * 0.02).normalize(), 0.03);
                }
                // Most discs are near the lowest place of the shape.
                let near = solid.support(&-out) - out * solid.radius;
                // Stored normals are off by up to a step.
                let out = out.map(|x| (x * 32767.0).floor() / 32767.0);
                (near + Vector::from(point_in(rng, size)), out, size * rng.random_range(0.04..0.4))
            });
            for level in levels() {
                let found = dispatch!(level, simd => {
                    let each = |of: &dyn Fn(&(Vector, Vector, f64)) -> f64| {
                        #[expect(clippy::cast_possible_truncation, reason = "single precision")]
                        f32x16::load_array(simd, discs.each_ref().map(|disc| of(disc) as f32))
                    };
                    let centres = [0, 1, 2].map(|k| each(&|disc| disc.0[k] - solid.centre[k]));
                    let out = [0, 1, 2].map(|k| each(&|disc| disc.1[k]));
                    let slack = f32x16::splat(simd, 2e-4);
                    let discs = LaneDiscs { centres, out, radii: each(&|disc| disc.2), slack };
                    #[expect(clippy::cast_possible_truncation, reason = "single precision")]
                    lane_box.depths(simd, &discs, solid.radius as f32).to_array()
                });
                for (&(centre, out, radius), bound) in discs.iter().zip(found) {
                    left_out[kind] += usize::from(bound == f32::NEG_INFINITY);
                    let Some(depth) = sampled(&solid, centre, out.normalize(), radius) else { continue };
                    let bound = f64::from(bound);
                    assert!(
                        bound >= depth - 1e-5,
                        "{shape:?}: bound {bound} of depth {depth}, {centre} {out} {radius}"
                    );
                    over[kind] += 1;
                    loose[kind] += (bound - depth) / radius;
                }
            }
        }
        let mean: Vec<f64> = loose.iter().zip(over).map(|(sum, count)| sum / f64::from(count)).collect();
        // Bounds of cones and hulls tell only the lowest point of the whole shape. The last kind, the pole,
        // has no limit.
        let most = [0.3, 0.3, 0.3, 0.4, 0.5, 1.3, 1.8, 0.5];
        assert!(
            mean.iter().zip(most).all(|(&mean, most)| mean < most),
            "bounds exceed depths by {mean:?} radii"
        );
        assert!(left_out[4..].iter().all(|&count| count > 50), "{left_out:?} left out");
    }
}
