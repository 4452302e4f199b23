//! The distance of a tangent disc and a triangle, in double precision.
//!
//! Both are convex. If the triangle crosses the plane of the disc within the disc, the distance is 0.
//! Otherwise the nearest point of the triangle is on an edge, or it is a foot of the disc on the
//! face: the foot of the point of the rim that is nearest to the plane of the triangle, or of the
//! centre if the planes are parallel. Along an edge the squared distance from the disc is convex and
//! has a continuous derivative, whose zero is found by bisection and secants.

use nearmiss_geometry::nalgebra::Vector3;
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
    /// The zero of the derivative is found by false position. If an end stays twice, its value is halved
    /// (the Illinois rule).
    pub(crate) fn nearest_share(&self, p: Vector3<f64>, way: Vector3<f64>) -> f64 {
        const ROUNDS: u32 = 60;
        /// In disc radii. The error of a distance is of second order in that of the place.
        const PRECISION: f64 = 1e-9;
        let length = way.norm();
        // Also if the edge is a point.
        let per_radius = (self.radius / length).min(2.0);
        // The nearest place of the disc is within its radius of the centre, and so are their feet.
        let middle = ((self.centre - p).dot(&way) / (length * length)).clamp(0.0, 1.0);
        let middle = if middle.is_nan() { 0.0 } else { middle };
        let (mut low, mut high) = ((middle - per_radius).max(0.0), (middle + per_radius).min(1.0));
        // Derivative of half the squared distance along the edge.
        let slope = |share: f64| {
            let x = p + way * share;
            (x - self.nearest(&x)).dot(&way)
        };
        let (mut below, mut above) = (slope(low), slope(high));
        if below >= 0.0 {
            return low;
        }
        if above <= 0.0 {
            return high;
        }
        let near = PRECISION * per_radius;
        let (mut middle, mut was_below) = (low, None);
        for _ in 0..ROUNDS {
            let next = low + (high - low) * (below / (below - above));
            let own = slope(next);
            let change = (next - middle).abs();
            middle = next;
            if own == 0.0 || change <= near || high - low <= near {
                break;
            }
            let share = if was_below == Some(own < 0.0) { 0.5 } else { 1.0 };
            if own < 0.0 {
                (low, below, above) = (middle, own, share * above);
            } else {
                (high, above, below) = (middle, own, share * below);
            }
            was_below = Some(own < 0.0);
        }
        middle
    }
}

#[cfg(test)]
mod tests {
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
}
