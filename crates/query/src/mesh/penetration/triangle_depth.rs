//! The least shift that separates two triangles.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_mesh::Corners;

type Vector = Vector3<f64>;

/// Returns the length of the least shift of `b` after which two triangles that meet only touch, and
/// its direction. The length is not positive if they do not meet.
///
/// The differences of points of a and of b are a convex polytope. Its faces are perpendicular to a
/// normal of a triangle or to an edge of each; the least distance of the origin from a face is the
/// depth. It is 0 for triangles in one plane.
pub(crate) fn triangle_depth(a: &Corners, b: &Corners) -> (f64, Vector) {
    let [a, b] = [a, b].map(|t| t.map(Vector::from));
    let edges = |t: &[Vector; 3]| [t[1] - t[0], t[2] - t[1], t[0] - t[2]];
    let (e, f) = (edges(&a), edges(&b));
    let mut least = (f64::INFINITY, Vector::zeros());
    let mut offer = |normal: Vector| {
        let length = normal.norm();
        // Parallel edges leave no direction; rounding would make one up.
        if length > 0.0 {
            let u = normal / length;
            let depth = |u: &Vector| {
                let low = |t: &[Vector; 3]| t.iter().map(|p| u.dot(p)).fold(f64::INFINITY, f64::min);
                let high = |t: &[Vector; 3]| t.iter().map(|p| u.dot(p)).fold(f64::NEG_INFINITY, f64::max);
                [(high(&a) - low(&b), 1.0), (high(&b) - low(&a), -1.0)]
            };
            for (depth, sign) in depth(&u) {
                if depth < least.0 {
                    least = (depth, u * sign);
                }
            }
        }
    };
    offer(e[0].cross(&e[1]));
    offer(f[0].cross(&f[1]));
    for e in &e {
        for f in &f {
            offer(e.cross(f));
        }
    }
    if least.0.is_finite() { least } else { (0.0, Vector::x()) }
}

#[cfg(test)]
mod tests {
    use nearmiss_mesh::triangles_meet;
    use nearmiss_testdata::arbitrary::{point_in, rng, unit_vector};

    use super::*;

    /// Shorter shifts, in any direction, leave the triangles in contact; the shift separates them.
    #[test]
    fn triangles_meet_under_shorter_shifts_only() {
        let rng = &mut rng(3301);
        let mut deep = 0;
        for _ in 0..3000 {
            let corners = |rng: &mut _| [point_in(rng, 1.0), point_in(rng, 1.0), point_in(rng, 1.0)];
            let (a, b) = (corners(rng), corners(rng));
            let (depth, way) = triangle_depth(&a, &b);
            let shifted = |t: Vector| b.map(|p| (Vector::from(p) + t).into());
            assert_eq!(triangles_meet(&a, &b), depth > 0.0, "{a:?}, {b:?}");
            assert!(!triangles_meet(&a, &shifted(way * (depth.max(0.0) + 1e-12))), "{a:?}, {b:?}");
            if depth > 1e-6 {
                deep += 1;
                for _ in 0..20 {
                    let t = Vector::from(unit_vector(rng)) * (depth - 1e-12);
                    assert!(triangles_meet(&a, &shifted(t)), "{a:?}, {b:?}, {t}");
                }
            }
        }
        assert!(deep > 200, "{deep} triangles meet");
    }
}
