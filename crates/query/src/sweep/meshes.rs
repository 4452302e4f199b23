//! Two meshes along their motions, and the question whether these are free.

use nearmiss_geometry::Motion;
use nearmiss_hierarchy::MeshHierarchy;

use crate::ask::budget::Budget;
use crate::mesh::course::MovingMeshes;
use crate::motion::advance::SweepScratch;
use crate::motion::answer::SweepAnswer;
use crate::motion::impact::sweep;
use crate::motion::plan::SweepPlan;
use crate::question::Scratch;

/// Two meshes that move rigidly, and the budget of the question; as [`Sweep`](crate::Sweep) for two
/// scans.
///
/// Triangles are exact, so there is no band within which nothing can be proven. Times are found up to a
/// way of a thousandth of the radius of the smaller mesh, which is the band of an answer. As with
/// [`MeshPair`](crate::MeshPair), meshes touch where their triangles do: a mesh inside another one is apart
/// from it.
///
/// ```
/// use nearmiss_geometry::{Motion, Pose, TriangleMesh};
/// use nearmiss_hierarchy::{MeshBuildOptions, MeshHierarchy};
/// use nearmiss_query::{MeshSweep, Scratch, SweepOptions, SweepPlan, SweepVerdict};
///
/// let corners = vec![[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
/// let mesh = TriangleMesh::new(corners, vec![[0, 1, 2]])?;
/// let floor = MeshHierarchy::build(&mesh, &MeshBuildOptions::default())?;
/// let plan = SweepPlan::of_meshes(&SweepOptions::default())?;
///
/// // An upright triangle is lowered by 2 and meets the floor at half time.
/// let upright = Pose::from_axis_angle([1.0, 0.0, 0.0], std::f64::consts::FRAC_PI_2);
/// let at = |height| upright.with_translation([0.5, 1.0, height]);
/// let (lies, lowered) = (Motion::still(Pose::IDENTITY), Motion::through(&[at(1.0), at(-1.0)])?);
/// let sweep = MeshSweep::new([&floor, &floor], [&lies, &lowered]);
/// let verdict = sweep.first_impact(&plan, &mut Scratch::default()).verdict;
/// let SweepVerdict::Impact { t_free, t_hit, .. } = verdict else { panic!("the triangles meet") };
/// assert!(t_free < 0.5 && t_free > 0.498 && (t_hit - 0.5).abs() < 2e-3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct MeshSweep<'a> {
    meshes: [&'a MeshHierarchy; 2],
    motions: [&'a Motion; 2],
    budget: Budget,
}

impl<'a> MeshSweep<'a> {
    /// Two meshes along their motions, with an unlimited budget. Both motions start at time 0; the mesh whose
    /// motion ends first stays where it is then.
    #[must_use]
    pub fn new(meshes: [&'a MeshHierarchy; 2], motions: [&'a Motion; 2]) -> Self {
        Self { meshes, motions, budget: Budget::UNLIMITED }
    }

    /// The same sweep with this budget of work and time. A resolution is ignored.
    #[must_use]
    pub fn within(self, budget: &Budget) -> Self {
        Self { budget: *budget, ..self }
    }

    /// Decides whether the whole motion is free, and finds the first impact otherwise; see
    /// [`Sweep::first_impact`](crate::Sweep::first_impact). Of the plan only the clearance counts.
    pub fn first_impact(&self, plan: &SweepPlan, scratch: &mut Scratch) -> SweepAnswer {
        let course = MovingMeshes { meshes: self.meshes, level: scratch.level() };
        let plan = &plan.between_meshes();
        let Scratch { contact, distance: open, motion, .. } = scratch;
        sweep((&course, self.motions), plan, &self.budget, SweepScratch { open, contact, motion })
    }
}
