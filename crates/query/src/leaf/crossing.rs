//! Crossing of two tangent discs: the first-order test of a pair of points.
//!
//! The planes of two discs meet in a line, and each disc covers a chord of it, or nothing. The
//! discs cross if the chords overlap. Let `d = p_a − p_b`, `c = n_a·n_b`, `g = 1 − c²`, `u = d·n_a`
//! and `v = d·n_b`. The half chords are `√(ρ_a² − v²/g)` and `√(ρ_b² − u²/g)`. Their midpoints are
//! `√(d² − (u² + v² − 2cuv)/g)` apart along the line. Multiplying by g avoids all divisions, and
//! the signs of the normals do not matter (docs/theory/discs.md).

use nearmiss_hierarchy::THICKNESS;

/// The tangent disc of a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disc {
    /// The centre, which is the point.
    pub centre: [f32; 3],
    /// The unit normal, of arbitrary sign.
    pub normal: [f32; 3],
    /// The radius.
    pub radius: f32,
}

/// Returns `true` if the discs cross.
#[must_use]
pub fn crossing(a: &Disc, b: &Disc) -> bool {
    let d = [a.centre[0] - b.centre[0], a.centre[1] - b.centre[1], a.centre[2] - b.centre[2]];
    let reach = a.radius + b.radius;
    d[0] * d[0] + d[1] * d[1] + d[2] * d[2] <= reach * reach && cross(a, d, b.normal, b.radius)
}

/// The test itself, for discs whose centres differ by `d` and are within the sum of their radii.
#[inline]
fn cross(a: &Disc, d: [f32; 3], normal: [f32; 3], radius: f32) -> bool {
    let dot = |p: [f32; 3], q: [f32; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    let (u, v, c) = (dot(d, a.normal), dot(d, normal), dot(a.normal, normal));
    let g = 1.0 - c * c;
    let (ra_sq, rb_sq) = (a.radius * a.radius, radius * radius);
    // Half chords and half their distance, all squared and multiplied by g.
    let chord_a = ra_sq * g - v * v;
    let chord_b = rb_sq * g - u * u;
    let apart = dot(d, d) * g - (u * u + v * v - 2.0 * c * u * v);
    // Two square roots, as one root of the product would underflow for small radii.
    let both = chord_a.max(0.0).sqrt() * chord_b.max(0.0).sqrt();
    let cross = chord_a >= 0.0 && chord_b >= 0.0 && apart <= chord_a + chord_b + 2.0 * both;
    let thin = THICKNESS * a.radius.min(radius);
    cross || u.abs().max(v.abs()) <= thin
}
