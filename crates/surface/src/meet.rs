//! Newton's method for a point on two surfaces.

use nearmiss_geometry::nalgebra::Vector3;

use crate::project::ON_SURFACE;
use crate::{Evaluation, Status};

/// Result of the search for a common point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Meeting {
    /// The last point of the iteration.
    pub point: [f64; 3],
    /// The evaluations of both functions at that point.
    pub at: [Evaluation; 2],
    /// Number of pairs of evaluations.
    pub rounds: u32,
    /// `true` if the point is on both surfaces: for both, |f| ≤ 1e-6 h and the status is ok.
    pub verified: bool,
}

impl Meeting {
    /// Returns the greater of the two |f|.
    #[must_use]
    pub fn residual(&self) -> f64 {
        self.at[0].f.abs().max(self.at[1].f.abs())
    }
}

/// Finds a common zero of two implicit functions near `start`. Both are evaluated in one frame.
///
/// Near its surface ∇f ≈ −n·(1 − 2λ₁/h²) (docs/theory/surface.md). Each step is the shortest δ that
/// makes both functions vanish to that order. Where the normals are nearly parallel,
/// `1 − (n_A·n_B)²` below 1e-3, that step is ill-conditioned, and the method goes halfway to either
/// surface instead. The point then converges between the surfaces, or onto both if they touch.
/// Steps are at most h/2. There are at most 16 rounds, fewer if the distance stops shrinking. From
/// a good start, three to six suffice.
///
/// Returns `None` as soon as `evaluate` does, for instance when time is up.
pub fn meet(
    start: [f64; 3],
    mut evaluate: impl FnMut([f64; 3]) -> Option<[Evaluation; 2]>,
) -> Option<Meeting> {
    const ROUNDS: u32 = 16;
    /// Number of consecutive rounds without an improvement of |f| by a fifth, after which the
    /// search ends.
    const PATIENCE: u32 = 3;
    /// If a point is this close to both surfaces, in bandwidths, and a status is not ok, the search
    /// ends. No point with the status ok would follow. This happens for one in six starts, at tips
    /// and folds.
    const AT_HAND: f64 = 1e-3;
    let mut point = start;
    let mut at = evaluate(point)?;
    let mut rounds = 1;
    let (mut nearest, mut idle) = (f64::INFINITY, 0);
    loop {
        let off = at.iter().map(|e| e.f.abs() / e.bandwidth).fold(0.0, f64::max);
        let on = off <= ON_SURFACE;
        let lost = at.iter().any(|e| e.status == Status::Outside);
        if off < 0.8 * nearest {
            nearest = off;
            idle = 0;
        } else {
            idle += 1;
        }
        let doubtful = off <= AT_HAND && at.iter().any(|e| e.status != Status::Ok);
        if on || lost || doubtful || idle == PATIENCE || rounds == ROUNDS {
            let verified = on && at.iter().all(|e| e.status == Status::Ok);
            return Some(Meeting { point, at, rounds, verified });
        }
        point = (Vector3::from(point) + step_onto_both(&at, PARALLEL)).into();
        at = evaluate(point)?;
        rounds += 1;
    }
}

/// Where the squared sine of the angle between the normals is less, [`meet`] treats them as
/// parallel: within 1.8°.
const PARALLEL: f64 = 1e-3;

/// Returns the step of [`meet`] from a point with the evaluations `at`: the shortest step that
/// makes both functions vanish to first order, at most h/2.
///
/// Where the squared sine of the angle between the normals is less than `parallel`, the step goes
/// halfway to either surface instead.
#[must_use]
pub fn step_onto_both(at: &[Evaluation; 2], parallel: f64) -> Vector3<f64> {
    let [a, b] = at;
    let (na, nb) = (Vector3::from(a.normal), Vector3::from(b.normal));
    let c = na.dot(&nb);
    let gram = 1.0 - c * c;
    let (fa, fb) = (newton(a), newton(b));
    let step = if gram < parallel {
        0.5 * (fa * na + fb * nb)
    } else {
        ((fa - c * fb) * na + (fb - c * fa) * nb) / gram
    };
    let most = 0.5 * a.bandwidth.min(b.bandwidth);
    let length = step.norm();
    if length > most { step * (most / length) } else { step }
}

/// Returns f over the length of its gradient.
fn newton(at: &Evaluation) -> f64 {
    let slope = 1.0 - 2.0 * at.eigenvalues[0] / (at.bandwidth * at.bandwidth);
    at.f / slope.max(0.5)
}
