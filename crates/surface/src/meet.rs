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
/// Each step is the least δ with n_A·δ = f_A and n_B·δ = f_B (docs/theory: ∇f ≈ −n near the surface). Where the
/// normals are nearly parallel, 1 − (n_A·n_B)² < 1e-3, that is ill-conditioned and the step goes halfway to
/// either surface instead: the point settles between them, on both if they touch. Steps are at most h/2.
/// At most 16 rounds; a good start needs three to six.
pub fn meet(start: [f64; 3], mut evaluate: impl FnMut([f64; 3]) -> [Evaluation; 2]) -> Meeting {
    const ROUNDS: u32 = 16;
    let mut point = start;
    let mut at = evaluate(point);
    let mut rounds = 1;
    loop {
        let on = at.iter().all(|e| e.f.abs() <= ON_SURFACE * e.bandwidth);
        let lost = at.iter().any(|e| e.status == Status::Outside);
        if on || lost || rounds == ROUNDS {
            let verified = on && at.iter().all(|e| e.status == Status::Ok);
            return Meeting { point, at, rounds, verified };
        }
        point = (Vector3::from(point) + step(&at)).into();
        at = evaluate(point);
        rounds += 1;
    }
}

fn step(at: &[Evaluation; 2]) -> Vector3<f64> {
    let [a, b] = at;
    let (na, nb) = (Vector3::from(a.normal), Vector3::from(b.normal));
    let c = na.dot(&nb);
    let gram = 1.0 - c * c;
    let step = if gram < 1e-3 {
        0.5 * (a.f * na + b.f * nb)
    } else {
        ((a.f - c * b.f) * na + (b.f - c * a.f) * nb) / gram
    };
    let most = 0.5 * a.bandwidth.min(b.bandwidth);
    let length = step.norm();
    if length > most { step * (most / length) } else { step }
}
