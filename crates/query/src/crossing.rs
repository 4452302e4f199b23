//! Whether two tangent discs cross: the first-order test of a pair of points.
//!
//! The planes of two discs meet in a line, which either disc covers by a chord or not at all; the discs cross
//! where the chords overlap. With `d = p_a − p_b`, `c = n_a·n_b`, `g = 1 − c²`, `u = d·n_a` and `v = d·n_b`, half
//! chords are `√(ρ_a² − v²/g)` and `√(ρ_b² − u²/g)`, and their midpoints lie `√(d² − (u² + v² − 2cuv)/g)` apart
//! along the line. Multiplied by g nothing is divided by, and no sign of a normal matters (docs/theory/discs.md).

use nearmiss_hierarchy::{MOST_LEAF_POINTS, THICKNESS};

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

/// Discs as arrays of lanes.
#[derive(Debug, Clone)]
pub(crate) struct Lanes {
    pub(crate) count: usize,
    pub(crate) centre: [[f32; MOST]; 3],
    pub(crate) normal: [[f32; MOST]; 3],
    pub(crate) radius: [f32; MOST],
}

/// Room for the points of a leaf.
const MOST: usize = MOST_LEAF_POINTS;

/// Lanes that are worked on together.
const WIDTH: usize = 8;

impl Default for Lanes {
    fn default() -> Self {
        Self { count: 0, centre: [[0.0; MOST]; 3], normal: [[0.0; MOST]; 3], radius: [0.0; MOST] }
    }
}

impl Lanes {
    /// Puts `disc` into lane `j`.
    pub(crate) fn set(&mut self, j: usize, disc: &Disc) {
        for k in 0..3 {
            self.centre[k][j] = disc.centre[k];
            self.normal[k][j] = disc.normal[k];
        }
        self.radius[j] = disc.radius;
    }

    /// Fills up to a full width with discs that cross nothing.
    pub(crate) fn close(&mut self, count: usize) {
        self.count = count;
        for j in count..count.next_multiple_of(WIDTH) {
            self.set(j, &Disc { centre: [f32::MAX.sqrt() * 0.1; 3], normal: [0.0; 3], radius: 0.0 });
        }
    }

    /// The lanes that cross `disc`, as bits.
    pub(crate) fn crossings(&self, disc: &Disc) -> u64 {
        let mut bits = 0;
        for start in (0..self.count).step_by(WIDTH) {
            bits |= u64::from(self.block(disc, start)) << start;
        }
        // Lanes that were only filled up never count, whatever their neighbours hold.
        bits & u64::MAX.unbounded_shr(u64::BITS - u32::try_from(self.count).unwrap_or(u64::BITS))
    }

    /// Eight lanes at once. Written with arrays of lanes throughout, so that it compiles to vector code.
    #[inline]
    fn block(&self, disc: &Disc, start: usize) -> u8 {
        let Some((x, y, z, r)) = self.places(start) else { return 0 };
        let mut d = [[0.0_f32; WIDTH]; 3];
        let mut d_sq = [0.0_f32; WIDTH];
        let mut near = [false; WIDTH];
        for i in 0..WIDTH {
            d[0][i] = disc.centre[0] - x[i];
            d[1][i] = disc.centre[1] - y[i];
            d[2][i] = disc.centre[2] - z[i];
            d_sq[i] = d[0][i] * d[0][i] + d[1][i] * d[1][i] + d[2][i] * d[2][i];
            let reach = disc.radius + r[i];
            near[i] = d_sq[i] <= reach * reach;
        }
        if near == [false; WIDTH] {
            return 0;
        }
        let mut bits = 0;
        for i in 0..WIDTH {
            let normal = [self.normal[0][start + i], self.normal[1][start + i], self.normal[2][start + i]];
            let hit = near[i] && cross(disc, [d[0][i], d[1][i], d[2][i]], normal, r[i]);
            bits |= u8::from(hit) << i;
        }
        bits
    }

    #[inline]
    #[expect(clippy::type_complexity, reason = "four lists of lanes")]
    fn places(&self, start: usize) -> Option<(&[f32; WIDTH], &[f32; WIDTH], &[f32; WIDTH], &[f32; WIDTH])> {
        let [x, y, z] = &self.centre;
        Some((
            x[start..].first_chunk()?,
            y[start..].first_chunk()?,
            z[start..].first_chunk()?,
            self.radius[start..].first_chunk()?,
        ))
    }
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
