//! The least shift of one of two convex shapes after which they only touch.

use nearmiss_geometry::nalgebra::Vector3;

use crate::solid::closest::closest;
use crate::solid::core::Solid;
use crate::solid::inner::inner_depth;

type Vector = Vector3<f64>;

/// The least shift of the second of two convex shapes after which they only touch.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Overlap {
    /// A lower bound of its length; negative if the shapes are apart.
    pub(crate) lower: f64,
    /// A length that is enough, along `way`.
    pub(crate) upper: f64,
    /// A unit vector.
    pub(crate) way: Vector,
}

/// Bounds the least shift of `b` after which it only touches `a`.
///
/// The differences of points of b and of a are a convex set K. Both meet if the origin is in K grown by
/// both radii, and the least shift is the distance of the origin from the boundary of that. If the cores are
/// apart, it is the radii less the distance of the cores. Otherwise it is the radii and the depth of the
/// origin in K ([`inner_depth`]), which is 0 if K is flat. A shift by the extent of K along any direction is
/// enough, so the upper bound is the least of a few directions.
pub(crate) fn overlap(a: &Solid<'_>, b: &Solid<'_>) -> Overlap {
    let radii = a.radius + b.radius;
    let origin = a.centre;
    let points = |d: &Vector| [a.support(&-d) - origin, b.support(d) - origin];
    let support = |d: &Vector| {
        let [on_a, on_b] = points(d);
        on_b - on_a
    };
    let apart = closest(|d| points(&-d), a.inside - b.inside, [0.0, f64::INFINITY]);
    let size = a.half.amax() + b.half.amax();
    let between = (apart.points[1] - apart.points[0]).try_normalize(0.0).unwrap_or_else(Vector::zeros);
    if apart.distance > 1e-9 * size {
        let upper = enough(a, b, &between);
        return Overlap { lower: (radii - apart.distance).min(upper), upper, way: between };
    }
    let (depth, normal) = inner_depth(support, size);
    // The origin may be beside K, by less than the tolerance.
    let depth = if depth > 0.0 { depth } else { -apart.distance };
    let mut best = Overlap { lower: radii + depth, upper: f64::INFINITY, way: Vector::z() };
    let edges = a.axes.iter().flat_map(|x| b.axes.iter().map(|y| x.cross(y)));
    for way in [normal, between].into_iter().chain(a.axes).chain(b.axes).chain(edges) {
        let Some(way) = way.try_normalize(1e-9) else { continue };
        for way in [way, -way] {
            let upper = enough(a, b, &way);
            if upper < best.upper {
                (best.upper, best.way) = (upper, way);
            }
        }
    }
    best.lower = best.lower.min(best.upper);
    best
}

/// The length of the shift of `b` along a unit vector after which a plane across it separates the shapes.
pub(crate) fn enough(a: &Solid<'_>, b: &Solid<'_>, way: &Vector) -> f64 {
    a.radius + b.radius + way.dot(&(a.support(way) - b.support(&-way)))
}

#[cfg(test)]
mod tests {
    use nearmiss_geometry::Pose;
    use nearmiss_testdata::arbitrary::{point_in, rng, rotation, unit_vector};
    use rand::RngExt;

    use super::*;
    use crate::solid::between::gap;
    use crate::solid::shape::Shape;

    fn solid<'s>(shape: &Shape<'s>) -> Solid<'s> {
        Solid::new(shape, &Pose::IDENTITY).expect("a valid shape")
    }

    /// Shorter shifts, in any direction, leave the shapes in contact; the shift separates them.
    #[test]
    fn shorter_shifts_leave_shapes_in_contact() {
        let rng = &mut rng(5208);
        let (mut deep, mut close) = (0, 0);
        for round in 0..3000_u32 {
            let corners: Vec<[f64; 3]> = (0..6).map(|_| point_in(rng, 1.0)).collect();
            let own: Vec<[f64; 3]> = (0..6).map(|_| point_in(rng, 1.0)).collect();
            let pose = rotation(rng).with_translation(point_in(rng, 1.0));
            let half = [0, 1, 2].map(|_| rng.random_range(0.05..1.0));
            let radius = if rng.random() { 0.0 } else { rng.random_range(0.0..0.4) };
            let of = |kind: u32, corners: &'_ [[f64; 3]]| match kind % 6 {
                0 => Shape::Sphere { centre: corners[0], radius: 0.3 + radius },
                1 => Shape::Capsule { ends: [corners[0], corners[1]], radius },
                2 => Shape::Box { pose, half, radius },
                3 => Shape::Cylinder { pose, half_height: half[0], radius: half[1], rounding: radius },
                _ => Shape::Triangle { points: [corners[0], corners[1], corners[2]], radius },
            };
            let hull = Shape::Hull { points: &own, radius };
            let (a, b) = (solid(&of(round, &corners)), solid(&of(round / 6, &own)));
            let (a, b) = if round % 7 == 0 { (a, solid(&hull)) } else { (a, b) };
            let Overlap { lower, upper, way } = overlap(&a, &b);
            assert!(lower <= upper, "{a:?} {b:?}");
            assert!(
                gap(&a, &b.shifted(&(way * (upper.max(0.0) + 1e-6)))).lower > 0.0,
                "{upper} is not enough: {a:?} {b:?}",
            );
            if lower <= 1e-6 {
                continue;
            }
            deep += 1;
            close += u32::from(upper - lower < 0.02 * upper + 1e-6);
            for _ in 0..10 {
                let t = Vector::from(unit_vector(rng)) * (lower - 1e-7);
                assert!(gap(&a, &b.shifted(&t)).upper < 1e-9, "{lower} separates: {a:?} {b:?}");
            }
        }
        assert!(deep > 800 && close * 50 > deep * 49, "{deep} deep, {close} close");
    }
}
