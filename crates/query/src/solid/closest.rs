//! The nearest points of two convex shapes that are known by their support maps.
//!
//! The algorithm is that of Gilbert, Johnson & Keerthi ("A fast procedure for computing the distance
//! between complex objects in three-dimensional space", IEEE Journal of Robotics and Automation 4,
//! 1988): a simplex in the Minkowski difference approaches the origin. The point of a simplex nearest
//! to the origin is found by regions (Ericson, "Real-Time Collision Detection", 2005, §5.1).

use nearmiss_geometry::nalgebra::Vector3;

type Vector = Vector3<f64>;

/// Steps until the distance counts as found. A shape with a smooth boundary takes about ten.
const ROUNDS: u32 = 64;

/// The search ends once the bounds of the squared distance differ by this share of it.
const PRECISION: f64 = 1e-9;

/// Relative rounding error of the difference of two points.
const ROUNDING: f64 = 1e-15;

/// Two nearest points, and bounds of their distance.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Closest {
    /// A point of each shape.
    pub(crate) points: [Vector; 2],
    /// The distance of these points: an upper bound. Zero if the shapes have a point in common.
    pub(crate) distance: f64,
    /// A lower bound, from a plane between the shapes.
    pub(crate) lower: f64,
}

/// Up to four vertices, with weights that sum up to 1 and give the point nearest to the origin.
struct Simplex {
    /// The differences of the points of both shapes.
    vertices: [Vector; 4],
    points: [[Vector; 2]; 4],
    weights: [f64; 4],
    count: usize,
}

/// Finds the nearest points of two convex shapes. `support` returns the point of the first shape
/// furthest along a direction, and the point of the second furthest against it. `start` is the
/// difference of any point of the first and any of the second, or any way from the second to the first. Ends
/// early once the distance is known to be at most `enough` or to exceed `beyond`.
pub(crate) fn closest(
    support: impl Fn(&Vector) -> [Vector; 2],
    start: Vector,
    [enough, beyond]: [f64; 2],
) -> Closest {
    let start = if start.norm_squared() > 0.0 { start } else { Vector::x() };
    let mut simplex = Simplex::new(support(&-start));
    let mut v = simplex.vertices[0];
    // The plane across the start gives the first lower bound.
    let mut lower = (start.dot(&v) / start.norm()).max(0.0);
    let mut size_sq = v.norm_squared();
    for _ in 0..ROUNDS {
        if lower > beyond {
            break;
        }
        let square = v.norm_squared();
        // Zero up to rounding.
        if square.is_nan() || square <= ROUNDING * ROUNDING * size_sq || square.sqrt() <= enough {
            break;
        }
        let points = support(&-v);
        let next = points[0] - points[1];
        let along = v.dot(&next);
        if !along.is_finite() {
            break;
        }
        lower = lower.max(along / square.sqrt());
        if square - along <= PRECISION * square || simplex.has(&next) {
            break;
        }
        size_sq = size_sq.max(next.norm_squared());
        let Some(weights) = simplex.weights_with(next, points) else {
            v = Vector::zeros();
            break;
        };
        let nearer = weighted(&simplex.vertices, &weights);
        if nearer.norm_squared() >= square {
            break;
        }
        simplex.keep(weights);
        v = nearer;
    }
    let points = [0, 1].map(|k| weighted(&simplex.points.map(|of| of[k]), &simplex.weights));
    let distance = v.norm();
    // `max` and `min` ignore what is not a number.
    let lower = (lower - 4.0 * ROUNDING * size_sq.sqrt()).max(0.0).min(distance);
    Closest { points, distance, lower }
}

/// The sum of points by weights.
fn weighted(points: &[Vector; 4], weights: &[f64; 4]) -> Vector {
    points[0] * weights[0] + points[1] * weights[1] + points[2] * weights[2] + points[3] * weights[3]
}

impl Simplex {
    fn new(points: [Vector; 2]) -> Self {
        let first = points[0] - points[1];
        Self { vertices: [first; 4], points: [points; 4], weights: [1.0, 0.0, 0.0, 0.0], count: 1 }
    }

    fn has(&self, vertex: &Vector) -> bool {
        self.vertices[..self.count].contains(vertex)
    }

    /// Returns the weights of the point nearest to the origin, with `next` as the newest vertex. The other
    /// vertices alone are no nearer. `None` if the tetrahedron contains the origin; its weights are then set.
    fn weights_with(&mut self, next: Vector, points: [Vector; 2]) -> Option<[f64; 4]> {
        (self.vertices[self.count], self.points[self.count]) = (next, points);
        let p = &self.vertices;
        Some(match self.count {
            1 => {
                let [a, b] = of_segment(&p[0], &p[1]);
                [a, b, 0.0, 0.0]
            }
            2 => {
                let [a, b, c] = of_triangle([&p[0], &p[1], &p[2]], &(p[1] - p[0]).cross(&(p[2] - p[0])));
                [a, b, c, 0.0]
            }
            _ => {
                let (weights, is_inside) = of_tetrahedron(p);
                if is_inside {
                    (self.weights, self.count) = (weights, 4);
                    return None;
                }
                weights
            }
        })
    }

    /// Sets the weights and drops vertices without weight.
    fn keep(&mut self, weights: [f64; 4]) {
        self.weights = [0.0; 4];
        self.count = 0;
        for i in 0..4 {
            if weights[i] > 0.0 {
                let kept = self.count;
                (self.vertices[kept], self.points[kept]) = (self.vertices[i], self.points[i]);
                self.weights[kept] = weights[i];
                self.count += 1;
            }
        }
    }
}

/// The weights of the point of a segment nearest to the origin.
fn of_segment(a: &Vector, b: &Vector) -> [f64; 2] {
    let along = b - a;
    let square = along.norm_squared();
    let share = if square > 0.0 { (-a.dot(&along) / square).clamp(0.0, 1.0) } else { 0.0 };
    [1.0 - share, share]
}

/// The weights of the point of a triangle nearest to the origin, given a normal. That point is not on the
/// edge from `a` to `b`.
fn of_triangle([a, b, c]: [&Vector; 3], normal: &Vector) -> [f64; 3] {
    // Areas of the triangles of the foot and each edge.
    let area = |p: &Vector, q: &Vector| p.cross(q).dot(normal);
    let (u, v, w) = (area(b, c), area(c, a), area(a, b));
    let sum = u + v + w;
    if u >= 0.0 && v >= 0.0 && w >= 0.0 && sum > 0.0 {
        return [u / sum, v / sum, w / sum];
    }
    let ([s, t], [q, r]) = (of_segment(a, c), of_segment(b, c));
    let (by_a, by_b) = (a * s + c * t, b * q + c * r);
    if by_b.norm_squared() < by_a.norm_squared() { [0.0, q, r] } else { [s, 0.0, t] }
}

/// The same of a tetrahedron, and `true` if it contains the origin. The nearest point is not on the face of
/// the first three vertices.
fn of_tetrahedron(p: &[Vector; 4]) -> ([f64; 4], bool) {
    /// Distance of the origin from the point that the weights give, relative to the greatest vertex, up
    /// to which it counts as inside. In a flat tetrahedron rounding decides the sides.
    const OFF: f64 = 1e-9;
    let mut best = ([1.0, 0.0, 0.0, 0.0], f64::INFINITY);
    let mut offer = |is_any: bool| {
        for [i, j, opposite] in [[0, 1, 2], [0, 2, 1], [1, 2, 0]] {
            let normal = (p[j] - p[i]).cross(&(p[3] - p[i]));
            // The origin is not on the side of the opposite vertex.
            if is_any || -normal.dot(&p[i]) * normal.dot(&(p[opposite] - p[i])) <= 0.0 {
                let mut weights = [0.0; 4];
                [weights[i], weights[j], weights[3]] = of_triangle([&p[i], &p[j], &p[3]], &normal);
                let square = weighted(p, &weights).norm_squared();
                if square < best.1 {
                    best = (weights, square);
                }
            }
        }
        best
    };
    let (weights, square) = offer(false);
    if square < f64::INFINITY {
        return (weights, false);
    }
    // The weight of a vertex is its share of the volume.
    let volume = |a: usize, b: usize, c: usize| p[a].dot(&p[b].cross(&p[c])).abs();
    let shares = [volume(1, 2, 3), volume(0, 2, 3), volume(0, 1, 3), volume(0, 1, 2)];
    let sum: f64 = shares.iter().sum();
    let weights = shares.map(|share| share / sum);
    let size = p.iter().map(Vector::norm).fold(0.0, f64::max);
    if weighted(p, &weights).norm() <= OFF * size { (weights, true) } else { (offer(true).0, false) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A support map that returns what is not a number ends the search with the points before.
    #[test]
    fn broken_support_maps_end_the_search() {
        let there = Vector::new(3.0, 0.0, 0.0);
        let support = |d: &Vector| {
            let d = d.normalize();
            [if d.x > 0.99 { Vector::repeat(f64::NAN) } else { d }, there]
        };
        let found = closest(support, Vector::new(-3.0, 2.0, 0.0), [0.0, f64::INFINITY]);
        assert!(found.distance >= 2.0 && found.distance < 4.0, "{found:?}");
        assert!(found.lower <= 2.0 && (found.points[0].norm() - 1.0).abs() < 1e-12, "{found:?}");
    }
}
