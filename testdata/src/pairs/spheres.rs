//! Pairs of two spheres, two tori or two bowls.

use nalgebra::Vector3;
use nearmiss_geometry::Pose;
use rand::RngExt;

use super::place::{Placed, Stream, Wanted};
use crate::arbitrary::{rotation, unit_vector};
use crate::shapes::{Form, Primitive};

/// Returns the radii of two single spheres.
fn spheres(a: &Form, b: &Form) -> Option<[f64; 2]> {
    match (&a.parts[..], &b.parts[..]) {
        ([Primitive::Sphere { radius, .. }], [Primitive::Sphere { radius: q, .. }]) => Some([*radius, *q]),
        _ => None,
    }
}

/// Places any two spheres with centres `d` apart, in a random direction, turned at random.
fn at_distance([radius, q]: [f64; 2], d: f64, rng: &mut Stream) -> Placed {
    let centre = d * Vector3::from(unit_vector(rng));
    let (outer, inner) = (d - radius - q, (radius - q).abs() - d);
    Placed {
        pose_b: rotation(rng).with_translation(centre.into()),
        // At most one of the two is positive. If both are negative, the surfaces cross.
        gap: outer.max(inner),
    }
}

/// Keeps a placement only if it has the wanted gap.
fn as_wanted(placed: Placed, wanted: Wanted) -> Option<Placed> {
    ((placed.gap - wanted.gap).abs() < 1e-12).then_some(placed)
}

pub(super) fn apart(a: &Form, b: &Form, wanted: Wanted, rng: &mut Stream) -> Option<Placed> {
    let radii = spheres(a, b)?;
    as_wanted(at_distance(radii, radii[0] + radii[1] + wanted.gap, rng), wanted)
}

pub(super) fn nested(a: &Form, b: &Form, wanted: Wanted, rng: &mut Stream) -> Option<Placed> {
    let radii = spheres(a, b)?;
    let d = radii[0] - radii[1] - wanted.gap;
    (d >= 0.0).then(|| as_wanted(at_distance(radii, d, rng), wanted))?
}

pub(super) fn shifted(a: &Form, b: &Form, wanted: Wanted, rng: &mut Stream) -> Option<Placed> {
    let radii = spheres(a, b)?;
    (wanted.gap < 0.0).then(|| as_wanted(at_distance(radii, -wanted.gap, rng), wanted))?
}

fn torus(form: &Form) -> Option<[f64; 2]> {
    match form.parts[..] {
        [Primitive::Torus { major, minor }] => Some([major, minor]),
        _ => None,
    }
}

/// Returns a turn about the z axis by any angle.
fn spin(rng: &mut Stream) -> Pose {
    Pose::from_axis_angle([0.0, 0.0, 1.0], rng.random_range(0.0..std::f64::consts::TAU))
}

pub(super) fn linked(a: &Form, _: &Form, wanted: Wanted, rng: &mut Stream) -> Option<Placed> {
    let [major, minor] = torus(a)?;
    let e = major - 2.0 * minor - wanted.gap;
    if !(0.0..=major).contains(&e) {
        return None;
    }
    // B's circle is in a plane through A's axis. Its middle is on A's circle, and is moved outwards
    // by e.
    let upright = Pose::from_axis_angle([1.0, 0.0, 0.0], std::f64::consts::FRAC_PI_2);
    let out = upright.after(&spin(rng)).with_translation([major + e, 0.0, 0.0]);
    Some(Placed { pose_b: spin(rng).after(&out), gap: major - e - 2.0 * minor })
}

pub(super) fn stacked(a: &Form, _: &Form, wanted: Wanted, rng: &mut Stream) -> Option<Placed> {
    let [_, minor] = torus(a)?;
    let z = 2.0 * minor + wanted.gap;
    // Nearer, the two surfaces nearly coincide, which is another case.
    (z >= 3.0 * wanted.r)
        .then(|| Placed { pose_b: spin(rng).with_translation([0.0, 0.0, z]), gap: z - 2.0 * minor })
}

pub(super) fn rims(a: &Form, _: &Form, wanted: Wanted, rng: &mut Stream) -> Option<Placed> {
    let [Primitive::Bowl { radius }] = a.parts[..] else {
        return None;
    };
    // With less, the rims nearly coincide.
    let e = rng.random_range(0.4..1.0) * radius;
    let over = Pose::from_axis_angle([1.0, 0.0, 0.0], std::f64::consts::PI);
    let pose = over.after(&spin(rng)).with_translation([e, 0.0, wanted.gap]);
    let sideways = 2.0 * radius - e.hypot(wanted.gap);
    (wanted.gap > 0.0 || -wanted.gap <= sideways)
        .then(|| Placed { pose_b: spin(rng).after(&pose), gap: wanted.gap })
}
