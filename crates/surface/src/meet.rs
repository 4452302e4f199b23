//! A point on two surfaces at once, by Newton's method.

use nearmiss_geometry::nalgebra::Vector3;

use crate::project::ON_SURFACE;
use crate::{Evaluation, Status};

/// Where the search for a common point ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Meeting {
    /// The point.
    pub point: [f64; 3],
    /// Either function there.
    pub at: [Evaluation; 2],
    /// Pairs of evaluations spent.
    pub rounds: u32,
    /// Whether the point lies on both: |f| ≤ 1e-6 h and status ok, for both.
    pub verified: bool,
}

impl Meeting {
    /// The greater of the two distances |f|.
    #[must_use]
    pub fn residual(&self) -> f64 {
        self.at[0].f.abs().max(self.at[1].f.abs())
    }
}

/// A common zero of two implicit functions near `start`, both evaluated in one frame.
///
/// Near its surface ∇f ≈ −n·(1 − 2λ₁/h²) (docs/theory). Each step is the least δ that makes both functions
/// vanish to that order. Where the normals are nearly parallel, `1 − (n_A·n_B)²` below 1e-3, that is
/// ill-conditioned and the step goes halfway to either surface instead: the point settles between them, on
/// both if they touch. Steps are at most h/2. At most 16 rounds, fewer when the distance stops shrinking; a
/// good start needs three to six. None once `evaluate` gives nothing, as when time is up.
pub fn meet(
    start: [f64; 3],
    mut evaluate: impl FnMut([f64; 3]) -> Option<[Evaluation; 2]>,
) -> Option<Meeting> {
    const ROUNDS: u32 = 16;
    /// So many rounds in a row may bring no point nearer than any before, by at least a fifth.
    const PATIENCE: u32 = 3;
    /// So near, in bandwidths, a place without the status ok comes to no other that has it: one in six
    /// starts, at tips and folds.
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

/// Where the square of the sine between the normals is less, [`meet`] takes them for parallel: to within
/// 1.8°.
const PARALLEL: f64 = 1e-3;

/// The step of [`meet`] from a place where the two functions are `at`: the least one that makes both vanish
/// to first order, at most h/2. Where the square of the sine between the normals is less than `parallel`,
/// halfway to either instead.
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

/// f over the size of its gradient.
fn newton(at: &Evaluation) -> f64 {
    let slope = 1.0 - 2.0 * at.eigenvalues[0] / (at.bandwidth * at.bandwidth);
    at.f / slope.max(0.5)
}
