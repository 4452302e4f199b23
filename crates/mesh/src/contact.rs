//! Common points of two triangles, with normals.

use crate::flat;
use crate::meet::{Arrangement, arrangement};
use crate::orientation::{plane_weights, volume_sign, weighted};
use crate::triangle::{Corners, between, length};

/// The common points of two triangles, as found by [`triangle_contact`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TriangleContact {
    /// A common point: the middle of `ends`, or, of triangles in one plane, the mean of the corners
    /// of the polygon that they share.
    pub point: [f64; 3],
    /// Ends of the common segment, equal if the triangles touch in a point. Of triangles in one
    /// plane, the two corners of the common polygon whose greatest difference of coordinates is
    /// largest.
    pub ends: [[f64; 3]; 2],
    /// Unit normals of both triangles, on the side from which their corners turn counterclockwise.
    /// `None` for a triangle without area.
    pub normals: [Option<[f64; 3]>; 2],
    /// `true` if both triangles lie in one plane, or one of them has no area.
    pub flat: bool,
}

/// Returns the contact of two triangles, or `None` if they do not meet.
///
/// Whether they meet, and which edges bound the common segment, is decided exactly, as by
/// [`triangles_meet`](crate::triangles_meet). The ends are then computed from volumes: in floating
/// point where its error is small, exactly where it may not be. So each of their coordinates is
/// within 70 units of rounding (70 · 2^-52) of the exact one, relative to the largest magnitude of
/// that coordinate at the corners of the edge on which the end lies. This holds for nearly parallel
/// planes too. For finite corners the result is finite.
///
/// # Cost
/// Takes about 1.5 µs for a pair that meets. For any other pair it takes as long as
/// [`triangles_meet`](crate::triangles_meet).
#[must_use]
pub fn triangle_contact(a: &Corners, b: &Corners) -> Option<TriangleContact> {
    let (point, ends, flat) = match arrangement(a, b) {
        Arrangement::Apart => return None,
        Arrangement::Crossing(p, u) => {
            let ends = common_segment(&p, &u);
            (weighted(ends[0], ends[1], [0.5; 2]), ends, false)
        }
        Arrangement::Flat => {
            let common = flat::contact(a, b)?;
            (common.mean, common.ends, true)
        }
    };
    Some(TriangleContact { point, ends, normals: [unit_normal(a), unit_normal(b)], flat })
}

/// The ends of the segment common to triangles as [`Arrangement::Crossing`] orders them.
///
/// The edges from the first corner of each triangle meet the plane of the other on one line. Along
/// it, the edge p–x comes no later than u–y if and only if the volume of p, x, u, y is not
/// negative.
fn common_segment(a: &Corners, b: &Corners) -> [[f64; 3]; 2] {
    let ([p, q, r], [u, v, w]) = (*a, *b);
    let on_a = |x: [f64; 3]| weighted(p, x, plane_weights(b, p, x));
    let on_b = |y: [f64; 3]| weighted(u, y, plane_weights(a, u, y));
    let from = if volume_sign(p, r, u, v).is_ge() { on_b(v) } else { on_a(r) };
    let to = if volume_sign(p, q, u, w).is_ge() { on_a(q) } else { on_b(w) };
    [from, to]
}

/// The unit normal of a triangle, on the side from which its corners turn counterclockwise. `None`
/// if the area is zero or so small that rounding leaves no direction.
///
/// It is computed from the two shortest edges with a correction of the rounding of products, so it
/// is accurate to rounding if the differences of corners are exact, even for needles.
#[must_use]
pub fn unit_normal(triangle: &Corners) -> Option<[f64; 3]> {
    // Differences of the largest numbers would overflow.
    let large = triangle.iter().flatten().any(|x| x.abs() > 1e300);
    let triangle = triangle.map(|p| p.map(|x| if large { 0.25 * x } else { x }));
    let edge = |i: usize| between(triangle[i], triangle[(i + 1) % 3]);
    let edges = [edge(0), edge(1), edge(2)];
    let size = |e: [f64; 3]| e.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let longest = (0..3).fold(0, |best, i| if size(edges[i]) > size(edges[best]) { i } else { best });
    // From the corner opposite the longest edge.
    let [e, f] = [edges[(longest + 1) % 3], edges[(longest + 2) % 3]];
    let [e, f] = [e, f].map(|x| x.map(|c| c / size(x)));
    let minor = |i: usize, j: usize| difference_of_products(e[i], f[j], e[j], f[i]);
    let normal = [minor(1, 2), minor(2, 0), minor(0, 1)];
    let most = size(normal);
    let scaled = normal.map(|x| x / most);
    let unit = scaled.map(|x| x / length(scaled));
    unit.iter().all(|x| x.is_finite()).then_some(unit)
}

/// a b − c d with an error of at most two units of rounding of the result (Kahan; Jeannerod, Louvet
/// & Muller 2013).
fn difference_of_products(a: f64, b: f64, c: f64, d: f64) -> f64 {
    let product = c * d;
    let lost = (-c).mul_add(d, product);
    a.mul_add(b, -product) + lost
}
