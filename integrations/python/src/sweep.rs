//! Sweeps: whole motions of two scans.

use nearmiss::{Motion, PointHierarchy, Prepared as _, Sweep, SweepOptions, SweepPlan, SweepVerdict};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::codes::{
    NONE, NOWHERE, answer, evidence_code, evidence_name, is_touching, number, plain, reason_name, shown,
    sweep_reason_code, undecided, vector, verdict_name,
};
use crate::failure::refused;
use crate::options::Options;
use crate::pool::ask;
use crate::poses::{Poses, check_each, pose_of};
use crate::things::AnyScan;

/// The names of options of a sweep.
const OF_SWEEP: &[&str] = &["thickened", "surface_only", "work", "seconds"];

/// Returns the motion of `scan` through poses.
fn motion(given: Option<&Bound<'_, PyAny>>, scan: &PointHierarchy) -> PyResult<Motion> {
    let poses = Poses::new(given)?;
    let matrices = poses.matrices()?;
    check_each(matrices, scan)?;
    let poses: Result<Vec<_>, _> = matrices.iter().map(|matrix| pose_of(matrix, scan)).collect();
    Motion::through(&poses.map_err(refused)?).map_err(refused)
}

/// Prove that a whole motion is free, or find the first impact.
///
/// `a` moves through the poses `path_a`, `b` through `path_b`, of shape (N, 4, 4), by screws; pose k is
/// reached at time k. A single pose of shape (4, 4) stays. `clearance` is the distance that they keep, a
/// length. Options: `thickened`, `surface_only`, `work`, `seconds`, as for `Scan.collide`. Returns a
/// `SweepAnswer`, whose times count poses. Of a moving scan the current frame is swept.
#[pyfunction]
#[pyo3(signature = (a, b, path_b, path_a = None, *, clearance = 0.0, **options))]
pub(crate) fn sweep(
    a: &Bound<'_, AnyScan>,
    b: &Bound<'_, AnyScan>,
    path_b: &Bound<'_, PyAny>,
    path_a: Option<&Bound<'_, PyAny>>,
    clearance: f64,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<SweepAnswer> {
    let py = a.py();
    let (a, b) = (&a.get().0.frame(py), &b.get().0.frame(py));
    let options = Options::new(options, OF_SWEEP, a.metric())?;
    let asked = SweepOptions::default().with_semantics(options.collide.semantics).with_clearance(clearance);
    let plan = SweepPlan::new(&asked, a, b).map_err(refused)?;
    let (way_a, way_b) = (motion(path_a, a)?, motion(Some(path_b), b)?);
    let answer = ask(py, |scratch| {
        let sweep = Sweep::new(a.along(&way_a), b.along(&way_b)).within(&options.budget());
        sweep.first_impact(&plan, scratch)
    });
    Ok(SweepAnswer(SweepRecord::new(&answer, way_a.duration().max(way_b.duration()))))
}

/// The numbers of a sweep. No array holds them.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct SweepRecord {
    verdict: i8,
    evidence: i8,
    reason: i8,
    _padding: [u8; 5],
    t_free: f64,
    t_hit: f64,
    clearance: f64,
    upper: f64,
    at: f64,
    band: f64,
    witness: [f64; 3],
}

impl SweepRecord {
    pub(crate) fn new(answer: &nearmiss::SweepAnswer, duration: f64) -> Self {
        let none = Self {
            verdict: -1,
            evidence: -1,
            reason: 0,
            _padding: [0; 5],
            t_free: NONE,
            t_hit: NONE,
            clearance: NONE,
            upper: NONE,
            at: NONE,
            band: answer.band,
            witness: NOWHERE,
        };
        match answer.verdict {
            SweepVerdict::Free { clearance, upper, at } => {
                Self { verdict: 0, evidence: 1, t_free: duration, clearance, upper, at, ..none }
            }
            SweepVerdict::Impact { t_free, t_hit, contact, evidence } => {
                let (witness, evidence) = (contact.point, evidence_code(evidence));
                Self { verdict: 1, evidence, t_free, t_hit, witness, ..none }
            }
            SweepVerdict::Undecided { t_free, reason } => {
                Self { t_free, reason: sweep_reason_code(reason), ..none }
            }
        }
    }
}

answer! {
    /// The answer of `sweep`.
    SweepAnswer of SweepRecord by sweep_in_words {
        @verdict hits: ["free", "impact"],
        /// How well the verdict is supported: "certified" or "estimated"; None if it is undecided.
        evidence: Option<&'static str> = evidence_name,
        /// The reason why the verdict is undecided, in a word; else None.
        reason: Option<&'static str> = reason_name,
        /// The time along the path up to which the motion is proven free.
        t_free: f64 = plain,
        /// A time at which the two touch; None without an impact.
        t_hit: Option<f64> = number,
        /// The distance that the two keep, proven; None if nothing is proven.
        clearance: Option<f64> = number,
        /// The least distance that was found, a length; None if none was measured.
        upper: Option<f64> = number,
        /// The time at which that distance was found; None if none was measured.
        at: Option<f64> = number,
        /// The local spacing, below which the two do not determine the truth, a length.
        band: f64 = plain,
        /// A place where the two touch at `t_hit`, in the world; None without an impact.
        witness: Option<[f64; 3]> = vector,
    }
}

fn sweep_in_words(record: &SweepRecord) -> String {
    match record.verdict {
        1 => {
            format!("impact at t = {}, free up to {}{}", record.t_hit, record.t_free, shown(record.evidence))
        }
        0 => format!("free, at least {} apart", record.clearance),
        _ => format!("free up to {}, then {}", record.t_free, undecided(record.reason)),
    }
}
