//! The surface point below a point.

use nearmiss_geometry::nalgebra::Vector3;

use crate::{Evaluation, Status};

/// Where a projection ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projection {
    /// The foot point.
    pub point: [f64; 3],
    /// The implicit function there.
    pub at: Evaluation,
    /// Evaluations spent.
    pub evaluations: u32,
    /// Whether |f| ≤ 1e-6 h there and the status is ok.
    pub converged: bool,
}

/// |f| of a surface point, in bandwidths: ten times the rounding of single-precision sums.
pub(crate) const ON_SURFACE: f64 = 1e-6;

/// The almost orthogonal projection of `start`: x ← x₀ + ((a(x) − x₀)·n(x)) n(x), until f(x) vanishes (Alexa
/// & Adamson, "On normals and projection operators for surfaces defined by point sets", SPBG 2004).
///
/// `evaluate` is f; at most 12 evaluations.
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
