//! Whether two tangent discs cross: the first-order test of a pair of points.
//!
//! The planes of two discs meet in a line, which either disc covers by a chord or not at all; the discs cross
//! where the chords overlap. With `d = p_a − p_b`, `c = n_a·n_b`, `g = 1 − c²`, `u = d·n_a` and `v = d·n_b`,
//! half chords are `√(ρ_a² − v²/g)` and `√(ρ_b² − u²/g)`, and their midpoints lie `√(d² − (u² + v² −
//! 2cuv)/g)` apart along the line. Multiplied by g nothing is divided by, and no sign of a normal matters
//! (docs/theory/discs.md).

use nearmiss_hierarchy::THICKNESS;

/// A point's tangent disc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disc {
    /// The point.
    pub centre: [f32; 3],
    /// Unit normal, of either sign.
    pub normal: [f32; 3],
    /// Radius.
    pub radius: f32,
}

/// Whether the discs cross.
#[must_use]
pub fn crossing(a: &Disc, b: &Disc) -> bool {
    let d = [a.centre[0] - b.centre[0], a.centre[1] - b.centre[1], a.centre[2] - b.centre[2]];
    let reach = a.radius + b.radius;
    d[0] * d[0] + d[1] * d[1] + d[2] * d[2] <= reach * reach && cross(a, d, b.normal, b.radius)
}

/// The test proper, for discs whose centres are `d` apart and within the sum of their radii.
#[inline]
fn cross(a: &Disc, d: [f32; 3], normal: [f32; 3], radius: f32) -> bool {
    let dot = |p: [f32; 3], q: [f32; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    let (u, v, c) = (dot(d, a.normal), dot(d, normal), dot(a.normal, normal));
    let g = 1.0 - c * c;
    let (ra_sq, rb_sq) = (a.radius * a.radius, radius * radius);
    // Half chords and half their distance, all squared and times g.
    let chord_a = ra_sq * g - v * v;
    let chord_b = rb_sq * g - u * u;
    let apart = dot(d, d) * g - (u * u + v * v - 2.0 * c * u * v);
    // Two roots, not one of the product: that would underflow for radii that are still fine.
    let both = chord_a.max(0.0).sqrt() * chord_b.max(0.0).sqrt();
    let cross = chord_a >= 0.0 && chord_b >= 0.0 && apart <= chord_a + chord_b + 2.0 * both;
    let thin = THICKNESS * a.radius.min(radius);
    cross || u.abs().max(v.abs()) <= thin
}
