//! A house to walk through: two storeys, a staircase, ramps from 10° to 60°, round columns, doors,
//! a low ceiling. Metres, z up.
//!
//! The lower floor is at z = 0, x 0 to 16, y 0 to 12. The upper floor is at z = 3, x 6.5 to 16, y 6
//! to 12, with open edges.

use nearmiss_geometry::TriangleMesh;
use rand::RngExt;

use crate::arbitrary::{gaussian, rng};

/// Height of the upper floor.
pub const STOREY: f64 = 3.0;

/// A step of the staircase: up, along x.
pub const STEP: [f64; 2] = [STOREY / 17.0, 0.28];

/// The staircase goes up along x between the first two numbers in y, from the third in x.
pub const STAIRS: [f64; 3] = [10.2, 11.6, 1.74];

/// Angles of the ramps in degrees.
pub const RAMPS: [f64; 6] = [10.0, 20.0, 30.0, 40.0, 50.0, 60.0];

/// Length and width of a ramp on the ground.
pub const RAMP: [f64; 2] = [1.4, 1.2];

/// Radius of the columns.
pub const COLUMN: f64 = 0.25;
/// Axes of the columns.
pub const COLUMNS: [[f64; 2]; 3] = [[12.0, 4.0], [13.5, 4.02], [15.013, 4.017]];

/// The door in the wall x = 9 of the lower storey: from y, to y, height.
pub const DOOR: [f64; 3] = [7.0, 7.9, 2.1];

/// A gap in the same wall, from y to y, too narrow for most avatars.
pub const GAP: [f64; 2] = [8.8, 9.1];

/// A low ceiling: extent in x, extent in y, height over the lower floor.
pub const LOW: ([f64; 2], [f64; 2], f64) = ([11.0, 14.0], [7.0, 9.0], 1.5);

/// Underside of the upper floor.
const SLAB: f64 = STOREY - 0.2;

/// Number of flat sides of a round column.
const SIDES: u32 = 96;

/// A parallelogram: a corner and two sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quad {
    /// Its corner.
    pub corner: [f64; 3],
    /// The two sides, from the corner.
    pub sides: [[f64; 3]; 2],
}

impl Quad {
    /// Returns the point with these shares of the sides.
    #[must_use]
    pub fn at(&self, [s, t]: [f64; 2]) -> [f64; 3] {
        [0, 1, 2].map(|k| self.corner[k] + s * self.sides[0][k] + t * self.sides[1][k])
    }

    /// Returns the unit normal.
    fn normal(&self) -> [f64; 3] {
        let [u, v] = self.sides;
        let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        n.map(|x| x / length(n))
    }
}

fn length(a: [f64; 3]) -> f64 {
    a.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Returns the corner of a ramp. The ramp climbs along y from there and extends along x.
#[must_use]
pub fn ramp_corner(i: u8) -> [f64; 2] {
    [0.8 + 2.0 * f64::from(i), 1.0]
}

/// Returns all surfaces.
#[must_use]
pub fn house() -> Vec<Quad> {
    let quad = |corner, u, v| Quad { corner, sides: [u, v] };
    let x = |l: f64| [l, 0.0, 0.0];
    let y = |l: f64| [0.0, l, 0.0];
    let z = |l: f64| [0.0, 0.0, l];
    let mut quads = vec![
        quad([0.0; 3], x(16.0), y(12.0)),
        // The upper floor, around the head of the stairs, and its underside.
        quad([6.5, 6.0, STOREY], x(9.5), y(6.0)),
        quad([6.5, 6.0, SLAB], x(9.5), y(6.0)),
        // Outer walls.
        quad([0.0; 3], x(16.0), z(6.0)),
        quad([0.0, 12.0, 0.0], x(16.0), z(6.0)),
        quad([0.0; 3], y(12.0), z(6.0)),
        quad([16.0, 0.0, 0.0], y(12.0), z(6.0)),
        // The wall with the door and the gap.
        quad([9.0, 6.0, 0.0], y(DOOR[0] - 6.0), z(SLAB)),
        quad([9.0, DOOR[1], 0.0], y(GAP[0] - DOOR[1]), z(SLAB)),
        quad([9.0, GAP[1], 0.0], y(12.0 - GAP[1]), z(SLAB)),
        quad([9.0, DOOR[0], DOOR[2]], y(DOOR[1] - DOOR[0]), z(SLAB - DOOR[2])),
    ];
    let ([x0, x1], [y0, y1], low) = LOW;
    quads.push(quad([x0, y0, low], x(x1 - x0), y(y1 - y0)));
    // Stairs: risers and treads; the last riser ends at the upper floor.
    let [rise, run] = STEP;
    let across = STAIRS[1] - STAIRS[0];
    for i in 0..17_u8 {
        let (along, up) = (STAIRS[2] + f64::from(i) * run, f64::from(i) * rise);
        quads.push(quad([along, STAIRS[0], up], y(across), z(rise)));
        let depth = if i < 16 { run } else { 6.5 - along };
        quads.push(quad([along, STAIRS[0], up + rise], x(depth), y(across)));
    }
    for (i, angle) in (0_u8..).zip(RAMPS) {
        let [left, front] = ramp_corner(i);
        let height = RAMP[0] * angle.to_radians().tan();
        quads.push(quad([left, front, 0.0], x(RAMP[1]), [0.0, RAMP[0], height]));
        quads.push(quad([left, front + RAMP[0], 0.0], x(RAMP[1]), z(height)));
    }
    for [cx, cy] in COLUMNS {
        let at = |i: u32| {
            let (s, c) = (f64::from(i) / f64::from(SIDES) * std::f64::consts::TAU).sin_cos();
            [cx + COLUMN * c, cy + COLUMN * s, 0.0]
        };
        quads.extend((0..SIDES).map(|i| {
            let [a, b] = [at(i), at(i + 1)];
            quad(a, [b[0] - a[0], b[1] - a[1], 0.0], z(2.5))
        }));
    }
    quads
}

/// Returns points on surfaces, one for each `spacing`² in a jittered lattice, with Gaussian noise
/// of this standard deviation along the normal.
#[must_use]
pub fn scanned(quads: &[Quad], spacing: f64, noise: f64, seed: u64) -> Vec<[f64; 3]> {
    let rng = &mut rng(seed);
    let mut points = Vec::new();
    for quad in quads {
        let normal = quad.normal();
        let [columns, rows] = quad.sides.map(|side| (length(side) / spacing).ceil());
        let cells = |n: f64| std::iter::successors(Some(0.0), |i| Some(i + 1.0)).take_while(move |i| *i < n);
        for column in cells(columns) {
            for row in cells(rows) {
                let share = [(column, columns), (row, rows)].map(|(i, n)| (i + rng.random::<f64>()) / n);
                let p = quad.at(share);
                let off = noise * gaussian(rng);
                points.push([0, 1, 2].map(|k| p[k] + off * normal[k]));
            }
        }
    }
    points
}

/// Returns the surfaces as triangles.
///
/// # Panics
/// If there are 2³⁰ surfaces.
#[must_use]
pub fn triangles(quads: &[Quad]) -> TriangleMesh {
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let vertices = quads.iter().flat_map(|quad| corners.map(|share| quad.at(share))).collect();
    let count = u32::try_from(quads.len()).expect("fewer than 2^30 surfaces");
    let faces = (0..count).flat_map(|i| [[0, 1, 2], [0, 2, 3]].map(|face| face.map(|v| 4 * i + v))).collect();
    TriangleMesh::new(vertices, faces).expect("corners are there")
}
