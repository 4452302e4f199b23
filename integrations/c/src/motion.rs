//! Motions, and the proof that a motion is free.

use std::mem::MaybeUninit;

use nearmiss::{Prepared as _, ShapeSweepVerdict, Sweep, SweepReason, SweepVerdict};

use crate::answer::{Contact, NONE, NOWHERE, Reason, Verdict, evidence};
use crate::handle::{Handle, free, get, get_mut, make, opaque};
use crate::options::{Budget, Evidence, budget};
use crate::plan::Plan;
use crate::pointer::{required, slice, write};
use crate::pose::{Placed, Pose};
use crate::scan::Scan;
use crate::scratch::Scratch;
use crate::shape::Shape;
use crate::status::{Failure, Status, guard};
use crate::target::target;

/// A motion through poses. Any number of threads may use one at the same time.
#[derive(Debug)]
pub struct Motion(Handle<nearmiss::Motion>);

opaque!(Motion of nearmiss::Motion as b"nm-motio");

/// The answer about a motion. Missing numbers are NaN. Times count poses, with fractions.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct SweepAnswer {
    /// Separated: free at all times. Touching: an impact.
    pub verdict: Verdict,
    /// The certainty of the verdict; none for the impact of a shape.
    pub evidence: Evidence,
    /// The reason if it is undecided.
    pub reason: Reason,
    /// The motion is proven free up to this time.
    pub t_free: f64,
    /// The time of the impact.
    pub t_hit: f64,
    /// The place of the impact.
    pub witness: [f64; 3],
    /// A proven distance that a free motion always keeps.
    pub clearance: f64,
    /// The least upper bound of the distance that was found.
    pub upper: f64,
    /// The time at which they come nearest, as far as known.
    pub nearest_at: f64,
    /// The length within which nothing is claimed about the scanned things themselves.
    pub band: f64,
}

impl SweepAnswer {
    fn new(answer: &nearmiss::SweepAnswer, duration: f64) -> Self {
        let none = Self::undecided(answer.band);
        match answer.verdict {
            SweepVerdict::Free { clearance, upper, at } => none.free([duration, clearance, upper, at]),
            SweepVerdict::Impact { t_free, t_hit, contact, evidence: certainty } => {
                let evidence = evidence(certainty);
                Self { evidence, ..none.impact([t_free, t_hit], Contact::new(&contact).point) }
            }
            SweepVerdict::Undecided { t_free, reason } => none.up_to(t_free, reason),
        }
    }

    fn of_shape(answer: &nearmiss::ShapeSweep, duration: f64) -> Self {
        let none = Self::undecided(answer.band);
        match answer.verdict {
            ShapeSweepVerdict::Free { clearance, upper, at } => none.free([duration, clearance, upper, at]),
            ShapeSweepVerdict::Impact { t_free, t_hit, contact } => {
                none.impact([t_free, t_hit], contact.point)
            }
            ShapeSweepVerdict::Undecided { t_free, reason } => none.up_to(t_free, reason),
        }
    }

    /// An answer of which nothing but the band is known.
    fn undecided(band: f64) -> Self {
        Self {
            verdict: Verdict::Undecided,
            evidence: Evidence::None,
            reason: Reason::None,
            t_free: NONE,
            t_hit: NONE,
            witness: NOWHERE,
            clearance: NONE,
            upper: NONE,
            nearest_at: NONE,
            band,
        }
    }

    fn free(self, [t_free, clearance, upper, nearest_at]: [f64; 4]) -> Self {
        let (verdict, evidence) = (Verdict::Separated, Evidence::Certified);
        Self { verdict, evidence, t_free, clearance, upper, nearest_at, ..self }
    }

    fn impact(self, [t_free, t_hit]: [f64; 2], witness: [f64; 3]) -> Self {
        Self { verdict: Verdict::Touching, t_free, t_hit, witness, ..self }
    }

    fn up_to(self, t_free: f64, reason: SweepReason) -> Self {
        let reason = match reason {
            SweepReason::Near => Reason::Near,
            SweepReason::Budget => Reason::Budget,
            SweepReason::Pose => Reason::Range,
            SweepReason::Shape => Reason::Shape,
            SweepReason::Geodesic => Reason::Geodesic,
            _ => Reason::Other,
        };
        Self { t_free, reason, ..self }
    }
}

/// Makes the motion through `count` poses by screws; pose k is reached at time k. One pose stays.
/// Thread safety: any thread.
///
/// # Safety
/// `poses` are `count` poses; `out` is null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_motion_new(
    poses: *const Pose,
    count: usize,
    out: Option<&mut MaybeUninit<*mut Motion>>,
) -> Status {
    guard(|| {
        make(out, || {
            // SAFETY: the caller promises the poses.
            let poses = unsafe { slice(poses, count, "poses") }?;
            let poses: Result<Vec<_>, Failure> = poses.iter().map(Pose::checked).collect();
            nearmiss::Motion::through(&poses?).map_err(Failure::argument)
        })
    })
}

/// Frees a motion; null is fine. Thread safety: no other call may use the handle at the same time or
/// later.
///
/// # Safety
/// `motion` is null or a handle that no other call uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_motion_free(motion: *mut Motion) -> Status {
    guard(|| free(motion))
}

/// Proves that two scans stay apart, by more than the margin of the plan, along their motions, or
/// finds the first impact. `limits` may be null. Thread safety: one call at a time for each scratch.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_sweep(
    plan: Option<&Plan>,
    a: Option<&Scan>,
    motion_a: Option<&Motion>,
    b: Option<&Scan>,
    motion_b: Option<&Motion>,
    limits: Option<&Budget>,
    scratch: Option<&mut Scratch>,
    out: Option<&mut MaybeUninit<SweepAnswer>>,
) -> Status {
    guard(|| {
        let plan = &get(plan, "plan")?.sweep;
        let (a, b) = (get(a, "a")?, get(b, "b")?);
        let (way_a, way_b) = (get(motion_a, "motion_a")?, get(motion_b, "motion_b")?);
        let sweep = Sweep::new(a.along(way_a), b.along(way_b)).within(&budget(limits)?);
        let answer = sweep.first_impact(plan, &mut get_mut(scratch, "scratch")?.scratch);
        write(out, SweepAnswer::new(&answer, way_a.duration().max(way_b.duration())))
    })
}

/// Proves that a shape stays clear of a scan, by more than the margin of the plan, along its motion, or
/// finds the first impact. The poses of the motion map the frame of the shape to the world. Thread safety:
/// one call at a time for each scratch.
///
/// # Safety
/// Pointers are null or valid, that to the points of a hull too.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_shape_sweep(
    plan: Option<&Plan>,
    scan: Option<&Placed<'_>>,
    shape: Option<&Shape>,
    motion: Option<&Motion>,
    scratch: Option<&mut Scratch>,
    out: Option<&mut MaybeUninit<SweepAnswer>>,
) -> Status {
    guard(|| {
        let (target, way) = (target(plan, scan)?, get(motion, "motion")?);
        // SAFETY: the caller promises the points of the shape.
        let shape = unsafe { required(shape, "shape")?.checked() }?;
        let answer = target.sweep(&shape, way, &mut get_mut(scratch, "scratch")?.scratch);
        write(out, SweepAnswer::of_shape(&answer, way.duration()))
    })
}
