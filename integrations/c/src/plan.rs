//! Plans: validated options.

use std::mem::MaybeUninit;

use nearmiss::{
    CollideOptions, CollidePlan, DistanceOptions, DistancePlan, Metric, PlanError, ShapePlan, SweepOptions,
    SweepPlan,
};

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
/// null. Both scans may be null, for a world whose scans, if any, have the default kernel. Thread safety: any
/// thread.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_plan_new(
    options: Option<&Options>,
    a: Option<&Scan>,
    b: Option<&Scan>,
    out: Option<&mut MaybeUninit<*mut Plan>>,
) -> Status {
    guard(|| {
        make(out, || {
            let options = options.copied().unwrap_or_else(|| nearmiss_options());
            let scans = match (a, b) {
                (None, None) => None,
                _ => Some((get(a, "a")?, get(b, "b")?)),
            };
            let mut asked = options.collide()?;
            let is_geodesic = scans.is_some_and(|(a, _)| a.metric() == Metric::Geodesic);
            if is_geodesic && options.semantics == 0 {
                asked = asked.with_semantics(nearmiss::Semantics::Surface);
            }
            let distance =
                DistanceOptions::default().with_semantics(asked.semantics).with_relative(options.relative);
            let sweep =
                SweepOptions::default().with_semantics(asked.semantics).with_clearance(options.margin);
            Plans::new(&asked, &distance, &sweep, scans).map_err(Failure::argument)
        })
    })
}

impl Plans {
    /// The plans for two scans, or for any scans with the default kernel.
    fn new(
        collide: &CollideOptions,
        distance: &DistanceOptions,
        sweep: &SweepOptions,
        scans: Option<(&nearmiss::Scan, &nearmiss::Scan)>,
    ) -> Result<Self, PlanError> {
        let Some((a, b)) = scans else {
            let metric = Metric::Euclidean;
            return Ok(Self {
                collide: CollidePlan::of_metric(collide, metric)?,
                distance: DistancePlan::of_metric(distance, metric)?,
                shape: ShapePlan::of_metric(collide, metric)?,
                sweep: SweepPlan::of_metric(sweep, metric)?,
            });
        };
        Ok(Self {
            collide: CollidePlan::new(collide, a, b)?,
            distance: DistancePlan::new(distance, a, b)?,
            shape: ShapePlan::new(collide, a)?,
            sweep: SweepPlan::new(sweep, a, b)?,
        })
    }
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
