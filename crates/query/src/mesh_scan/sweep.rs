//! A scan and a mesh along their motions, and the question whether these are free.

use nearmiss_geometry::Motion;
use nearmiss_hierarchy::MeshHierarchy;

use crate::ask::budget::Budget;
use crate::mesh_scan::course::MovingMeshScan;
use crate::motion::advance::SweepScratch;
use crate::motion::answer::SweepAnswer;
use crate::motion::impact::sweep;
use crate::motion::plan::SweepPlan;
use crate::pair::moving::Moving;
use crate::question::Scratch;

/// A scan and a mesh that move rigidly, and the budget of the question; as [`Sweep`](crate::Sweep)
/// for two scans. In contacts the scan comes first.
#[derive(Debug, Clone, Copy)]
pub struct MeshScanSweep<'a> {
    scan: Moving<'a>,
    mesh: &'a MeshHierarchy,
    motion: &'a Motion,
    budget: Budget,
}

impl<'a> MeshScanSweep<'a> {
    /// A scan along its motion and a mesh along `motion`, with an unlimited budget.
    #[must_use]
    pub fn new(scan: Moving<'a>, mesh: &'a MeshHierarchy, motion: &'a Motion) -> Self {
        Self { scan, mesh, motion, budget: Budget::UNLIMITED }
    }

    /// The same sweep with this budget of work and time. A resolution is ignored.
    #[must_use]
    pub fn within(self, budget: &Budget) -> Self {
        Self { budget: *budget, ..self }
    }

    /// Decides whether the whole motion is free, and finds the first impact otherwise; see
    /// [`Sweep::first_impact`](crate::Sweep::first_impact). With
    /// [`Semantics::Thickened`](crate::Semantics::Thickened) only the points of the scan have balls.
    pub fn first_impact(&self, plan: &SweepPlan, scratch: &mut Scratch) -> SweepAnswer {
        let (scan, level) = (self.scan.scan(), scratch.level());
        let course = MovingMeshScan { scan, mesh: self.mesh, plan, level };
        let motions = [self.scan.motion(), self.motion];
        let Scratch { contact, distance: open, motion, .. } = scratch;
        sweep((&course, motions), plan, &self.budget, SweepScratch { open, contact, motion })
    }
}
