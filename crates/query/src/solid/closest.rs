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

/// A vertex of the simplex: a point of each shape, and their difference.
#[derive(Debug, Clone, Copy)]
struct Vertex {
    points: [Vector; 2],
    apart: Vector,
}

/// Up to four vertices, with weights that sum up to 1 and give the point nearest to the origin.
#[derive(Debug, Clone, Copy)]
struct Simplex {
    vertices: [Vertex; 4],
    weights: [f64; 4],
    count: usize,
}

/// Finds the nearest points of two convex shapes. `support` returns the point of the first shape
/// furthest along a direction, and the point of the second furthest against it. `start` is the
/// difference of any point of the first and any of the second. Ends early once the distance is known to be
/// at most `enough` or to exceed `beyond`.
pub(crate) fn closest(
    support: impl Fn(&Vector) -> [Vector; 2],
    start: Vector,
    [enough, beyond]: [f64; 2],
) -> Closest {
    let vertex = |towards: &Vector| {
        let points = support(towards);
        Vertex { points, apart: points[0] - points[1] }
    };
    let start = if start.norm_squared() > 0.0 { start } else { Vector::x() };
    let first = vertex(&-start);
    let mut simplex = Simplex { vertices: [first; 4], weights: [1.0, 0.0, 0.0, 0.0], count: 1 };
    // The plane across the start gives the first lower bound.
    let (mut v, mut lower) = (first.apart, (start.dot(&first.apart) / start.norm()).max(0.0));
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
        let next = vertex(&-v);
        let along = v.dot(&next.apart);
        lower = lower.max(along / square.sqrt());
        if square - along <= PRECISION * square || simplex.has(&next.apart) {
            break;
        }
        size_sq = size_sq.max(next.apart.norm_squared());
        let mut grown = simplex;
        grown.add(next);
        if grown.reduce() {
            simplex = grown;
            v = Vector::zeros();
            break;
        }
        let nearer = grown.nearest();
        if nearer.norm_squared() >= square {
            break;
        }
        (simplex, v) = (grown, nearer);
    }
    let points = [0, 1].map(|k| simplex.combined(|vertex| vertex.points[k]));
    let distance = v.norm();
    // Also if a support map returns what is not a number.
    let lower = (lower - 4.0 * ROUNDING * size_sq.sqrt()).max(0.0).min(distance);
    Closest { points, distance, lower }
}

impl Simplex {
    fn has(&self, apart: &Vector) -> bool {
        self.vertices[..self.count].iter().any(|vertex| vertex.apart == *apart)
    }

    fn add(&mut self, vertex: Vertex) {
        self.vertices[self.count] = vertex;
        self.count += 1;
    }

    fn combined(&self, of: impl Fn(&Vertex) -> Vector) -> Vector {
        (0..self.count).map(|i| of(&self.vertices[i]) * self.weights[i]).sum()
    }

    fn nearest(&self) -> Vector {
        self.combined(|vertex| vertex.apart)
    }

    /// Sets the weights and drops vertices without weight. Returns `true` if a tetrahedron contains
    /// the origin.
    fn reduce(&mut self) -> bool {
        let p = self.vertices.map(|vertex| vertex.apart);
        let (weights, inside) = match self.count {
            1 => ([1.0, 0.0, 0.0, 0.0], false),
            2 => {
                let [a, b] = of_segment(&p[0], &p[1]);
                ([a, b, 0.0, 0.0], false)
            }
            3 => {
                let [a, b, c] = of_triangle([&p[0], &p[1], &p[2]]);
                ([a, b, c, 0.0], false)
            }
            _ => of_tetrahedron(&p),
        };
        let mut kept = 0;
        for i in 0..self.count {
            if weights[i] > 0.0 {
                (self.vertices[kept], self.weights[kept]) = (self.vertices[i], weights[i]);
                kept += 1;
            }
        }
        self.count = kept;
        inside
    }
}

/// The weights of the point of a segment nearest to the origin.
fn of_segment(a: &Vector, b: &Vector) -> [f64; 2] {
    let along = b - a;
    let square = along.norm_squared();
    let share = if square > 0.0 { (-a.dot(&along) / square).clamp(0.0, 1.0) } else { 0.0 };
    [1.0 - share, share]
}

/// The weights of the point of a triangle nearest to the origin.
fn of_triangle([a, b, c]: [&Vector; 3]) -> [f64; 3] {
    let (ab, ac) = (b - a, c - a);
    let normal = ab.cross(&ac);
    let square = normal.norm_squared();
    if square > 0.0 {
        // Areas of the triangles of the foot and each edge.
        let area = |p: &Vector, q: &Vector| p.cross(q).dot(&normal);
        let (u, v, w) = (area(b, c), area(c, a), area(a, b));
        if u >= 0.0 && v >= 0.0 && w >= 0.0 {
            let sum = u + v + w;
            if sum > 0.0 {
                return [u / sum, v / sum, w / sum];
            }
        }
    }
    let mut best = ([1.0, 0.0, 0.0], f64::INFINITY);
    for [i, j] in [[0, 1], [1, 2], [2, 0]] {
        let (p, q) = ([a, b, c][i], [a, b, c][j]);
        let [s, t] = of_segment(p, q);
        let square = (p * s + q * t).norm_squared();
        if square < best.1 {
            let mut weights = [0.0; 3];
            (weights[i], weights[j]) = (s, t);
            best = (weights, square);
        }
    }
    best.0
}

/// The same of a tetrahedron, and `true` if it contains the origin.
fn of_tetrahedron(p: &[Vector; 4]) -> ([f64; 4], bool) {
    /// Distance of the origin from the point that the weights give, relative to the greatest vertex, up
    /// to which it counts as inside. In a flat tetrahedron rounding decides the sides.
    const OFF: f64 = 1e-9;
    let is_outside = |[i, j, k, opposite]: [usize; 4]| {
        let normal = (p[j] - p[i]).cross(&(p[k] - p[i]));
        -normal.dot(&p[i]) * normal.dot(&(p[opposite] - p[i])) <= 0.0
    };
    let nearest = |is_wanted: &dyn Fn([usize; 4]) -> bool| {
        let mut best = ([1.0, 0.0, 0.0, 0.0], f64::INFINITY);
        for [i, j, k, opposite] in [[0, 1, 2, 3], [0, 1, 3, 2], [0, 2, 3, 1], [1, 2, 3, 0]] {
            if is_wanted([i, j, k, opposite]) {
                let [a, b, c] = of_triangle([&p[i], &p[j], &p[k]]);
                let square = (p[i] * a + p[j] * b + p[k] * c).norm_squared();
                if square < best.1 {
                    let mut weights = [0.0; 4];
                    (weights[i], weights[j], weights[k]) = (a, b, c);
                    best = (weights, square);
                }
            }
        }
        best
    };
    let (weights, square) = nearest(&is_outside);
    if square < f64::INFINITY {
        return (weights, false);
    }
    // The weight of a vertex is its share of the volume.
    let volume = |a: usize, b: usize, c: usize| p[a].dot(&p[b].cross(&p[c])).abs();
    let shares = [volume(1, 2, 3), volume(0, 2, 3), volume(0, 1, 3), volume(0, 1, 2)];
    let sum: f64 = shares.iter().sum();
    let weights = shares.map(|share| share / sum);
    let off: Vector = (0..4).map(|i| p[i] * weights[i]).sum();
    let size = p.iter().map(Vector::norm).fold(0.0, f64::max);
    if off.norm() <= OFF * size { (weights, true) } else { (nearest(&|_| true).0, false) }
}
