//! Options and budgets of questions.

use std::time::Duration;

use nearmiss::{CollideOptions, Deadline};

use crate::status::Failure;

/// The meaning of "meet".
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub enum Semantics {
    /// Surfaces where points sample a sheet, balls elsewhere, and every measured point.
    Obstacle = 0,
    /// Surfaces alone.
    Surface = 1,
    /// Balls of radius `thickness` about the points.
    Thickened = 2,
}

/// The certainty of an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub enum Evidence {
    /// There is no verdict.
    None = -1,
    /// The search was complete, but proves nothing.
    Estimated = 0,
    /// Proven.
    Certified = 1,
}

/// The amount of detail about contacts and hits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub enum Detail {
    /// Accurate to first order. Fastest.
    Verdict = 0,
    /// Points on the surfaces, verified if possible.
    Witness = 1,
}

/// Options of a plan. Start from `nearmiss_options`. Lengths are in world units.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Options {
    /// A `NearmissSemantics`.
    pub semantics: i32,
    /// The wanted `NearmissEvidence` of separations.
    pub evidence: i32,
    /// A `NearmissDetail`.
    pub detail: i32,
    /// The radius of balls with `NEARMISS_SEMANTICS_THICKENED`.
    pub thickness: f64,
    /// Nearer than this counts as touching; of a sweep, the distance to keep.
    pub margin: f64,
    /// The share of the upper bound of a distance by which the lower one may stay below it.
    pub relative: f64,
}

/// Limits of a question, which ends at the first one it reaches. Start from `nearmiss_unlimited`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Budget {
    /// Units of work: evaluations and node pairs. Reproducible. `UINT64_MAX` for no limit.
    pub work: u64,
    /// Seconds from the start of the question. Infinite for no limit.
    pub seconds: f64,
}

/// Returns the default options: obstacles, certified, with witnesses. Thread safety: any thread.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_options() -> Options {
    Options {
        semantics: Semantics::Obstacle as i32,
        evidence: Evidence::Certified as i32,
        detail: Detail::Witness as i32,
        thickness: 0.0,
        margin: 0.0,
        relative: 0.1,
    }
}

/// Returns a budget without limits. Thread safety: any thread.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_unlimited() -> Budget {
    Budget { work: u64::MAX, seconds: f64::INFINITY }
}

impl Options {
    pub(crate) fn collide(&self) -> Result<CollideOptions, Failure> {
        let one_of = |name: &str, last: i32, got: i32| {
            Failure::argument(format_args!("expected a {name} of 0 to {last}, got {got}"))
        };
        let semantics = match self.semantics {
            0 => nearmiss::Semantics::Obstacle,
            1 => nearmiss::Semantics::Surface,
            2 => nearmiss::Semantics::Thickened(self.thickness),
            other => return Err(one_of("semantics", 2, other)),
        };
        let evidence = match self.evidence {
            0 => nearmiss::Evidence::Estimated,
            1 => nearmiss::Evidence::Certified,
            other => return Err(one_of("evidence", 1, other)),
        };
        let detail = match self.detail {
            0 => nearmiss::Detail::Verdict,
            1 => nearmiss::Detail::Witness,
            other => return Err(one_of("detail", 1, other)),
        };
        let options = CollideOptions::default().with_semantics(semantics).with_evidence(evidence);
        Ok(options.with_detail(detail).with_margin(self.margin))
    }
}

/// Returns the budget; none for null.
#[inline]
pub(crate) fn budget(given: Option<&Budget>) -> Result<nearmiss::Budget, Failure> {
    let unlimited = nearmiss::Budget::UNLIMITED;
    let Some(&Budget { work, seconds }) = given else { return Ok(unlimited) };
    let budget = if work == u64::MAX { unlimited } else { unlimited.with_work(work) };
    if seconds == f64::INFINITY {
        return Ok(budget);
    }
    if seconds.is_nan() || seconds < 0.0 {
        return Err(Failure::argument(format_args!("expected seconds of at least 0, got {seconds}")));
    }
    let time = Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX);
    Ok(budget.with_deadline(Deadline::within(time)))
}
