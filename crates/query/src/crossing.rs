//! Whether two tangent discs cross: the first-order test of a pair of points.
//!
//! The planes of two discs meet in a line, which either disc covers by a chord or not at all; the discs cross
//! where the chords overlap. With d = p_a − p_b, c = n_a·n_b, g = 1 − c², u = d·n_a and v = d·n_b, half chords
//! are √(ρ_a² − v²/g) and √(ρ_b² − u²/g), and their midpoints lie √(d² − (u² + v² − 2cuv)/g) apart along the
//! line. Multiplied by g nothing is divided by, and no sign of a normal matters.

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

/// Parallel discs nearer than this share of the smaller radius touch: to first order nothing tells a sheet
/// that grazes another from one that lies on it.
pub(crate) const THICKNESS: f32 = 0.05;

/// Discs as arrays of lanes.
#[derive(Debug, Clone)]
pub(crate) struct Lanes {
    pub(crate) count: usize,
    pub(crate) centre: [[f32; MOST]; 3],
    pub(crate) normal: [[f32; MOST]; 3],
    pub(crate) radius: [f32; MOST],
}

/// Greatest number of points in a leaf.
pub(crate) const MOST: usize = 64;

/// Lanes that are worked on together.
const WIDTH: usize = 8;

impl Default for Lanes {
    fn default() -> Self {
        Self {
            count: 0,
            centre: [[0.0; MOST]; 3],
            normal: [[0.0; MOST]; 3],
            radius: [0.0; MOST],
        }
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
            self.set(
                j,
                &Disc {
                    centre: [f32::MAX.sqrt() * 0.1; 3],
                    normal: [0.0; 3],
                    radius: 0.0,
                },
            );
        }
    }

    /// The lanes that cross `disc`, as bits.
    pub(crate) fn crossings(&self, disc: &Disc) -> u64 {
        let mut bits = 0;
        for start in (0..self.count).step_by(WIDTH) {
            bits |= u64::from(self.block(disc, start)) << start;
        }
        bits
    }

    #[inline]
    fn block(&self, disc: &Disc, start: usize) -> u8 {
        let lane = |list: &[f32; MOST]| -> [f32; WIDTH] { std::array::from_fn(|i| list[start + i]) };
        let [x, y, z] = [0, 1, 2].map(|k| lane(&self.centre[k]).map(|c| disc.centre[k] - c));
        let radius = lane(&self.radius);
        let near: [bool; WIDTH] = std::array::from_fn(|i| {
            let reach = disc.radius + radius[i];
            x[i] * x[i] + y[i] * y[i] + z[i] * z[i] <= reach * reach
        });
        if near == [false; WIDTH] {
            return 0;
        }
        let [nx, ny, nz] = [0, 1, 2].map(|k| lane(&self.normal[k]));
        let hits: [bool; WIDTH] = std::array::from_fn(|i| {
            near[i] && cross(disc, [x[i], y[i], z[i]], [nx[i], ny[i], nz[i]], radius[i])
        });
        hits.iter()
            .enumerate()
            .fold(0, |bits, (i, &hit)| bits | u8::from(hit) << i)
    }
}

/// Whether the discs cross.
#[must_use]
pub fn crossing(a: &Disc, b: &Disc) -> bool {
    let d = [0, 1, 2].map(|k| a.centre[k] - b.centre[k]);
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
    let both = (chord_a.max(0.0) * chord_b.max(0.0)).sqrt();
    let cross = chord_a >= 0.0 && chord_b >= 0.0 && apart <= chord_a + chord_b + 2.0 * both;
    let thin = THICKNESS * a.radius.min(radius);
    cross || u.abs().max(v.abs()) <= thin
}
