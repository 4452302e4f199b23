//! The lowest place of a box over a disc.

use nearmiss_geometry::nalgebra::Vector3;

use crate::leaf::disc_triangle::FlatDisc;
use crate::solid::core::Solid;

type Vector = Vector3<f64>;

/// The signs of the edges along an axis that may be lowest, times those of the lowest edge. The fourth edge
/// is between two faces that look up.
const EDGES: [[f64; 2]; 3] = [[1.0, 1.0], [-1.0, 1.0], [1.0, -1.0]];

impl Solid<'_> {
    /// The lowest place, against `out`, of a core that is a box within the cylinder over a disc with that
    /// axis. `None` if the core is something else, or is beside the cylinder.
    pub(crate) fn lowest_over(&self, disc: &FlatDisc, out: &Vector) -> Option<Vector> {
        if self.is_segment() || !self.is_box() {
            return None;
        }
        // In the frame of the box.
        let own = |v: &Vector| Vector::from(self.axes.map(|axis| axis.dot(v)));
        let place = lowest_of_box(&self.half, (own(&(disc.centre - self.centre)), disc.radius), own(out))?;
        Some((0..3).fold(self.centre, |x, k| x + self.axes[k] * place[k]))
    }
}

/// The lowest place, against `out`, of a box about the origin over a disc, given by its centre and radius:
/// where a face that looks down is lowest, or on an edge.
fn lowest_of_box(half: &Vector, (disc, radius): (Vector, f64), out: Vector) -> Option<Vector> {
    /// Slopes below this are level.
    const LEVEL: f64 = 1e-12;
    // From the axis of the cylinder to the centre of the box.
    let away = out * out.dot(&disc) - disc;
    // The squares of the parts of the axes across the disc. Differences from one would lose what is small.
    let squares = Vector::from([0, 1, 2].map(|k| {
        let (a, b) = (out[(k + 1) % 3], out[(k + 2) % 3]);
        a * a + b * b
    }));
    // The face across axis k that looks down, at the place of the rim where it is lowest. The box is above
    // the plane of the face, so no other place is lower.
    for k in 0..3 {
        let (steep, slope) = (out[k].abs(), squares[k].sqrt());
        if steep <= LEVEL {
            continue;
        }
        let side = -1.0_f64.copysign(out[k]);
        let mut beside = away;
        if slope > LEVEL {
            beside += out * (steep * radius / slope);
            beside[k] = away[k] + side * slope * radius;
        }
        let place = out * ((half[k] + side * beside[k]) / -steep) - beside;
        let is_on = |m: usize| place[m].abs() <= half[m];
        if is_on((k + 1) % 3) && is_on((k + 2) % 3) {
            return Some(place);
        }
    }
    lowest_of_edges(half, (&away, radius), (&out, &squares))
}

/// The lowest place over a disc of this radius on an edge of a box. `away` is across the disc from its centre
/// to that of the box, and `squares` are those of the parts of the axes across the disc.
fn lowest_of_edges(
    half: &Vector,
    (away, radius): (&Vector, f64),
    (out, squares): (&Vector, &Vector),
) -> Option<Vector> {
    // A height over the centre of the box, and the place in half edges from there.
    let mut best: Option<(f64, Vector)> = None;
    let (climbs, along) = (out.component_mul(half), away.component_mul(half));
    let edges = squares.component_mul(half).component_mul(half);
    let beyond = away.norm_squared() - radius * radius;
    let low = out.map(|rise| -1.0_f64.copysign(rise));
    for [a, b] in EDGES {
        for k in 0..3 {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            let (a, b) = (a * low[i], b * low[j]);
            let middle = climbs[i] * a + climbs[j] * b;
            if best.is_some_and(|(least, _)| middle - climbs[k].abs() >= least) {
                continue;
            }
            // The square of the distance from the axis, less that of the radius, along the edge.
            let sides = a * along[i] + b * along[j] - a * b * climbs[i] * climbs[j];
            let c = beyond + edges[i] + edges[j] + 2.0 * sides;
            let h = along[k] - climbs[k] * middle;
            let Some([low, high]) = least_range(edges[k], h, c) else { continue };
            let mut place = Vector::zeros();
            (place[i], place[j], place[k]) = (a, b, if out[k] < 0.0 { high } else { low });
            let height = middle + climbs[k] * place[k];
            if best.is_none_or(|(least, _)| height < least) {
                best = Some((height, place));
            }
        }
    }
    best.map(|(_, place)| place.component_mul(half))
}

/// The part of −1..1 in which a x² + 2 h x + c is not positive, for a ≥ 0.
fn least_range(a: f64, h: f64, c: f64) -> Option<[f64; 2]> {
    if a == 0.0 {
        return (c <= 0.0).then_some([-1.0, 1.0]);
    }
    let square = h * h - a * c;
    let root = if square >= 0.0 { square.sqrt() } else { return None };
    let (low, high) = (((-h - root) / a).max(-1.0), ((-h + root) / a).min(1.0));
    (low <= high).then_some([low, high])
}

#[cfg(test)]
mod tests {
    use nearmiss_geometry::Pose;
    use nearmiss_testdata::arbitrary::{point_in, rng, rotation, unit_vector};
    use rand::RngExt;

    use super::*;
    use crate::solid::shape::Shape;

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
            let (found, expected) = (solid.lowest_over(&disc, &out), sampled(&solid, &disc, out));
            let Some(lowest) = found else {
                beside += 1;
                assert_eq!(expected, None, "round {round}: {solid:?} {disc:?}");
                continue;
            };
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
