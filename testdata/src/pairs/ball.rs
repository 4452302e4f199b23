//! Placements of a ball, or an upright capsule, at a given distance from any form.

use nalgebra::Vector3;
use nearmiss_geometry::Pose;
use rand::RngExt;

use super::place::{Placed, Stream, Wanted};
use crate::arbitrary::{rotation, unit_vector};
use crate::shapes::{Form, Primitive};

/// Places the sphere `b` with its centre q + gap from the form `a`, on a random ray from a random
/// point of `a`.
pub(super) fn ball(a: &Form, b: &Form, wanted: Wanted, rng: &mut Stream) -> Option<Placed> {
    let [Primitive::Sphere { radius, .. }] = b.parts[..] else {
        return None;
    };
    let centre = approach(a, radius + wanted.gap, rng, |x| a.distance(x))?;
    is_fair(a, centre, radius - wanted.gap, wanted)
        .then(|| Placed { pose_b: rotation(rng).with_translation(centre), gap: a.distance(centre) - radius })
}

/// Places the capsule `b`, upright, with its segment q + gap from the form `a`.
pub(super) fn avatar(a: &Form, b: &Form, wanted: Wanted, rng: &mut Stream) -> Option<Placed> {
    let [Primitive::Capsule { half, radius }] = b.parts[..] else {
        return None;
    };
    let segment = |x: [f64; 3]| segment_distance(a, x, half);
    let middle = approach(a, radius + wanted.gap, rng, |x| segment(x).0)?;
    let (distance, nearest) = segment(middle);
    is_fair(a, nearest, radius - wanted.gap + 2.0 * half, wanted).then(|| Placed {
        pose_b: Pose::from_axis_angle([0.0, 0.0, 1.0], rng.random_range(0.0..std::f64::consts::TAU))
            .with_translation(middle),
        gap: distance - radius,
    })
}

/// Returns the first point with `distance` equal to `target` on a random ray from a random point of
/// `a`.
fn approach(a: &Form, target: f64, rng: &mut Stream, distance: impl Fn([f64; 3]) -> f64) -> Option<[f64; 3]> {
    const STRIDES: u32 = 80;
    const HALVINGS: u32 = 60;
    if target < 0.0 {
        return None;
    }
    let part = a.parts[rng.random_range(0..a.parts.len())];
    let start = Vector3::from(part.random_point(rng));
    let direction = Vector3::from(unit_vector(rng));
    let at = |t: f64| -> [f64; 3] { (start + t * direction).into() };
    // The distance changes by at most one stride a stride. A coarse walk may step over a narrow
    // place, which does no harm.
    let stride = (0.2 * target).max(0.02);
    let beyond = (1..=STRIDES).map(|k| stride * f64::from(k)).find(|t| distance(at(*t)) >= target)?;
    let (mut low, mut high) = (beyond - stride, beyond);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if distance(at(middle)) < target {
            low = middle;
        } else {
            high = middle;
        }
    }
    let found = at(high);
    ((distance(found) - target).abs() < 1e-12).then_some(found)
}

/// Returns `true` for separated pairs. For intersecting ones, the component of `a` nearest to `x`
/// must extend at least `reach` from `x`, that is out of B by the wanted depth, so that it crosses
/// B. And its nearest point must not be a corner that smoothing may remove.
fn is_fair(a: &Form, x: [f64; 3], reach: f64, wanted: Wanted) -> bool {
    /// Smoothing moves a cube's corner by about 0.8 r.
    const CORNER_DEPTH: f64 = 2.0;
    if wanted.gap > 0.0 {
        return true;
    }
    let depth = -wanted.gap;
    let nearest = a.parts.iter().min_by(|p, q| p.distance(x).total_cmp(&q.distance(x)));
    let Some(nearest) = nearest else { return false };
    let far = |part: &Primitive| part.reach(x) >= reach;
    let crosses = if a.connected { a.parts.iter().any(far) } else { far(nearest) };
    crosses && (depth > CORNER_DEPTH * wanted.r || !nearest.is_nearest_at_corner(x))
}

/// Returns the distance of the vertical segment of half length `half` about `middle` to the
/// rectangles of `a`, and the point of the segment at that distance.
fn segment_distance(a: &Form, middle: [f64; 3], half: f64) -> (f64, [f64; 3]) {
    // (2/3)^80 of the segment is below rounding.
    const CUTS: u32 = 80;
    let at = |t: f64| [middle[0], middle[1], middle[2] + t];
    let mut best = (f64::INFINITY, middle);
    for part in &a.parts {
        // No point of the segment is nearer than this.
        if part.distance(middle) - half > best.0 {
            continue;
        }
        let (mut low, mut high) = (-half, half);
        for _ in 0..CUTS {
            let third = (high - low) / 3.0;
            if part.distance(at(low + third)) <= part.distance(at(high - third)) {
                high -= third;
            } else {
                low += third;
            }
        }
        let x = at(0.5 * (low + high));
        if part.distance(x) < best.0 {
            best = (part.distance(x), x);
        }
    }
    best
}
