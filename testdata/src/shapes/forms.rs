//! The forms, their dimensions and positions. Lengths are in one unit throughout.

use nalgebra::Vector3;

use super::form::Form;
use super::primitive::Primitive;

impl Form {
    /// Returns the least and greatest coordinates of a box around the primitive.
    pub(super) fn bounds(&self) -> (Vector3<f64>, Vector3<f64>) {
        let all = self.parts.iter().map(Primitive::bounds);
        all.fold(
            (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)),
            |(low, high), (l, h)| (low.inf(&l), high.sup(&h)),
        )
    }
}

impl Primitive {
    fn bounds(&self) -> (Vector3<f64>, Vector3<f64>) {
        let about = |centre: Vector3<f64>, half: Vector3<f64>| (centre - half, centre + half);
        let zero = Vector3::zeros();
        match *self {
            Self::Sphere { centre, radius } => about(centre.into(), Vector3::repeat(radius)),
            Self::Bowl { radius } => about(zero, Vector3::repeat(radius)),
            Self::Torus { major, minor } => about(zero, Vector3::new(major + minor, major + minor, minor)),
            Self::Capsule { half, radius } => about(zero, Vector3::new(radius, radius, half + radius)),
            Self::Rectangle { corner, u, v } => {
                let corner = Vector3::from(corner);
                let (u, v) = (Vector3::from(u), Vector3::from(v));
                let far = corner + u + v;
                let (a, b) = (corner + u, corner + v);
                (corner.inf(&far).inf(&a).inf(&b), corner.sup(&far).sup(&a).sup(&b))
            }
        }
    }
}

fn form(name: &'static str, parts: Vec<Primitive>) -> Form {
    Form { name, parts, connected: true }
}

fn rectangle(corner: [f64; 3], u: [f64; 3], v: [f64; 3]) -> Primitive {
    Primitive::Rectangle { corner, u, v }
}

/// Returns a sphere about the origin.
#[must_use]
pub fn sphere(radius: f64) -> Form {
    let centre = [0.0; 3];
    form("sphere", vec![Primitive::Sphere { centre, radius }])
}

/// Returns a torus about the z axis: a tube of radius `minor` about a circle of radius `major`.
#[must_use]
pub fn torus(major: f64, minor: f64) -> Form {
    form("torus", vec![Primitive::Torus { major, minor }])
}

/// Returns the half z ≤ 0 of a sphere about the origin: open above, with a rim.
#[must_use]
pub fn bowl(radius: f64) -> Form {
    form("bowl", vec![Primitive::Bowl { radius }])
}

/// Returns an upright capsule about the origin, `height` tall with its caps: an avatar in a
/// building.
#[must_use]
pub fn avatar(height: f64, radius: f64) -> Form {
    let half = 0.5 * height - radius;
    form("avatar", vec![Primitive::Capsule { half, radius }])
}

/// Returns a rectangle in the plane z = 0 about the origin.
#[must_use]
pub fn patch(width: f64, depth: f64) -> Form {
    form("patch", vec![level(width, depth, 0.0)])
}

/// Returns two patches one above the other at z = ±`distance`/2.
#[must_use]
pub fn plates(width: f64, depth: f64, distance: f64) -> Form {
    Form {
        connected: false,
        ..form("plates", vec![level(width, depth, -0.5 * distance), level(width, depth, 0.5 * distance)])
    }
}

fn level(width: f64, depth: f64, z: f64) -> Primitive {
    rectangle([-0.5 * width, -0.5 * depth, z], [width, 0.0, 0.0], [0.0, depth, 0.0])
}

/// Returns a floor z = 0 for x ≤ 0 and a floor z = `riser` for x ≥ 0, each `tread` deep, joined by
/// the riser x = 0; `width` wide, y from −`width`/2.
#[must_use]
pub fn step(tread: f64, riser: f64, width: f64) -> Form {
    let across = [0.0, width, 0.0];
    let y = -0.5 * width;
    form(
        "step",
        vec![
            rectangle([-tread, y, 0.0], [tread, 0.0, 0.0], across),
            rectangle([0.0, y, 0.0], [0.0, 0.0, riser], across),
            rectangle([0.0, y, riser], [tread, 0.0, 0.0], across),
        ],
    )
}

/// Returns the six faces of a box about the origin.
#[must_use]
pub fn cuboid(extent: [f64; 3]) -> Form {
    let mut parts = Vec::with_capacity(6);
    for k in 0..3 {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let edge = |axis: usize| {
            let mut e = [0.0; 3];
            e[axis] = extent[axis];
            e
        };
        let low = extent.map(|e| -0.5 * e);
        let mut high = low;
        high[k] = 0.5 * extent[k];
        parts.push(rectangle(low, edge(i), edge(j)));
        parts.push(rectangle(high, edge(i), edge(j)));
    }
    form("box", parts)
}

/// Returns two spheres about the origin, a ball in a hollow ball.
#[must_use]
pub fn shells(inner: f64, outer: f64) -> Form {
    let shell = |radius| Primitive::Sphere { centre: [0.0; 3], radius };
    Form { connected: false, ..form("shells", vec![shell(inner), shell(outer)]) }
}

/// Returns spheres of one radius that do not touch, on a lattice with `counts` nodes along the
/// axes, from the origin. Every other layer is shifted by half a pitch: the *spheres* of Klein &
/// Zachmann 2004. They are separated if `pitch` exceeds 2 `radius`.
#[must_use]
pub fn field(counts: [u8; 3], pitch: f64, radius: f64) -> Form {
    let mut parts = Vec::new();
    for z in 0..counts[2] {
        for y in 0..counts[1] {
            for x in 0..counts[0] {
                let shift = 0.5 * f64::from(z % 2);
                let centre =
                    [pitch * (f64::from(x) + shift), pitch * (f64::from(y) + shift), pitch * f64::from(z)];
                parts.push(Primitive::Sphere { centre, radius });
            }
        }
    }
    Form { connected: false, ..form("field", parts) }
}

/// Returns crossing square bars, `thickness` thick, in a square lattice of `n` by `n` nodes `pitch`
/// apart, about the origin in the plane z = 0: the *grid* of Klein & Zachmann 2004.
///
/// The four faces of each bar run through the bars it crosses, and ends are open, so it is no
/// manifold. [`Form::spacing_for`] gives the sampling for a wanted number of points (197,000 in the
/// paper).
#[must_use]
pub fn bars(n: u8, pitch: f64, thickness: f64) -> Form {
    let length = f64::from(n) * pitch;
    let low = -0.5 * thickness;
    let mut parts = Vec::new();
    for i in 0..n {
        let at = pitch * (f64::from(i) - 0.5 * (f64::from(n) - 1.0));
        // Across the bar and up; the bar itself runs along x, or along y with x and y exchanged.
        let faces = [
            ([low, low], [thickness, 0.0]),
            ([low, -low], [thickness, 0.0]),
            ([low, low], [0.0, thickness]),
            ([-low, low], [0.0, thickness]),
        ];
        for ([y, z], [v, w]) in faces {
            parts.push(rectangle([-0.5 * length, at + y, z], [length, 0.0, 0.0], [0.0, v, w]));
            parts.push(rectangle([at + y, -0.5 * length, z], [0.0, length, 0.0], [v, 0.0, w]));
        }
    }
    form("bars", parts)
}

/// Returns a building of two storeys, each 2.4 high, 4 by 3 wide, z up from 0. It has two floors,
/// two outer walls, on the lower floor a wall with a door, and a staircase of two flights with a
/// landing between them. The other two sides and the top are open.
///
/// Steps are 0.4 high and 0.6 deep, coarser than real ones, so that some thousand points can
/// represent them.
#[must_use]
pub fn building() -> Form {
    const STOREY: f64 = 2.4;
    const WELL: f64 = 1.0;
    const RISE: f64 = 0.4;
    const TREAD: f64 = 0.6;
    let x = |l: f64| [l, 0.0, 0.0];
    let y = |l: f64| [0.0, l, 0.0];
    let z = |l: f64| [0.0, 0.0, l];
    let mut parts = vec![
        // Lower floor; upper floor beside the stairwell, which is at x 0 to 2, y 1 to 3.
        rectangle([0.0; 3], x(4.0), y(3.0)),
        rectangle([0.0, 0.0, STOREY], x(4.0), y(WELL)),
        rectangle([2.0, WELL, STOREY], x(2.0), y(3.0 - WELL)),
        // Outer walls.
        rectangle([0.0, 3.0, 0.0], x(4.0), z(2.0 * STOREY)),
        rectangle([0.0; 3], y(3.0), z(2.0 * STOREY)),
        // The inner wall y = 1, x 2 to 4, with a door 0.9 wide and 1.9 high.
        rectangle([2.0, WELL, 0.0], x(0.5), z(STOREY)),
        rectangle([3.4, WELL, 0.0], x(0.6), z(STOREY)),
        rectangle([2.5, WELL, 1.9], x(0.9), z(STOREY - 1.9)),
    ];
    // First flight: from (2, 2..3) towards −x up to the landing; second: back along y 1..2 up to the upper
    // floor.
    let mut at = (2.0, 0.0);
    for _ in 0..2 {
        parts.push(rectangle([at.0, 2.0, at.1], y(1.0), z(RISE)));
        at.1 += RISE;
        parts.push(rectangle([at.0, 2.0, at.1], x(-TREAD), y(1.0)));
        at.0 -= TREAD;
    }
    parts.push(rectangle([at.0, 2.0, at.1], y(1.0), z(RISE)));
    at.1 += RISE;
    parts.push(rectangle([at.0, WELL, at.1], x(-at.0), y(2.0)));
    for _ in 0..2 {
        parts.push(rectangle([at.0, WELL, at.1], y(1.0), z(RISE)));
        at.1 += RISE;
        parts.push(rectangle([at.0, WELL, at.1], x(TREAD), y(1.0)));
        at.0 += TREAD;
    }
    parts.push(rectangle([at.0, WELL, at.1], y(1.0), z(RISE)));
    form("building", parts)
}
