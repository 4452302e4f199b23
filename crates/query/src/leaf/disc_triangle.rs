//! The distance of a tangent disc and a triangle, in double precision.
//!
//! Both are convex. If the triangle crosses the plane of the disc within the disc, the distance is 0.
//! Otherwise the nearest point of the triangle is on an edge, or it is a foot of the disc on the
//! face: the foot of the point of the rim that is nearest to the plane of the triangle, or of the
//! centre if the planes are parallel. Along an edge the squared distance from the disc is convex and
//! has a continuous derivative, whose zero is found by Newton's method.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::THICKNESS;
use nearmiss_mesh::{Corners, nearest_on_triangle, unit_normal};

/// A flat disc.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FlatDisc {
    pub(crate) centre: Vector3<f64>,
    /// A unit vector.
    pub(crate) normal: Vector3<f64>,
    pub(crate) radius: f64,
}

/// A point of a triangle and the point of a disc nearest to it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Nearest {
    pub(crate) distance: f64,
    pub(crate) on_triangle: Vector3<f64>,
    pub(crate) on_disc: Vector3<f64>,
}

impl FlatDisc {
    /// The distance within which a shape touches the disc.
    #[inline]
    pub(crate) fn thickness(&self) -> f64 {
        f64::from(THICKNESS) * self.radius
    }

    /// The point of the disc nearest to `x`.
    pub(crate) fn nearest(&self, x: &Vector3<f64>) -> Vector3<f64> {
        let away = x - self.centre;
        let across = away - self.normal * self.normal.dot(&away);
        let length = across.norm();
        self.centre + if length > self.radius { across * (self.radius / length) } else { across }
    }

    /// The point of the disc furthest along `d`, relative to its centre.
    #[inline]
    pub(crate) fn rim(&self, d: &Vector3<f64>) -> Vector3<f64> {
        let across = d - self.normal * self.normal.dot(d);
        // Again, as rounding of the first may be as large as what it leaves.
        let across = across - self.normal * self.normal.dot(&across);
        let square = across.norm_squared();
        // Along the normal all points are equal.
        if square > 1e-24 * d.norm_squared() {
            across * (self.radius / square.sqrt())
        } else {
            Vector3::zeros()
        }
    }

    /// The nearest points of the disc and a triangle. If they cross, the middle of what they have
    /// in common.
    pub(crate) fn nearest_to(&self, triangle: &Corners) -> Nearest {
        if let Some(middle) = self.crossing(triangle) {
            return Nearest { distance: 0.0, on_triangle: middle, on_disc: middle };
        }
        let centre = self.centre;
        let mut best = Nearest { distance: f64::INFINITY, on_triangle: centre, on_disc: centre };
        let mut offer = |x: Vector3<f64>| {
            let y = self.nearest(&x);
            let distance = (x - y).norm();
            if distance < best.distance {
                best = Nearest { distance, on_triangle: x, on_disc: y };
            }
        };
        let foot = |p: Vector3<f64>| Vector3::from(nearest_on_triangle(triangle, p.into()));
        offer(foot(centre));
        if let Some(normal) = unit_normal(triangle).map(Vector3::from) {
            let across = normal - self.normal * self.normal.dot(&normal);
            let length = across.norm();
            if length > 0.0 {
                let side = normal.dot(&(centre - Vector3::from(triangle[0])));
                offer(foot(centre - across * (self.radius / length).copysign(side)));
            }
        }
        for i in 0..3 {
            let (p, q) = (Vector3::from(triangle[i]), Vector3::from(triangle[(i + 1) % 3]));
            offer(p + (q - p) * self.nearest_share(p, q - p));
        }
        best
    }

    /// The middle of the common segment of the disc and a triangle that crosses its plane.
    fn crossing(&self, triangle: &Corners) -> Option<Vector3<f64>> {
        let corners = triangle.map(Vector3::from);
        let heights = corners.map(|corner| self.normal.dot(&(corner - self.centre)));
        let (mut ends, mut count) = ([Vector3::zeros(); 2], 0);
        for i in 0..3 {
            let j = (i + 1) % 3;
            // Each corner in the plane belongs to one side, so that two edges cross or none.
            if (heights[i] >= 0.0) != (heights[j] >= 0.0) && count < 2 {
                let share = heights[i] / (heights[i] - heights[j]);
                ends[count] = corners[i] + (corners[j] - corners[i]) * share;
                count += 1;
            }
        }
        if count < 2 {
            return None;
        }
        let (from, way) = (ends[0] - self.centre, ends[1] - ends[0]);
        let square = way.norm_squared();
        let middle = if square > 0.0 { -from.dot(&way) / square } else { 0.0 };
        let off = from + way * middle;
        let half_sq = self.radius * self.radius - off.norm_squared();
        let half = if square > 0.0 { (half_sq.max(0.0) / square).sqrt() } else { f64::INFINITY };
        let (low, high) = ((middle - half).max(0.0), (middle + half).min(1.0));
        (half_sq >= 0.0 && low <= high).then(|| ends[0] + way * (0.5 * (low + high)))
    }

    /// The share of the edge from `p` along `way` at which it is nearest to the disc.
    ///
    /// The zero of the derivative is found by Newton's method, and by bisection where that leaves the
    /// bracket or, at the rim, goes to and fro.
    pub(crate) fn nearest_share(&self, p: Vector3<f64>, way: Vector3<f64>) -> f64 {
        const ROUNDS: u32 = 80;
        /// Rounds after which every other one is a bisection.
        const QUICK: u32 = 8;
        /// The last change, in disc radii. What a step of Newton's method leaves is of second order in its
        /// length, and the error of a distance is of second order in that of the place.
        const PRECISION: f64 = 1e-5;
        let square = way.norm_squared();
        // Also if the edge is a point.
        let per_radius = (self.radius / square.sqrt()).min(2.0);
        // The nearest place of the disc is within its radius of the centre, and so are their feet.
        let middle = ((self.centre - p).dot(&way) / square).clamp(0.0, 1.0);
        let middle = if middle.is_nan() { 0.0 } else { middle };
        // From the middle, so that rounding is relative to what is near the disc.
        let (mut low, mut high) = (-middle.min(per_radius), (1.0 - middle).min(per_radius));
        let away = p + way * middle - self.centre;
        let (height, rise) = (self.normal.dot(&away), self.normal.dot(&way));
        let (from, across) = (away - self.normal * height, way - self.normal * rise);
        let (a, b, c) = (across.norm_squared(), from.dot(&across), from.norm_squared());
        let radius_sq = self.radius * self.radius;
        // The derivative of half the squared distance along the edge, and its own.
        let slope = |s: f64| {
            let of_plane = rise * (height + s * rise);
            let beside_sq = c + s * (2.0 * b + s * a);
            if beside_sq <= radius_sq {
                return (of_plane, rise * rise);
            }
            let (share, along) = (self.radius / beside_sq.sqrt(), b + s * a);
            let curve = (1.0 - share) * a + share * along * along / beside_sq;
            (of_plane + (1.0 - share) * along, rise * rise + curve)
        };
        let (mut s, mut own) = (0.0, slope(0.0));
        if own.0 < 0.0 && slope(high).0 <= 0.0 {
            return middle + high;
        }
        if own.0 > 0.0 && slope(low).0 >= 0.0 {
            return middle + low;
        }
        let near = PRECISION * per_radius;
        for round in 0..ROUNDS {
            if own.0 < 0.0 {
                low = s;
            } else if own.0 > 0.0 {
                high = s;
            } else {
                break;
            }
            let next = s - own.0 / own.1;
            let is_in = next > low && next < high && (round < QUICK || round.is_multiple_of(2));
            let next = if is_in { next } else { 0.5 * (low + high) };
            let change = (next - s).abs();
            s = next;
            if change <= near || high - low <= near {
                break;
            }
            own = slope(s);
        }
        middle + s
    }
}

#[cfg(test)]
mod tests {
    use nearmiss_testdata::arbitrary::{point_in, rng};

    use super::*;

    #[test]
    fn distances_of_known_arrangements_are_found() {
        let disc = FlatDisc { centre: Vector3::zeros(), normal: Vector3::z(), radius: 1.0 };
        let moved = |triangle: [[f64; 3]; 3], by: [f64; 3]| triangle.map(|p| [0, 1, 2].map(|k| p[k] + by[k]));
        let lying = [[-9.0, -9.0, 0.0], [9.0, -9.0, 0.0], [0.0, 9.0, 0.0]];
        let upright = [[-9.0, 0.0, 0.0], [9.0, 0.0, 0.0], [0.0, 0.0, 9.0]];
        // Rises by 45° from a line far beside the disc.
        let slanted = [[-9.0, -9.0, -9.0], [-9.0, 9.0, -9.0], [99.0, 0.0, 99.0]];
        let cases = [
            (lying, [0.0, 0.0, 0.3], 0.3, "above all of the disc"),
            (lying, [0.0, 0.0, 0.0], 0.0, "in its plane"),
            (upright, [0.0, 0.5, 0.2], 0.2, "an edge above"),
            (upright, [0.0, 0.5, -0.2], 0.0, "across"),
            (upright, [0.0, 3.0, -0.2], 2.0, "beside"),
            (upright, [0.0, 4.0, 4.0], 5.0, "beside and above"),
            (slanted, [0.0, 0.0, 2.0], 0.5_f64.sqrt(), "the rim below the face"),
            ([[1.0, 0.0, 0.0]; 3], [0.5, 0.0, 0.0], 0.5, "a point"),
        ];
        for (triangle, by, distance, what) in cases {
            let found = disc.nearest_to(&moved(triangle, by));
            assert!((found.distance - distance).abs() < 1e-9, "{what}: {found:?}, expected {distance}");
            let apart = (found.on_triangle - found.on_disc).norm();
            assert!((apart - distance).abs() < 1e-9, "{what}: {found:?}");
        }
    }

    #[test]
    fn the_nearest_place_of_an_edge_is_that_of_a_plain_search() {
        let rng = &mut rng(5);
        let mut inner = 0;
        for round in 0..3000_i32 {
            // Edges through the disc, along its plane, beside it, and long or far ones.
            let size = 10.0_f64.powi(round % 5 - 2);
            let [mut p, way] = [3.0, size].map(|size| Vector3::from(point_in(rng, size)));
            let disc = FlatDisc { centre: Vector3::zeros(), normal: Vector3::z(), radius: 1.0 };
            if round % 7 == 0 {
                p.z = 0.0;
            }
            let apart = |share: f64| {
                let x = p + way * share;
                (x - disc.nearest(&x)).norm()
            };
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..200 {
                let third = (high - low) / 3.0;
                if apart(low + third) <= apart(high - third) {
                    high -= third;
                } else {
                    low += third;
                }
            }
            let (own, least) = (disc.nearest_share(p, way), apart(0.5 * (low + high)));
            assert!((0.0..=1.0).contains(&own), "a place of the edge: {own}");
            assert!((apart(own) - least).abs() < 1e-8, "{p:?} {way:?}: {} for {least}", apart(own));
            inner += u32::from(own > 0.0 && own < 1.0);
        }
        assert!(inner > 500, "{inner} places inside");
    }
}
