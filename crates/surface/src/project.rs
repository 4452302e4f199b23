//! Projection of a point onto the surface.

use nearmiss_geometry::nalgebra::Vector3;

use crate::{Evaluation, Status};

/// Result of a projection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projection {
    /// The projected point.
    pub point: [f64; 3],
    /// The implicit function at that point.
    pub at: Evaluation,
    /// Number of evaluations.
    pub evaluations: u32,
    /// `true` if |f| ≤ 1e-6 h at the point and its status is ok.
    pub converged: bool,
}

/// Greatest |f| of a surface point, in bandwidths: ten times the rounding of single-precision sums.
pub(crate) const ON_SURFACE: f64 = 1e-6;

/// Projects `start` onto the surface, almost orthogonally.
///
/// Iterates x ← x₀ + ((a(x) − x₀)·n(x)) n(x) until f(x) vanishes (Alexa & Adamson, "On normals and
/// projection operators for surfaces defined by point sets", SPBG 2004).
///
/// `evaluate` is the implicit function, which is called at most 12 times.
pub fn project(start: [f64; 3], mut evaluate: impl FnMut([f64; 3]) -> Evaluation) -> Projection {
    const STEPS: u32 = 12;
    let x0 = Vector3::from(start);
    let mut point = start;
    let mut at = evaluate(point);
    let mut evaluations = 1;
    loop {
        let on = at.f.abs() <= ON_SURFACE * at.bandwidth;
        if on || at.status == Status::Outside || evaluations == STEPS {
            return Projection { point, at, evaluations, converged: on && at.status == Status::Ok };
        }
        let n = Vector3::from(at.normal);
        point = (x0 + n * (Vector3::from(at.centroid) - x0).dot(&n)).into();
        at = evaluate(point);
        evaluations += 1;
    }
}
