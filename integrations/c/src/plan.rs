//! Plans: validated options.

use nearmiss::{CollidePlan, DistanceOptions, DistancePlan, ShapePlan, SweepOptions, SweepPlan};
use std::mem::MaybeUninit;

use crate::handle::{Handle, free, get, make, opaque};
use crate::options::{Options, nearmiss_options};
use crate::scan::Scan;
use crate::status::{Failure, Status, guard};

/// The plans of all questions with the same options.
#[derive(Debug)]
pub(crate) struct Plans {
    pub(crate) collide: CollidePlan,
    pub(crate) distance: DistancePlan,
    pub(crate) shape: ShapePlan,
    pub(crate) sweep: SweepPlan,
}

/// Validated options. A plan serves every question, about any scans prepared in the same way as
/// those that it was made for, in any poses. Any number of threads may use one at the same time.
#[derive(Debug)]
pub struct Plan(Handle<Plans>);

opaque!(Plan of Plans as b"nm-plan.");

/// Validates options, for `a` and `b` and all scans prepared for the same kernel. `options` may be
/// null. Thread safety: any thread.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_plan_new(
    options: Option<&Options>,
    a: Option<&Scan>,
    b: Option<&Scan>,
    out: Option<&mut MaybeUninit<*mut Plan>>,
) -> Status {
    guard(|| {
        make(out, || {
            let (options, a, b) =
                (options.copied().unwrap_or_else(|| nearmiss_options()), get(a, "a")?, get(b, "b")?);
            let mut asked = options.collide()?;
            if a.metric() == nearmiss::Metric::Geodesic && options.semantics == 0 {
                asked = asked.with_semantics(nearmiss::Semantics::Surface);
            }
            let distance =
                DistanceOptions::default().with_semantics(asked.semantics).with_relative(options.relative);
            let sweep =
                SweepOptions::default().with_semantics(asked.semantics).with_clearance(options.margin);
            Ok(Plans {
                collide: CollidePlan::new(&asked, a, b).map_err(Failure::argument)?,
                distance: DistancePlan::new(&distance, a, b).map_err(Failure::argument)?,
                shape: ShapePlan::new(&asked, a).map_err(Failure::argument)?,
                sweep: SweepPlan::new(&sweep, a, b).map_err(Failure::argument)?,
            })
        })
    })
}

/// Frees a plan; null is fine. Thread safety: no other call may use the handle at the same time or
/// later.
///
/// # Safety
/// `plan` is null or a handle that no other call uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_plan_free(plan: *mut Plan) -> Status {
    guard(|| free(plan))
}
