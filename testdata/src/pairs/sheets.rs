//! Flat sheets against flat sheets.

use nearmiss_geometry::Pose;
use rand::RngExt;

use super::place::{Placed, Stream, Wanted};
use crate::shapes::{Form, Primitive};

/// Returns width and depth of the first rectangle, and the height of the uppermost; all are
/// horizontal about the z axis.
fn extent(form: &Form) -> Option<[f64; 3]> {
    let Some(Primitive::Rectangle { u, v, .. }) = form.parts.first() else {
        return None;
    };
    let top = form.parts.iter().filter_map(|part| match part {
        Primitive::Rectangle { corner, .. } => Some(corner[2]),
        _ => None,
    });
    Some([u[0], v[1], top.fold(f64::NEG_INFINITY, f64::max)])
}

/// Places B above A, parallel, shifted sideways by less than half of either.
pub(super) fn parallel(a: &Form, b: &Form, wanted: Wanted, rng: &mut Stream) -> Option<Placed> {
    let [width, depth, top] = extent(a)?;
    extent(b)?;
    let aside = [0.4 * width, 0.4 * depth].map(|most| rng.random_range(-most..most));
    (wanted.gap > 0.0).then(|| Placed {
        pose_b: level(rng).with_translation([aside[0], aside[1], top + wanted.gap]),
        gap: wanted.gap,
    })
}

/// Places B midway between the two sheets of A, or nearer to one of them, depending on the wanted
/// gap.
pub(super) fn between(a: &Form, b: &Form, wanted: Wanted, rng: &mut Stream) -> Option<Placed> {
    let [width, _, top] = extent(a)?;
    extent(b)?;
    let aside = [0; 2].map(|_| rng.random_range(-0.2..0.2) * width);
    let offset = top - wanted.gap;
    let side = if rng.random_range(0.0..1.0) < 0.5 { -1.0 } else { 1.0 };
    (wanted.gap > 0.0 && offset >= 0.0).then(|| Placed {
        pose_b: level(rng).with_translation([aside[0], aside[1], side * offset]),
        gap: wanted.gap,
    })
}

/// Returns a turn about the z axis by any angle.
fn level(rng: &mut Stream) -> Pose {
    Pose::from_axis_angle([0.0, 0.0, 1.0], rng.random_range(0.0..std::f64::consts::TAU))
}

/// Places B steeply above A, one edge horizontal and `gap` above the highest sheet of A, or as far
/// below it.
pub(super) fn edge(a: &Form, b: &Form, wanted: Wanted, rng: &mut Stream) -> Option<Placed> {
    let [width, depth, top] = extent(a)?;
    let [_, length, _] = extent(b)?;
    let tilt = rng.random_range(55.0_f64..90.0).to_radians();
    let height = length * tilt.sin();
    // Without this limit, a shift downwards or sideways might separate B from A sooner than one
    // upwards. A shift moves the line in which B meets A's plane by up to √(1 + cot² 55°) = 1.22
    // times its length, and 0.4 is below 0.5/1.22.
    let least_other = (height + wanted.gap).min(0.4 * width.min(depth));
    if wanted.gap < 0.0 && least_other < -wanted.gap {
        return None;
    }
    // Turned about x, the edge y = −length/2 points down. B meets the level of A's top above its
    // own middle.
    let steep = Pose::from_axis_angle([1.0, 0.0, 0.0], tilt);
    let along = (-wanted.gap).max(0.0) / tilt.tan();
    let middle = [0.0, 0.5 * length * tilt.cos() - along, top + wanted.gap + 0.5 * height];
    Some(Placed { pose_b: level(rng).after(&steep.with_translation(middle)), gap: wanted.gap })
}
