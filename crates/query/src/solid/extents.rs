//! Orthonormal frames, points that are furthest along a direction, and boxes about points.

use nearmiss_geometry::nalgebra::Vector3;

type Vector = Vector3<f64>;

/// An orthonormal frame whose first axis is `along`.
pub(crate) fn frame(along: Vector) -> [Vector; 3] {
    let least = along.iamin();
    let other = Vector::from_fn(|k, _| if k == least { 1.0 } else { 0.0 });
    let across = along.cross(&other).normalize();
    [along, across, along.cross(&across)]
}

/// An orthonormal frame whose first axis is along the first side of a triangle, and whose second one is in
/// its plane. If the triangle has no area, some frame along the side.
pub(crate) fn frame_of_triangle(corners: &[Vector; 3]) -> [Vector; 3] {
    let side = (corners[1] - corners[0]).try_normalize(0.0).unwrap_or_else(Vector::x);
    // Within the plane across the side, from which rounding cannot lead.
    let [along, y, z] = frame(side);
    let other = corners[2] - corners[0];
    let across = (y * y.dot(&other) + z * z.dot(&other)).try_normalize(0.0).unwrap_or(y);
    [along, across, along.cross(&across)]
}

/// The first of the points that are furthest along `d`.
pub(crate) fn extreme(points: &[[f64; 3]], d: &Vector) -> Vector {
    let (mut most, mut first) = (f64::NEG_INFINITY, 0);
    for (i, p) in points.iter().enumerate() {
        let own = p[0] * d.x + p[1] * d.y + p[2] * d.z;
        if own > most {
            (most, first) = (own, i);
        }
    }
    points.get(first).map_or_else(Vector::zeros, |&p| p.into())
}

/// The centre and half the edge lengths of the upright box about points.
pub(crate) fn upright_box(points: impl Iterator<Item = Vector>) -> (Vector, Vector) {
    let none = (Vector::repeat(f64::INFINITY), Vector::repeat(f64::NEG_INFINITY));
    let (low, high) = points.fold(none, |(low, high), p| (low.inf(&p), high.sup(&p)));
    (0.5 * low + 0.5 * high, 0.5 * high - 0.5 * low)
}

/// The centre and half the edge lengths of a box along `axes` about a shape with this support map.
pub(crate) fn spanned(axes: &[Vector; 3], support: impl Fn(&Vector) -> Vector) -> (Vector, Vector) {
    let ends = axes.map(|axis| [-axis, axis].map(|d| axis.dot(&support(&d))));
    let centre = (0..3).map(|k| axes[k] * (0.5 * ends[k][0] + 0.5 * ends[k][1])).sum();
    (centre, Vector::from(ends.map(|[low, high]| 0.5 * high - 0.5 * low)))
}

#[cfg(test)]
mod tests {
    use nearmiss_testdata::arbitrary::{point_in, rng};
    use rand::RngExt;

    use super::*;

    /// Triangles of any shape, slivers, and such whose corners are on a line or equal.
    #[test]
    fn frames_of_triangles_are_orthonormal_and_their_boxes_contain_the_corners() {
        let rng = &mut rng(8101);
        for round in 0..3000_usize {
            let [p, q] = [0, 1].map(|_| Vector::from(point_in(rng, 10.0)));
            let share: f64 = rng.random_range(-1.0..2.0);
            let off = Vector::from(point_in(rng, 1.0)) * [0.0, 1e-15, 1e-12, 1e-8, 1.0][round / 6 % 5];
            let on_line = p + (q - p) * share + off;
            let corners = [[p, q, on_line], [p, on_line, q], [p, q, q], [p, p, q], [p, q, p], [p, p, p]];
            let corners = corners[round % 6];
            let axes = frame_of_triangle(&corners);
            for (i, j) in [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)] {
                let expected = if i == j { 1.0 } else { 0.0 };
                let found: f64 = axes[i].dot(&axes[j]);
                assert!((found - expected).abs() < 1e-14, "round {round}: {axes:?} of {corners:?}");
            }
            let own = corners.map(Into::into);
            let (centre, half) = spanned(&axes, |d| extreme(&own, d));
            for corner in corners {
                let away = corner - centre;
                let beyond = (0..3).map(|k| axes[k].dot(&away).abs() - half[k]).fold(0.0, f64::max);
                assert!(beyond < 1e-13, "round {round}: {corner} is {beyond} beyond the box of {corners:?}");
            }
        }
    }
}
