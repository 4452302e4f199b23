//! Whether a point lies on a surface, by the formulas alone and all of the points.

use nearmiss_testdata::oracle::{BORDER, Evaluation, GAP, Status, THIN};

use super::placement::Placement;
use super::subject::Subject;

/// |f| of a witness, in bandwidths. Its |f| in single precision is at most 1e-6.
const ON_SURFACE: f64 = 1e-5;

/// What single precision may do to a distance beside a horizon, and to what is compared with a condition's bound.
const DISTANCE: f64 = 1e-5;
const CONDITION: f64 = 1e-4;

/// A point seen to lie on a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Seen {
    /// |f| in bandwidths.
    pub(crate) off: f64,
    /// |f| and the bandwidth in the world.
    pub(crate) residual: f64,
    pub(crate) bandwidth: f64,
    /// Whether some condition of the surface holds only up to rounding.
    pub(crate) on_the_brink: bool,
}

/// # Errors
/// When the point `x` of the world does not lie on the surface.
pub(crate) fn check(subject: &Subject, placement: &Placement, x: [f64; 3]) -> Result<Seen, String> {
    let x = placement.stored(x);
    let Some(at) = subject.twin.evaluate(x) else { return Err("no point reaches the witness".into()) };
    let off = at.value.abs() / at.bandwidth;
    if off.is_nan() || off > ON_SURFACE {
        return Err(format!("the witness is {off:.2e} bandwidths off the surface"));
    }
    let on_the_brink = at.status != Status::Ok;
    if on_the_brink && !is_nearly_ok(subject, x, &at) {
        return Err(format!("the surface is {:?} at the witness", at.status));
    }
    let (residual, bandwidth) = (at.value.abs() * placement.scale, at.bandwidth * placement.scale);
    Ok(Seen { off, residual, bandwidth, on_the_brink })
}

/// The conditions of the surface, each relaxed by what rounding may do.
fn is_nearly_ok(subject: &Subject, x: [f64; 3], at: &Evaluation) -> bool {
    let distance = |p: &[f64; 3]| (0..3).map(|k| (p[k] - x[k]).powi(2)).sum::<f64>().sqrt();
    let options = subject.scan.plan().options();
    let (mut support, mut is_near) = (0, false);
    for (p, r) in subject.twin.points().iter().zip(subject.twin.radii()) {
        let (d, reach) = (distance(p), subject.horizon * r * (1.0 + DISTANCE));
        support += u32::from(d < reach);
        is_near |= d <= 0.5 * reach;
    }
    let [l1, l2, l3] = at.eigenvalues;
    let h = at.bandwidth;
    support >= options.support_min
        && is_near
        && distance(&at.centroid) <= BORDER * h * (1.0 + CONDITION)
        && l1 <= THIN * 0.5 * h * h * (1.0 + CONDITION)
        && l2 - l1 >= GAP * (l1 + l2 + l3) * (1.0 - CONDITION)
}
