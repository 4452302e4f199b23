//! The lowest place of a box over a disc. The same code computes one place, or eight in SIMD lanes.

use nearmiss_lanes::lane::{Lane, difference, dot, sum};

use crate::solid::core::Solid;
use crate::solid::discs::{Discs, Over};

/// The signs of the edges along an axis that may be lowest, times those of the lowest edge. The fourth edge
/// is between two faces that look up.
const EDGES: [[f64; 2]; 3] = [[1.0, 1.0], [-1.0, 1.0], [1.0, -1.0]];

/// Slopes below this are level.
const LEVEL: f64 = 1e-12;

/// A box without a radius: its centre, its axes and half its lengths.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SharpBox {
    pub(crate) centre: [f64; 3],
    pub(crate) axes: [[f64; 3]; 3],
    pub(crate) half: [f64; 3],
}

/// Discs in the frame of a box.
struct Seen<L> {
    out: [L; 3],
    radius: L,
    /// The way across each disc from its centre to that of the box.
    away: [L; 3],
    /// The squares of the parts of the axes across the disc. Differences from one would lose what is small.
    squares: [L; 3],
}

impl SharpBox {
    /// The core of a shape that is a box.
    pub(crate) fn of(solid: &Solid<'_>) -> Self {
        let axes = solid.axes.map(Into::into);
        Self { centre: solid.centre.into(), axes, half: solid.half.into() }
    }

    /// The deepest places over discs.
    #[inline(always)]
    pub(crate) fn over<L: Lane>(&self, discs: &Discs<L>) -> Over<L> {
        let (centre, out, radius) = (self.seen(discs.centre), self.turned(discs.out), discs.radius);
        let [x, y, z] = out;
        let away = difference(dot(out, centre).scale_all(out), centre);
        let squares = [y * y + z * z, z * z + x * x, x * x + y * y];
        let seen = Seen { out, radius, away, squares };
        let (mut is_over, mut lowest) = self.lowest_of_faces(&seen);
        if L::any(!is_over) {
            let (is_on_edge, on_edges) = self.lowest_of_edges(&seen, !is_over);
            lowest = L::select_all(is_over, lowest, on_edges);
            is_over = is_over | is_on_edge;
        }
        let height = dot(out, difference(lowest, centre));
        let foot = difference(lowest, height.scale_all(out));
        let mut beyond = foot;
        let mut on_disc = radius.splat_all(self.centre);
        for k in 0..3 {
            beyond[k] = (foot[k].abs() - self.half[k]).greater(radius.splat(0.0));
            on_disc = sum(on_disc, foot[k].scale_all(radius.splat_all(self.axes[k])));
        }
        // The core ends at the surface of the shape, so a place over the disc is one of the core.
        let is_beside = radius.nowhere();
        Over { is_over, on_disc, depth: -height, is_beside, apart: dot(beyond, beyond).sqrt() }
    }

    /// A place in the frame of the box.
    #[inline(always)]
    fn seen<L: Lane>(&self, place: [L; 3]) -> [L; 3] {
        self.turned(difference(place, place[0].splat_all(self.centre)))
    }

    /// A direction in the frame of the box.
    #[inline(always)]
    fn turned<L: Lane>(&self, v: [L; 3]) -> [L; 3] {
        let [x, y, z] = self.axes;
        let splat = |axis: [f64; 3]| v[0].splat_all(axis);
        [dot(splat(x), v), dot(splat(y), v), dot(splat(z), v)]
    }

    /// The lowest places that are on faces that look down, and where there are any.
    #[inline(always)]
    fn lowest_of_faces<L: Lane>(&self, seen: &Seen<L>) -> (L::Mask, [L; 3]) {
        let &Seen { out, radius, away, squares } = seen;
        let (zero, one, level) = (radius.splat(0.0), radius.splat(1.0), radius.splat(LEVEL));
        let mut is_found = zero.nowhere();
        let mut lowest = [zero; 3];
        // The face across axis k that looks down, at the place of the rim where it is lowest. The box is
        // above the plane of the face, so no other place is lower.
        for k in 0..3 {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            let (steep, slope) = (out[k].abs(), squares[k].sqrt());
            let side = L::select(zero.is_less(out[k]), -one, one);
            let is_sloped = level.is_less(slope);
            let tilted = L::select(is_sloped, steep * radius / slope, zero);
            let mut beside = sum(away, tilted.scale_all(out));
            beside[k] = L::select(is_sloped, away[k] + side * slope * radius, away[k]);
            let climb = (side * beside[k] + self.half[k]) / -steep;
            let place = difference(climb.scale_all(out), beside);
            let is_on = level.is_less(steep)
                & place[i].abs().is_at_most(radius.splat(self.half[i]))
                & place[j].abs().is_at_most(radius.splat(self.half[j]));
            lowest = L::select_all(is_found | !is_on, lowest, place);
            is_found = is_found | is_on;
            if !L::any(!is_found) {
                break;
            }
        }
        (is_found, lowest)
    }

    /// The lowest places on edges where `is_wanted`, and where there are any.
    #[inline(always)]
    fn lowest_of_edges<L: Lane>(&self, seen: &Seen<L>, is_wanted: L::Mask) -> (L::Mask, [L; 3]) {
        let &Seen { out, radius, away, squares } = seen;
        let (zero, one) = (radius.splat(0.0), radius.splat(1.0));
        let (mut climbs, mut along, mut edges, mut low) = (out, away, squares, out);
        for k in 0..3 {
            let half = self.half[k];
            (climbs[k], along[k], edges[k]) = (out[k] * half, away[k] * half, squares[k] * half * half);
            low[k] = L::select(zero.is_less(out[k]), -one, one);
        }
        let beyond = dot(away, away) - radius * radius;
        // Heights over the centre of the box, and the places in half edges from there.
        let (mut least, mut lowest) = (radius.splat(f64::INFINITY), [zero; 3]);
        let mut is_found = zero.nowhere();
        for [a, b] in EDGES {
            for k in 0..3 {
                let (i, j) = ((k + 1) % 3, (k + 2) % 3);
                let (a, b) = (low[i] * a, low[j] * b);
                let middle = climbs[i] * a + climbs[j] * b;
                let is_open = is_wanted & (middle - climbs[k].abs()).is_less(least);
                if !L::any(is_open) {
                    continue;
                }
                // The square of the distance from the axis, less that of the radius, along the edge.
                let sides = a * along[i] + b * along[j] - a * b * climbs[i] * climbs[j];
                let c = beyond + edges[i] + edges[j] + sides * 2.0;
                let h = along[k] - climbs[k] * middle;
                let (is_there, ends) = least_range(edges[k], h, c);
                let mut place = [zero; 3];
                (place[i], place[j]) = (a, b);
                place[k] = L::select(out[k].is_less(zero), ends[1], ends[0]);
                let height = middle + climbs[k] * place[k];
                let is_lower = is_open & is_there & height.is_less(least);
                least = L::select(is_lower, height, least);
                lowest = L::select_all(is_lower, place, lowest);
                is_found = is_found | is_lower;
            }
        }
        for k in 0..3 {
            lowest[k] = lowest[k] * self.half[k];
        }
        (is_found, lowest)
    }
}

/// The parts of −1..1 in which a x² + 2 h x + c is not positive, for a ≥ 0, and where there is one.
#[inline(always)]
fn least_range<L: Lane>(a: L, h: L, c: L) -> (L::Mask, [L; 2]) {
    let (zero, one) = (a.splat(0.0), a.splat(1.0));
    let is_curved = zero.is_less(a);
    let square = h * h - a * c;
    let root = square.greater(zero).sqrt();
    let low = L::select(is_curved, ((-h - root) / a).greater(-one), -one);
    let high = L::select(is_curved, -((h - root) / a).greater(-one), one);
    let is_there = is_curved & zero.is_at_most(square) & low.is_at_most(high);
    (is_there | (!is_curved & c.is_at_most(zero)), [low, high])
}

#[cfg(test)]
mod tests {
    use nearmiss_geometry::Pose;
    use nearmiss_geometry::nalgebra::Vector3;
    use nearmiss_testdata::arbitrary::{point_in, rng, rotation, unit_vector};
    use rand::RngExt;

    use super::*;
    use crate::leaf::disc_triangle::FlatDisc;
    use crate::solid::shape::Shape;

    type Vector = Vector3<f64>;

    /// The lowest height of a box over a disc, on lines through the cylinder in rings about its axis. A line
    /// is in the box where it is between the planes of all faces.
    fn sampled(solid: &Solid<'_>, disc: &FlatDisc, out: Vector) -> Option<f64> {
        let across = out.cross(&Vector::ith(out.iamin(), 1.0)).normalize();
        let other = out.cross(&across);
        let places = (0..=20).flat_map(|ring| (0..120).map(move |turn| (f64::from(ring) / 20.0, turn)));
        let heights = places.filter_map(|(share, turn)| {
            let angle = std::f64::consts::TAU * f64::from(turn) / 120.0;
            let at = (across * angle.cos() + other * angle.sin()) * (disc.radius * share);
            let from = disc.centre + at - solid.centre;
            let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
            for k in 0..3 {
                let (place, slope) = (solid.axes[k].dot(&from), solid.axes[k].dot(&out));
                let ends = [-solid.half[k], solid.half[k]].map(|end| (end - place) / slope);
                if slope.abs() > 1e-15 {
                    (low, high) = (low.max(ends[0].min(ends[1])), high.min(ends[0].max(ends[1])));
                } else if place.abs() > solid.half[k] {
                    return None;
                }
            }
            (low <= high).then_some(low)
        });
        heights.reduce(f64::min)
    }

    /// The lowest place is in the core and over the disc, and no other one is lower.
    #[test]
    fn no_place_over_a_disc_is_lower() {
        let rng = &mut rng(7355);
        let (mut over, mut beside, mut close) = (0, 0, 0);
        for round in 0..6000 {
            let pose = rotation(rng).with_translation(point_in(rng, 0.5));
            let mut half = [0, 1, 2].map(|_| rng.random_range(0.01..1.0));
            if round % 7 == 0 {
                half[round % 3] = 0.0;
            }
            let solid = Solid::new(&Shape::Box { pose, half, radius: 0.0 }, &Pose::IDENTITY).unwrap();
            // Level with a face, along an edge, or any.
            let out = match round % 5 {
                0 => solid.axes[round % 3] * [1.0, -1.0][round % 2],
                1 => (solid.axes[0] + solid.axes[1] * rng.random_range(-1.0..1.0)).normalize(),
                _ => Vector::from(unit_vector(rng)),
            };
            let radius = [0.02, 0.2, 1.0][round % 3];
            let disc = FlatDisc { centre: point_in(rng, 1.0).into(), normal: out, radius };
            let height = |x: &Vector| out.dot(&(x - disc.centre));
            let found = SharpBox::of(&solid).over(&Discs::of(&disc, &out));
            let expected = sampled(&solid, &disc, out);
            let lowest = Vector::from(found.on_disc) - out * found.depth;
            if !found.is_over {
                beside += 1;
                assert_eq!(expected, None, "round {round}: {solid:?} {disc:?}");
                continue;
            }
            over += 1;
            assert!(solid.distance(&lowest) < 1e-12, "round {round}: {solid:?} {disc:?} {lowest}");
            let away = (lowest - disc.centre - out * height(&lowest)).norm();
            assert!(away <= radius + 1e-7, "round {round}: {away} {solid:?} {disc:?} {lowest}");
            if let Some(least) = expected {
                assert!(
                    height(&lowest) <= least + 1e-9,
                    "round {round}: {solid:?} {disc:?} {lowest} {least}"
                );
                close += usize::from(height(&lowest) > least - 0.05 * radius);
            }
        }
        assert!(over > 2000 && beside > 1000 && close > 1500, "{over} over, {beside} beside, {close} close");
    }
}
