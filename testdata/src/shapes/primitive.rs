//! The surfaces that make up forms: distance, evenly spread points with normals, and ends.

use std::f64::consts::{PI, TAU};

use nalgebra::Vector3;
use rand::{Rng, RngExt};

use crate::arbitrary::unit_vector;
use crate::oracle::count;

/// A piece of surface; lengths in the unit of the form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Primitive {
    /// A whole sphere.
    Sphere {
        /// Middle.
        centre: [f64; 3],
        /// Radius.
        radius: f64,
    },
    /// The half z ≤ 0 of a sphere about the origin, without lid.
    Bowl {
        /// Radius.
        radius: f64,
    },
    /// A torus about the z axis through the origin.
    Torus {
        /// Radius of the central circle.
        major: f64,
        /// Radius of the tube, less than `major`.
        minor: f64,
    },
    /// All points at one distance from the segment (0, 0, ±`half`).
    Capsule {
        /// Half the length of the segment.
        half: f64,
        /// Distance from the segment.
        radius: f64,
    },
    /// A rectangle with its edges.
    Rectangle {
        /// A corner.
        corner: [f64; 3],
        /// The first edge, from the corner.
        u: [f64; 3],
        /// The second edge, perpendicular to `u`.
        v: [f64; 3],
    },
}

/// A point of a surface and the unit normal there.
pub(super) type Oriented = (Vector3<f64>, Vector3<f64>);

impl Primitive {
    /// Returns the distance of `x` to the nearest point.
    #[must_use]
    pub fn distance(&self, x: [f64; 3]) -> f64 {
        let p = Vector3::from(x);
        match *self {
            Self::Sphere { centre, radius } => ((p - Vector3::from(centre)).norm() - radius).abs(),
            Self::Bowl { radius } if p.z <= 0.0 => (p.norm() - radius).abs(),
            Self::Bowl { radius } => (p.x.hypot(p.y) - radius).hypot(p.z),
            Self::Torus { major, minor } => ((p.x.hypot(p.y) - major).hypot(p.z) - minor).abs(),
            Self::Capsule { half, radius } => {
                let foot = Vector3::new(0.0, 0.0, p.z.clamp(-half, half));
                ((p - foot).norm() - radius).abs()
            }
            Self::Rectangle { corner, u, v } => {
                let [s, t] = foot(x, corner, u, v);
                (p - rectangle_point(corner, u, v, [s, t]).0).norm()
            }
        }
    }

    /// Returns `true` if the nearest point to `x` is a corner of a rectangle.
    pub(crate) fn is_nearest_at_corner(&self, x: [f64; 3]) -> bool {
        let Self::Rectangle { corner, u, v } = *self else {
            return false;
        };
        foot(x, corner, u, v).iter().all(|s| *s <= 0.0 || *s >= 1.0)
    }

    /// Returns the distance from `x` to a far point of the primitive, not necessarily the farthest.
    pub(crate) fn reach(&self, x: [f64; 3]) -> f64 {
        let p = Vector3::from(x);
        match *self {
            Self::Sphere { centre, radius } => (p - Vector3::from(centre)).norm() + radius,
            Self::Bowl { radius } => (p.x.hypot(p.y) + radius).hypot(p.z),
            Self::Torus { major, minor } => (p.x.hypot(p.y) + major + minor).hypot(p.z),
            Self::Capsule { half, radius } => p.x.hypot(p.y).hypot(p.z.abs() + half + radius),
            Self::Rectangle { corner, u, v } => {
                let corners = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]];
                let away = corners.map(|st| (rectangle_point(corner, u, v, st).0 - p).norm());
                away.into_iter().fold(0.0, f64::max)
            }
        }
    }

    /// Returns the area.
    #[must_use]
    pub fn area(&self) -> f64 {
        match *self {
            Self::Sphere { radius, .. } => 2.0 * TAU * radius * radius,
            Self::Bowl { radius } => TAU * radius * radius,
            Self::Torus { major, minor } => TAU * major * TAU * minor,
            Self::Capsule { half, radius } => 2.0 * TAU * radius * (half + radius),
            Self::Rectangle { u, v, .. } => Vector3::from(u).cross(&Vector3::from(v)).norm(),
        }
    }

    /// Returns a random point, uniform by area.
    pub fn random_point<R: Rng>(&self, rng: &mut R) -> [f64; 3] {
        self.random_oriented(rng).0.into()
    }

    pub(super) fn random_oriented<R: Rng>(&self, rng: &mut R) -> Oriented {
        match *self {
            Self::Sphere { centre, radius } => {
                let n = Vector3::from(unit_vector(rng));
                (Vector3::from(centre) + radius * n, n)
            }
            Self::Bowl { radius } => {
                let n = Vector3::from(unit_vector(rng));
                let n = Vector3::new(n.x, n.y, -n.z.abs());
                (radius * n, n)
            }
            Self::Torus { major, minor } => loop {
                // Area is proportional to the distance from the axis.
                let tube = rng.random_range(0.0..TAU);
                let axis_distance = major + minor * tube.cos();
                if rng.random_range(0.0..major + minor) < axis_distance {
                    return torus_point(major, minor, rng.random_range(0.0..TAU), tube);
                }
            },
            Self::Capsule { half, radius } => {
                let n = Vector3::from(unit_vector(rng));
                let z = rng.random_range(-(half + radius)..half + radius);
                if z.abs() < half {
                    let flat = Vector3::new(n.x, n.y, 0.0).normalize();
                    (radius * flat + z * Vector3::z(), flat)
                } else {
                    (radius * n + half.copysign(n.z) * Vector3::z(), n)
                }
            }
            Self::Rectangle { corner, u, v } => {
                let (s, t): (f64, f64) = (rng.random_range(0.0..1.0), rng.random_range(0.0..1.0));
                rectangle_point(corner, u, v, [s, t])
            }
        }
    }

    /// Returns points about `spacing` apart in a regular pattern, [`Primitive::end`] included.
    pub(super) fn regular(&self, spacing: f64) -> Vec<Oriented> {
        match *self {
            Self::Sphere { centre, radius } => {
                let centre = Vector3::from(centre);
                let unit = spiral(self.area(), spacing, -1.0, 1.0);
                unit.map(|n| (centre + radius * n, n)).collect()
            }
            Self::Bowl { radius } => {
                // The spiral's last turn keeps away from the points on the rim.
                let top = -0.75 * spacing / radius;
                let unit = spiral(self.area() * (1.0 + top), spacing, -1.0, top);
                let mut points = self.end(spacing);
                points.extend(unit.map(|n| (radius * n, n)));
                points
            }
            Self::Torus { major, minor } => {
                let rows = steps(TAU * minor, spacing);
                rings(rows, spacing, |row| {
                    let tube = TAU * count(row) / count(rows);
                    (major + minor * tube.cos(), move |turn| torus_point(major, minor, turn, tube))
                })
            }
            Self::Capsule { half, radius } => {
                let profile = PI * radius + 2.0 * half;
                let rows = steps(profile, spacing);
                rings(rows, spacing, |row| {
                    let arc = profile * (count(row) + 0.5) / count(rows) - 0.5 * profile;
                    let beyond = (arc.abs() - half).max(0.0) / radius;
                    let z = arc.clamp(-half, half);
                    let tilt = beyond.copysign(arc);
                    (radius * tilt.cos(), move |turn: f64| {
                        let n = Vector3::new(tilt.cos() * turn.cos(), tilt.cos() * turn.sin(), tilt.sin());
                        (radius * n + z * Vector3::z(), n)
                    })
                })
            }
            Self::Rectangle { corner, u, v } => {
                let (nu, nv) = (steps(length(u), spacing), steps(length(v), spacing));
                let node = |i: usize, j: usize| [count(i) / count(nu), count(j) / count(nv)];
                let nodes = (0..=nu).flat_map(|i| (0..=nv).map(move |j| (i, j)));
                nodes.map(|(i, j)| rectangle_point(corner, u, v, node(i, j))).collect()
            }
        }
    }

    /// Returns points about `spacing` apart on the line where the surface ends; none if it has no
    /// end.
    pub(super) fn end(&self, spacing: f64) -> Vec<Oriented> {
        match *self {
            Self::Bowl { radius } => {
                let n = steps(TAU * radius, spacing);
                let turn = |i| TAU * count(i) / count(n);
                let normal = |i| Vector3::new(f64::cos(turn(i)), f64::sin(turn(i)), 0.0);
                (0..n).map(|i| (radius * normal(i), normal(i))).collect()
            }
            Self::Rectangle { corner, u, v } => {
                let (nu, nv) = (steps(length(u), spacing), steps(length(v), spacing));
                let along_u = (0..=nu).flat_map(|i| [0.0, 1.0].map(|t| [count(i) / count(nu), t]));
                let along_v = (1..nv).flat_map(|j| [0.0, 1.0].map(|s| [s, count(j) / count(nv)]));
                along_u.chain(along_v).map(|st| rectangle_point(corner, u, v, st)).collect()
            }
            Self::Sphere { .. } | Self::Torus { .. } | Self::Capsule { .. } => Vec::new(),
        }
    }
}

/// Returns the position on a rectangle of the nearest point to `x`, in units of its edges.
fn foot(x: [f64; 3], corner: [f64; 3], u: [f64; 3], v: [f64; 3]) -> [f64; 2] {
    let d = Vector3::from(x) - Vector3::from(corner);
    [u, v].map(|edge| {
        let edge = Vector3::from(edge);
        (d.dot(&edge) / edge.norm_squared()).clamp(0.0, 1.0)
    })
}

fn length(v: [f64; 3]) -> f64 {
    Vector3::from(v).norm()
}

/// Returns the number of steps of about `spacing` in `length`, at least one.
pub(super) fn steps(length: f64, spacing: f64) -> usize {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small positive number")]
    let n = (length / spacing).round().max(1.0) as usize;
    n
}

pub(super) fn rectangle_point(corner: [f64; 3], u: [f64; 3], v: [f64; 3], [s, t]: [f64; 2]) -> Oriented {
    let (u, v) = (Vector3::from(u), Vector3::from(v));
    (Vector3::from(corner) + s * u + t * v, u.cross(&v).normalize())
}

pub(super) fn torus_point(major: f64, minor: f64, turn: f64, tube: f64) -> Oriented {
    let outwards = Vector3::new(turn.cos(), turn.sin(), 0.0);
    let n = tube.cos() * outwards + tube.sin() * Vector3::z();
    (major * outwards + minor * n, n)
}

/// Returns unit vectors with z from `low` to `high` on a Fibonacci spiral, with the given `spacing`
/// on `area`.
fn spiral(area: f64, spacing: f64, low: f64, high: f64) -> impl Iterator<Item = Vector3<f64>> {
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    let n = steps(area, spacing * spacing);
    (0..n).map(move |i| {
        let z = low + (high - low) * (count(i) + 0.5) / count(n);
        let (s, c) = (golden * count(i)).sin_cos();
        let flat = (1.0 - z * z).sqrt();
        Vector3::new(flat * c, flat * s, z)
    })
}

/// Returns points on `rows` circles; `row` gives a circle's radius and its point at an angle. Every
/// other row is turned by half a step.
fn rings<F: Fn(f64) -> Oriented>(
    rows: usize,
    spacing: f64,
    row: impl Fn(usize) -> (f64, F),
) -> Vec<Oriented> {
    let mut points = Vec::new();
    for i in 0..rows {
        let (radius, point) = row(i);
        let n = steps(TAU * radius, spacing);
        let phase = 0.5 * count(i % 2);
        points.extend((0..n).map(|k| point(TAU * (count(k) + phase) / count(n))));
    }
    points
}
