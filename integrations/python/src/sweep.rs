//! Sweeps: whole motions of scans, meshes and shapes.

use nearmiss::{
    MeshScanSweep, MeshSweep, Motion, Pose, PoseError, Prepared as _, ShapeSweepVerdict, Sweep, SweepOptions,
    SweepPlan, SweepReason, SweepVerdict,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::codes::{
    NONE, NOWHERE, answer, evidence_code, evidence_name, is_touching, number, plain, reason_name, shown,
    sweep_reason_code, undecided, vector, verdict_name,
};
use crate::failure::refused;
use crate::options::OF_BUDGET;
use crate::pair::options_of;
use crate::pool::ask;
use crate::poses::{Matrix, Poses, pose_of};
use crate::things::{Side, Thing};

/// The names of options of a sweep with a scan.
const OF_SWEEP: &[&str] = &["thickened", "surface_only", "work", "seconds"];

/// Returns the motion through poses, each of which `pose` makes of a matrix.
pub(crate) fn motion(
    given: Option<&Bound<'_, PyAny>>,
    pose: impl Fn(&Matrix) -> Result<Pose, PoseError>,
) -> PyResult<Motion> {
    let poses = Poses::new(given)?;
    let made = poses
        .matrices()?
        .iter()
        .enumerate()
        .map(|(index, matrix)| pose(matrix).map_err(|cause| refused(format!("pose {index}: {cause}"))));
    Motion::through(&made.collect::<PyResult<Vec<_>>>()?).map_err(refused)
}

/// Prove that a whole motion is free, or find the first impact.
///
/// `a` and `b` are scans or meshes. `a` moves through the poses `path_a`, `b` through `path_b`, of shape
/// (N, 4, 4), by screws; pose k is reached at time k. A single pose of shape (4, 4) stays. `clearance` is
/// the distance that they keep, a length. Options: `thickened`, `surface_only`, `work`, `seconds`, as for
/// `Scan.collide`; for two meshes `work` and `seconds`. Returns a `SweepAnswer`, whose times count poses. Of
/// a moving scan the current frame is swept. `Target.sweep` moves a shape.
#[pyfunction]
#[pyo3(signature = (a, b, path_b, path_a = None, *, clearance = 0.0, **options))]
pub(crate) fn sweep(
    a: Thing<'_>,
    b: Thing<'_>,
    path_b: &Bound<'_, PyAny>,
    path_a: Option<&Bound<'_, PyAny>>,
    clearance: f64,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<SweepAnswer> {
    let sides = [a.side(), b.side()];
    let options = options_of(options, &sides, [OF_SWEEP, OF_BUDGET])?;
    let asked = SweepOptions::default().with_semantics(options.collide.semantics).with_clearance(clearance);
    let plan = match &sides {
        [Side::Scan(a), Side::Scan(b)] => SweepPlan::new(&asked, a, b),
        [Side::Scan(scan), _] | [_, Side::Scan(scan)] => SweepPlan::against_mesh(&asked, scan),
        [Side::Mesh(_), Side::Mesh(_)] => SweepPlan::of_meshes(&asked),
    };
    let plan = &plan.map_err(refused)?;
    let [of_a, of_b] = sides.each_ref().map(|side| |matrix: &Matrix| pose_of(matrix, side.placeable()));
    let (way_a, way_b) = (&motion(path_a, of_a)?, &motion(Some(path_b), of_b)?);
    let answer = ask(path_b.py(), |scratch| {
        let budget = &options.budget();
        match &sides {
            [Side::Scan(a), Side::Scan(b)] => {
                Sweep::new(a.along(way_a), b.along(way_b)).within(budget).first_impact(plan, scratch)
            }
            [Side::Scan(scan), Side::Mesh(mesh)] => MeshScanSweep::new(scan.along(way_a), &mesh.mesh, way_b)
                .within(budget)
                .first_impact(plan, scratch),
            [Side::Mesh(mesh), Side::Scan(scan)] => MeshScanSweep::new(scan.along(way_b), &mesh.mesh, way_a)
                .within(budget)
                .first_impact(plan, scratch),
            [Side::Mesh(a), Side::Mesh(b)] => {
                MeshSweep::new([&a.mesh, &b.mesh], [way_a, way_b]).within(budget).first_impact(plan, scratch)
            }
        }
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
        let none = Self::undecided(answer.band);
        match answer.verdict {
            SweepVerdict::Free { clearance, upper, at } => none.free([duration, clearance, upper, at]),
            SweepVerdict::Impact { t_free, t_hit, contact, evidence } => {
                Self { evidence: evidence_code(evidence), ..none.impact([t_free, t_hit], contact.point) }
            }
            SweepVerdict::Undecided { t_free, reason } => none.up_to(t_free, reason),
        }
    }

    /// The record of a shape.
    pub(crate) fn of_shape(answer: &nearmiss::ShapeSweep, duration: f64) -> Self {
        let none = Self::undecided(answer.band);
        match answer.verdict {
            ShapeSweepVerdict::Free { clearance, upper, at } => none.free([duration, clearance, upper, at]),
            ShapeSweepVerdict::Impact { t_free, t_hit, contact } => {
                none.impact([t_free, t_hit], contact.point)
            }
            ShapeSweepVerdict::Undecided { t_free, reason } => none.up_to(t_free, reason),
        }
    }

    /// A record of which nothing but the band is known.
    fn undecided(band: f64) -> Self {
        Self {
            verdict: -1,
            evidence: -1,
            reason: 0,
            _padding: [0; 5],
            t_free: NONE,
            t_hit: NONE,
            clearance: NONE,
            upper: NONE,
            at: NONE,
            band,
            witness: NOWHERE,
        }
    }

    fn free(self, [t_free, clearance, upper, at]: [f64; 4]) -> Self {
        Self { verdict: 0, evidence: 1, t_free, clearance, upper, at, ..self }
    }

    fn impact(self, [t_free, t_hit]: [f64; 2], witness: [f64; 3]) -> Self {
        Self { verdict: 1, t_free, t_hit, witness, ..self }
    }

    fn up_to(self, t_free: f64, reason: SweepReason) -> Self {
        Self { t_free, reason: sweep_reason_code(reason), ..self }
    }
}

answer! {
    /// The answer of `sweep` and of `Target.sweep`.
    SweepAnswer of SweepRecord by sweep_in_words {
        @verdict hits: ["free", "impact"],
        /// The evidence of the verdict: "certified" or "estimated"; None if it is undecided, and for
        /// the impact of a shape.
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
