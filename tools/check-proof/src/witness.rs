//! Checks that a point is on a surface, or near it, by the formulas alone and with all of the
//! points.

use nearmiss::hierarchy::GatherScratch;
use nearmiss::surface::project;
use nearmiss_testdata::oracle::{BORDER, Evaluation, GAP, Status, THIN};

use crate::placement::Placement;
use crate::subject::Subject;

/// Greatest |f| of a witness, in bandwidths. Its |f| in single precision is at most 1e-6.
const ON_SURFACE: f64 = 1e-5;

/// Single-precision error of a distance relative to a support radius, and of a quantity relative to
/// a condition's bound.
const DISTANCE: f64 = 1e-5;
const CONDITION: f64 = 1e-4;

/// Number of cloud points from which a surface point near a witness is searched, and of steps from
/// each towards the witness.
const STARTS: usize = 512;
const STEPS: usize = 12;

/// A point verified to be on a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Seen {
    /// |f| in bandwidths.
    pub(crate) off: f64,
    /// |f| and the bandwidth in the world.
    pub(crate) residual: f64,
    pub(crate) bandwidth: f64,
    /// `true` if a condition of the surface holds only up to rounding.
    pub(crate) on_the_brink: bool,
}

/// # Errors
/// If the point `x` of the world is not on the surface.
pub(crate) fn check(subject: &Subject, placement: &Placement, x: [f64; 3]) -> Result<Seen, String> {
    check_stored(subject, placement, placement.stored(x))
}

/// Does the same as [`check`], for a point among the stored positions.
fn check_stored(subject: &Subject, placement: &Placement, x: [f64; 3]) -> Result<Seen, String> {
    let Some(at) = subject.twin.evaluate(x) else {
        return Err("expected a witness within the support of the points, got one without support".into());
    };
    let off = at.value.abs() / at.bandwidth;
    if off.is_nan() || off > ON_SURFACE {
        return Err(format!("expected a witness on the surface, got one {off:.2e} bandwidths off"));
    }
    let on_the_brink = at.status != Status::Ok;
    if on_the_brink && !is_nearly_ok(subject, x, &at) {
        return Err(format!("expected status Ok at the witness, got {:?}", at.status));
    }
    let (residual, bandwidth) = (at.value.abs() * placement.scale, at.bandwidth * placement.scale);
    Ok(Seen { off, residual, bandwidth, on_the_brink })
}

/// Returns a point on the surface near the point `x` of the world, with its distance. The search
/// stops at a distance of `enough`. Steps towards `x` from the cloud points nearest to it need not
/// find the nearest surface point, but the result is verified to be on the surface.
///
/// # Errors
/// If no point is found.
pub(crate) fn check_near(
    subject: &Subject,
    placement: &Placement,
    x: [f64; 3],
    enough: f64,
) -> Result<(Seen, f64), String> {
    let x = placement.stored(x);
    let positions = subject.scan.positions();
    let mut starts: Vec<(f64, usize)> =
        positions.iter().enumerate().map(|(i, p)| (distance(&p.map(f64::from), &x), i)).collect();
    starts.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let mut feet = Vec::new();
    for (_, i) in starts.into_iter().take(STARTS) {
        for foot in walk(subject, positions[i].map(f64::from), x) {
            let away = distance(&foot, &x) * placement.scale;
            if away <= enough
                && let Ok(seen) = check_stored(subject, placement, foot)
            {
                return Ok((seen, away));
            }
            feet.push((away, foot));
        }
    }
    feet.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let seen =
        feet.into_iter().find_map(|(away, foot)| Some((check_stored(subject, placement, foot).ok()?, away)));
    seen.ok_or_else(|| "expected a surface point near the witness, got none".into())
}

/// Returns the distance of `x` of the world from the nearest ball of the obstacle. Points on sheets
/// have no ball, and are places of the obstacle themselves.
pub(crate) fn distance_of_balls(subject: &Subject, placement: &Placement, x: [f64; 3]) -> f64 {
    let x = placement.stored(x);
    let away = |(i, p): (usize, &[f32; 3])| (distance(&p.map(f64::from), &x) - subject.ball(i)).max(0.0);
    let least = subject.scan.positions().iter().enumerate().map(away).fold(f64::INFINITY, f64::min);
    least * placement.scale
}

/// Returns points of the surface from near `start` towards `to`, stepping along the surface.
fn walk(subject: &Subject, start: [f64; 3], to: [f64; 3]) -> Vec<[f64; 3]> {
    let mut scratch = GatherScratch::default();
    let mut from = start;
    let mut feet = Vec::new();
    for _ in 0..STEPS {
        let foot = project(from, |x| subject.scan.evaluate_with(x, &mut scratch));
        if !foot.converged {
            break;
        }
        feet.push(foot.point);
        let (x, n) = (foot.point, foot.at.normal);
        let d = [0, 1, 2].map(|k| to[k] - x[k]);
        let height: f64 = (0..3).map(|k| n[k] * d[k]).sum();
        let along = [0, 1, 2].map(|k| d[k] - height * n[k]);
        // A bandwidth is about a local radius.
        let part = (foot.at.bandwidth / distance(&along, &[0.0; 3])).min(1.0);
        from = [0, 1, 2].map(|k| x[k] + part * along[k]);
    }
    feet
}

fn distance(p: &[f64; 3], q: &[f64; 3]) -> f64 {
    (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt()
}

/// Returns `true` if the conditions of the surface hold, each relaxed by rounding.
fn is_nearly_ok(subject: &Subject, x: [f64; 3], at: &Evaluation) -> bool {
    let options = subject.scan.plan().options();
    let (mut support, mut is_near) = (0, false);
    for (p, r) in subject.twin.points().iter().zip(subject.twin.radii()) {
        let (d, reach) = (distance(p, &x), subject.support_radius * r * (1.0 + DISTANCE));
        support += u32::from(d < reach);
        is_near |= d <= 0.5 * reach;
    }
    let [l1, l2, l3] = at.eigenvalues;
    let h = at.bandwidth;
    support >= options.support_min
        && is_near
        && distance(&at.centroid, &x) <= BORDER * h * (1.0 + CONDITION)
        && l1 <= THIN * 0.5 * h * h * (1.0 + CONDITION)
        && l2 - l1 >= GAP * (l1 + l2 + l3) * (1.0 - CONDITION)
}
