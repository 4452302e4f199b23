//! Pairs of forms whose curves of intersection are known exactly.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::Vector3;
use nearmiss_geometry::Pose;

use crate::oracle::count;
use crate::shapes::{Form, Primitive, bowl, patch, sphere, torus};

/// Number of points of a true curve.
const POINTS: usize = 3000;

/// Two forms of one part each, with b in the pose in which it intersects a.
#[derive(Debug, Clone)]
pub struct Cut {
    /// Names of the two forms.
    pub name: &'static str,
    /// The first form.
    pub a: Form,
    /// The second form.
    pub b: Form,
    /// Pose of b in the frame of a.
    pub pose_b: Pose,
    /// The curves of intersection, in a's frame.
    pub curves: Vec<TrueCurve>,
}

/// A curve, given by many of its points.
#[derive(Debug, Clone)]
pub struct TrueCurve {
    /// `true` if the last point is joined to the first.
    pub closed: bool,
    /// Points in order.
    pub points: Vec<[f64; 3]>,
}

impl Cut {
    /// Returns, per h², how far the curve of intersection moves at its point `x` if each surface
    /// moves by h²H/2 to the hollow side, with mean curvature H. It is an upper bound: the least
    /// vector with these components along the two normals is no longer than their sum over the sine
    /// of the angle.
    #[must_use]
    pub fn aside(&self, x: [f64; 3]) -> f64 {
        let (na, ha) = bent(&self.a.parts[0], x);
        let (nb, hb) = bent(&self.b.parts[0], self.pose_b.apply_inverse(x));
        let nb = Vector3::from(self.pose_b.rotate(nb.into()));
        0.5 * (ha.abs() + hb.abs()) / na.cross(&nb).norm()
    }
}

impl Cut {
    /// Returns the greatest mean curvature of either surface along the curves.
    #[must_use]
    pub fn curvature(&self) -> f64 {
        let bends = |&x: &[f64; 3]| {
            let (_, a) = bent(&self.a.parts[0], x);
            let (_, b) = bent(&self.b.parts[0], self.pose_b.apply_inverse(x));
            a.abs().max(b.abs())
        };
        self.curves.iter().flat_map(|curve| curve.points.iter().map(bends)).fold(0.0, f64::max)
    }
}

/// Returns the normal and mean curvature of a sphere, bowl, torus or rectangle at its point `x`.
fn bent(part: &Primitive, x: [f64; 3]) -> (Vector3<f64>, f64) {
    let p = Vector3::from(x);
    match *part {
        Primitive::Sphere { centre, radius } => ((p - Vector3::from(centre)) / radius, 1.0 / radius),
        Primitive::Bowl { radius } => (p / radius, 1.0 / radius),
        Primitive::Torus { major, minor } => {
            let from_axis = p.x.hypot(p.y);
            let outwards = Vector3::new(p.x, p.y, 0.0) / from_axis;
            let n = (outwards * (from_axis - major) + Vector3::z() * p.z) / minor;
            (n, 0.5 * (1.0 / minor + (from_axis - major) / (minor * from_axis)))
        }
        Primitive::Rectangle { u, v, .. } => (Vector3::from(u).cross(&Vector3::from(v)).normalize(), 0.0),
        Primitive::Capsule { .. } => (Vector3::zeros(), f64::INFINITY),
    }
}

/// Returns the loop through `point`, which takes fractions of a turn.
fn closed(point: impl Fn(f64) -> [f64; 3]) -> TrueCurve {
    let points = (0..POINTS).map(|i| point(TAU * count(i) / count(POINTS))).collect();
    TrueCurve { closed: true, points }
}

/// Returns the curve through `point`, which takes parameters from 0 to 1.
fn open(point: impl Fn(f64) -> [f64; 3]) -> TrueCurve {
    let points = (0..=POINTS).map(|i| point(count(i) / count(POINTS))).collect();
    TrueCurve { closed: false, points }
}

/// Returns `a` and a plane, z = 0 in `pose`, as large as `a` or larger.
fn with_plane(name: &'static str, a: Form, side: f64, pose: Pose, curves: Vec<TrueCurve>) -> Cut {
    Cut { name, a, b: patch(side, side), pose_b: pose, curves }
}

/// Returns a pose that turns the plane z = 0 into the plane y = `offset`.
fn upright(offset: f64) -> Pose {
    Pose::from_axis_angle([1.0, 0.0, 0.0], FRAC_PI_2).with_translation([0.0, offset, 0.0])
}

/// Returns all cuts without a place where the surfaces touch, and few where they graze.
#[must_use]
pub fn clean() -> Vec<Cut> {
    vec![
        spheres(1.0, 0.8, 1.1),
        sphere_and_plane(1.0, 0.3),
        torus_and_level(1.0, 0.6, 0.2),
        torus_and_upright(1.0, 0.6, 0.0),
        torus_and_upright(1.0, 0.5, 0.3),
        torus_and_upright(1.0, 0.5, 0.8),
        coaxial_tori(),
        bowl_and_plane(1.0, 0.4),
        sphere_and_strip(1.0, 0.5),
    ]
}

/// Returns spheres about the origin and (`d`, 0, 0): a circle.
#[must_use]
pub fn spheres(radius_a: f64, radius_b: f64, d: f64) -> Cut {
    let x = 0.5 * (d * d + radius_a * radius_a - radius_b * radius_b) / d;
    let rho = (radius_a * radius_a - x * x).sqrt();
    Cut {
        name: "two spheres",
        a: sphere(radius_a),
        b: sphere(radius_b),
        pose_b: Pose::from_translation([d, 0.0, 0.0]),
        curves: vec![closed(|t| [x, rho * t.cos(), rho * t.sin()])],
    }
}

/// Returns a sphere and the plane z = `z`: a circle.
#[must_use]
pub fn sphere_and_plane(radius: f64, z: f64) -> Cut {
    let rho = (radius * radius - z * z).sqrt();
    let circle = closed(|t| [rho * t.cos(), rho * t.sin(), z]);
    let pose = Pose::from_translation([0.0, 0.0, z]);
    with_plane("a sphere and a plane", sphere(radius), 2.4 * radius, pose, vec![circle])
}

/// Returns a torus and the plane z = `z` across its axis: two circles.
#[must_use]
pub fn torus_and_level(major: f64, minor: f64, z: f64) -> Cut {
    let off = (minor * minor - z * z).sqrt();
    let side = 2.4 * (major + minor);
    let circles = [major - off, major + off].map(|rho| closed(|t| [rho * t.cos(), rho * t.sin(), z]));
    let pose = Pose::from_translation([0.0, 0.0, z]);
    with_plane("a torus and a plane across its axis", torus(major, minor), side, pose, circles.into())
}

/// Returns a torus and the plane y = `y` along its axis, a section of Perseus: two loops, a figure
/// of eight for `y` = `major` − `minor`, or one loop.
#[must_use]
pub fn torus_and_upright(major: f64, minor: f64, y: f64) -> Cut {
    let side = 2.4 * (major + minor);
    let at = |tube: f64, sign: f64| {
        let rho = major + minor * tube.cos();
        [sign * (rho * rho - y * y).max(0.0).sqrt(), y, minor * tube.sin()]
    };
    let curves = if y <= major - minor {
        [1.0, -1.0].map(|sign| closed(|t| at(t, sign))).into()
    } else {
        // To where the plane just touches the tube, and back on the other side.
        let widest = ((y - major) / minor).acos();
        vec![closed(|t| {
            // Evenly spread where the curve crosses x = 0.
            let (s, c) = t.sin_cos();
            at(widest * s, c.signum())
        })]
    };
    with_plane("a torus and a plane along its axis", torus(major, minor), side, upright(y), curves)
}

/// Returns two tori about one axis: two circles.
#[must_use]
pub fn coaxial_tori() -> Cut {
    let [(major_a, minor), (major_b, z)]: [(f64, f64); 2] = [(1.0, 0.5), (1.2, 0.4)];
    // Two circles of equal radii in the plane through the axis.
    let between = Vector3::new(0.5 * (major_a + major_b), 0.0, 0.5 * z);
    let apart = Vector3::new(major_b - major_a, 0.0, z);
    let along = Vector3::new(-apart.z, 0.0, apart.x) / apart.norm();
    let half = (minor * minor - 0.25 * apart.norm_squared()).sqrt();
    let circle = |sign: f64| {
        let p = between + along * (sign * half);
        closed(|t| [p.x * t.cos(), p.x * t.sin(), p.z])
    };
    Cut {
        name: "two tori about one axis",
        a: torus(major_a, minor),
        b: torus(major_b, minor),
        pose_b: Pose::from_translation([0.0, 0.0, z]),
        curves: vec![circle(1.0), circle(-1.0)],
    }
}

/// Two tori, the tube of b thinner than that of a. One loop where b enters a's tube, one where it
/// leaves it.
#[derive(Debug, Clone, Copy)]
struct Crossing {
    a: [f64; 2],
    b: [f64; 2],
    pose_b: Pose,
}

impl Crossing {
    /// Returns the loop on b where it passes the surface of a between the angles `outside` and
    /// `inside` along the tube of b. If it goes `across` the tube, the angle along b is a function
    /// of the angle about it; otherwise the reverse.
    fn curve(&self, outside: f64, inside: f64, across: bool) -> TrueCurve {
        let [major, minor] = self.b;
        let [major_a, minor_a] = self.a;
        closed(|t| {
            let at = |u: f64| {
                let [along, about] = if across { [u, t] } else { [t, u] };
                let rho = major + minor * about.cos();
                self.pose_b.apply([rho * along.cos(), rho * along.sin(), minor * about.sin()])
            };
            let height = |x: [f64; 3]| (x[0].hypot(x[1]) - major_a).hypot(x[2]) - minor_a;
            let (mut out, mut within) = (outside, inside);
            for _ in 0..60 {
                let middle = 0.5 * (out + within);
                *(if height(at(middle)) > 0.0 { &mut out } else { &mut within }) = middle;
            }
            at(0.5 * (out + within))
        })
    }
}

/// Returns pairs of tori whose tubes cross. Perpendicular or at a slant, each passes the tube of
/// the other twice, in four loops, or once, in two. In the last pair one ring is too narrow to
/// surround the other's tube, in two loops.
#[must_use]
pub fn crossing_tori() -> Vec<Cut> {
    let upright =
        |centre: [f64; 3]| Pose::from_axis_angle([1.0, 0.0, 0.0], FRAC_PI_2).with_translation(centre);
    let slanted = Pose::from_axis_angle([1.0, 0.0, 0.0], 0.9).with_translation([0.05, 0.0, 0.0]);
    let half = 0.5 * TAU;
    let twice = |far: f64| vec![[-far, 0.0], [far, 0.0], [half - far, half], [half + far, half]];
    let once = vec![[half - 0.7, half], [half + 0.7, half]];
    let cut = |name, [a, b]: [[f64; 2]; 2], pose_b: Pose, brackets: Vec<[f64; 2]>, across| {
        let tori = Crossing { a, b, pose_b };
        let curves = brackets.into_iter().map(|[out, within]| tori.curve(out, within, across)).collect();
        Cut { name, a: torus(a[0], a[1]), b: torus(b[0], b[1]), pose_b, curves }
    };
    vec![
        cut("two upright tori", [[1.0, 0.5], [1.0, 0.35]], upright([0.0; 3]), twice(0.9), true),
        cut("two slanted tori", [[1.0, 0.5], [1.1, 0.3]], slanted, twice(1.4), true),
        cut("two tori that cross once", [[1.0, 0.5], [1.5, 0.35]], upright([2.5, 0.0, 0.0]), once, true),
        cut(
            "a ring about a torus",
            [[1.0, 0.5], [0.75, 0.35]],
            upright([1.0, 0.0, 0.0]),
            vec![[0.5 * half, half], [1.5 * half, half]],
            false,
        ),
    ]
}

/// Returns an open half sphere and the plane y = `y`: half a circle, which ends at the rim twice.
#[must_use]
pub fn bowl_and_plane(radius: f64, y: f64) -> Cut {
    let rho = (radius * radius - y * y).sqrt();
    let arc = open(|share| {
        let (s, c) = (0.5 * TAU * share).sin_cos();
        [rho * c, y, -rho * s]
    });
    with_plane("an open half sphere and a plane", bowl(radius), 2.4 * radius, upright(y), vec![arc])
}

/// Returns a sphere and a strip of the plane z = 0, |y| ≤ `half`: two arcs, which end at the
/// strip's borders.
#[must_use]
pub fn sphere_and_strip(radius: f64, half: f64) -> Cut {
    let widest = (half / radius).asin();
    let arc = |sign: f64| {
        open(|share| {
            let (s, c) = (widest * (2.0 * share - 1.0)).sin_cos();
            [sign * radius * c, radius * s, 0.0]
        })
    };
    Cut {
        name: "a sphere and a strip",
        a: sphere(radius),
        b: patch(2.4 * radius, 2.0 * half),
        pose_b: Pose::IDENTITY,
        curves: vec![arc(1.0), arc(-1.0)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn true_curves_lie_on_both_forms_and_bend_as_they_do() {
        let mut cuts = clean();
        cuts.push(torus_and_upright(1.0, 0.5, 0.5));
        cuts.extend(crossing_tori());
        for cut in cuts {
            for curve in &cut.curves {
                for &x in &curve.points {
                    let off = cut.a.distance(x).max(cut.b.distance(cut.pose_b.apply_inverse(x)));
                    assert!(off < 1e-7, "{}: {x:?} is {off} off", cut.name);
                }
                let step = |i: usize| {
                    let next = curve.points[(i + 1) % curve.points.len()];
                    (Vector3::from(curve.points[i]) - Vector3::from(next)).norm()
                };
                let steps = curve.points.len() - usize::from(!curve.closed);
                let longest = (0..steps).map(step).fold(0.0, f64::max);
                assert!(longest < 0.01, "{}: a step of {longest}", cut.name);
            }
        }
    }

    #[test]
    fn curvature_is_what_a_larger_form_gains_in_area() {
        // H is half the divergence of the normals of parallel surfaces.
        for part in [torus(1.0, 0.5), sphere(0.7), patch(1.0, 1.0)].map(|form| form.parts[0]) {
            let x = match part {
                Primitive::Torus { .. } => [0.9, 0.9, 0.45],
                Primitive::Sphere { .. } => [0.3, 0.4, 0.4],
                _ => [0.1, 0.2, 0.0],
            };
            let e = 1e-5;
            let on = |k: usize, sign: f64| {
                let mut y = x;
                y[k] += sign * e;
                y
            };
            // The trace of the second derivatives of the distance function.
            let d = |y: [f64; 3]| {
                let [px, py, pz] = y;
                match part {
                    Primitive::Torus { major, minor } => (px.hypot(py) - major).hypot(pz) - minor,
                    Primitive::Sphere { radius, .. } => px.hypot(py).hypot(pz) - radius,
                    _ => pz,
                }
            };
            let trace: f64 = (0..3).map(|k| (d(on(k, 1.0)) + d(on(k, -1.0)) - 2.0 * d(x)) / (e * e)).sum();
            // The surface parallel to the form through x has the same normals; its own radius is larger by
            // d(x).
            let parallel = match part {
                Primitive::Torus { major, minor } => Primitive::Torus { major, minor: minor + d(x) },
                Primitive::Sphere { centre, radius } => Primitive::Sphere { centre, radius: radius + d(x) },
                other => other,
            };
            let (_, h) = bent(&parallel, x);
            assert!((0.5 * trace - h).abs() < 1e-4, "{part:?}: {} for {h}", 0.5 * trace);
        }
    }
}
