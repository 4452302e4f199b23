//! Two scans along their motions, and the question whether these are free.

pub(crate) mod meshes;

use crate::ask::budget::Budget;
use crate::motion::advance::SweepScratch;
use crate::motion::answer::SweepAnswer;
use crate::motion::impact::sweep;
use crate::motion::plan::SweepPlan;
use crate::motion::scans::MovingScans;
use crate::pair::moving::Moving;
use crate::question::Scratch;

/// Two scans that move rigidly, each by a [`Motion`](nearmiss_geometry::Motion) of its own, and the
/// budget of the question.
///
/// ```
/// use nearmiss_geometry::{Motion, PointCloud, Pose};
/// use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
/// use nearmiss_query::{Prepared, Scratch, Sweep, SweepOptions, SweepPlan, SweepVerdict};
///
/// let points: Vec<[f32; 3]> =
///     (0..2500_u16).map(|i| [f32::from(i % 50) * 0.02, f32::from(i / 50) * 0.02, 0.0]).collect();
/// let square = PointHierarchy::build(&PointCloud::from_positions(&points)?, &BuildOptions::default())?;
/// let plan = SweepPlan::new(&SweepOptions::default(), &square, &square)?;
/// let mut scratch = Scratch::default();
///
/// // A tilted square 1 above another one is lowered by 2: its lowest edge meets the other one at
/// // half time.
/// let lies = Motion::still(Pose::IDENTITY);
/// let tilted = Pose::from_axis_angle([1.0, 0.0, 0.0], 0.3);
/// let at = |z: f64| tilted.with_translation([0.1, 0.2, z]);
/// let lowered = Motion::through(&[at(1.0), at(-1.0)])?;
/// let sweep = Sweep::new(square.along(&lies), square.along(&lowered));
/// let SweepVerdict::Impact { t_free, t_hit, .. } = sweep.first_impact(&plan, &mut scratch).verdict else {
///     panic!("the squares meet");
/// };
/// assert!(t_free < 0.5 && 0.5 - t_free < 0.05 && (t_hit - 0.5).abs() < 0.02);
///
/// // Moved sideways, it stays 1 above.
/// let sideways = Motion::through(&[at(1.0), tilted.with_translation([5.0, 0.2, 1.0])])?;
/// let sweep = Sweep::new(square.along(&lies), square.along(&sideways));
/// assert!(sweep.first_impact(&plan, &mut scratch).verdict.is_free());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Sweep<'a> {
    moving: [Moving<'a>; 2],
    budget: Budget,
}

impl<'a> Sweep<'a> {
    /// Two scans along their motions, with an unlimited budget. Both motions start at time 0; the
    /// scan whose motion ends first stays where it is then.
    #[must_use]
    pub fn new(a: Moving<'a>, b: Moving<'a>) -> Self {
        Self { moving: [a, b], budget: Budget::UNLIMITED }
    }

    /// The same sweep with this budget of work and time. A resolution is ignored.
    #[must_use]
    pub fn within(self, budget: &Budget) -> Self {
        Self { budget: *budget, ..self }
    }

    /// Decides whether the whole motion is free, and finds the first impact otherwise.
    ///
    /// `Free` and `t_free` are proofs, rounding included: at no time before `t_free` do the scans
    /// come within the clearance of `plan`, with the meaning of `plan`. Contacts are found by
    /// tests about a quarter of a local spacing apart (the way of the fastest point), or less for
    /// scans that are smaller than that. A shallower graze may be missed after `t_free`; then the
    /// sweep is undecided.
    ///
    /// Costs a few distance queries, and the comparison of the node pairs that come near each
    /// other, at intervals that are shorter the nearer they come (`docs/theory/motions.md`). Does
    /// not allocate once `scratch` is warm. Deterministic without a deadline.
    pub fn first_impact(&self, plan: &SweepPlan, scratch: &mut Scratch) -> SweepAnswer {
        let [a, b] = &self.moving;
        let scans = [a.scan(), b.scan()];
        let course = MovingScans { scans, plan, level: scratch.level() };
        let motions = [a.motion(), b.motion()];
        let Scratch { contact, distance: open, motion, .. } = scratch;
        sweep((&course, motions), plan, &self.budget, SweepScratch { open, contact, motion })
    }
}
