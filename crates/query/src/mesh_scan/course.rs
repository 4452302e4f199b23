//! A scan and a mesh as a [`Course`].

use fearless_simd::Level;
use nearmiss_geometry::Pose;
use nearmiss_hierarchy::{Ball, MeshHierarchy};

use crate::ask::answer::Answer;
use crate::ask::budget::Budget;
use crate::contact::collide::ContactScratch;
use crate::distance::{Distance, Frontier};
use crate::mesh::placed::PlacedMesh;
use crate::mesh_scan::collide::{AskedOfMesh, collide};
use crate::mesh_scan::distance::distance;
use crate::mesh_scan::hint::MeshScanHint;
use crate::mesh_scan::mesh_scan_pair::MeshScanPairing;
use crate::mesh_scan::plan::MeshScanPlan;
use crate::motion::course::{Course, Look};
use crate::motion::plan::SweepPlan;
use crate::pair::placed::Placed;

/// A scan and a mesh that move.
pub(crate) struct MovingMeshScan<'a> {
    /// The scan, at any pose.
    pub(crate) scan: &'a Placed<'a>,
    pub(crate) mesh: &'a MeshHierarchy,
    pub(crate) plan: &'a SweepPlan,
    pub(crate) level: Level,
}

impl<'a> MovingMeshScan<'a> {
    fn placed(&self, [of_scan, of_mesh]: &[Pose; 2]) -> (Placed<'a>, PlacedMesh<'a>) {
        (self.scan.moved_to(of_scan), PlacedMesh::new(self.mesh, of_mesh))
    }
}

impl Course for MovingMeshScan<'_> {
    const THICK: f64 = 1.0;

    fn balls(&self) -> [Ball; 2] {
        [self.plan.ball(self.scan.scan().outline()), *self.mesh.arrays().ball]
    }

    fn stored(&self, poses: &[Pose; 2]) -> [Pose; 2] {
        let (scan, mesh) = self.placed(poses);
        [*scan.stored_to_world(), *mesh.stored_to_world()]
    }

    fn at<L: Look>(&self, poses: &[Pose; 2], budget: &Budget, look: L) -> Option<L::Found> {
        let (scan, mesh) = self.placed(poses);
        let (a, b) = (scan.scan().arrays(), self.mesh.arrays());
        let semantics = self.plan.options().semantics;
        let pair = MeshScanPairing::new((&scan, &a), (&mesh, &b), semantics, budget, self.level)?;
        let pose = pair.stored;
        Some(look.look(pair, &pose))
    }

    fn distance(
        &self,
        poses: &[Pose; 2],
        plan: &SweepPlan,
        budget: &Budget,
        nearest: &mut [usize; 2],
        scratch: (&mut Frontier, &mut ContactScratch),
    ) -> Distance {
        let (scan, mesh) = self.placed(poses);
        let mut hint = MeshScanHint::default();
        hint.nearest = Some(nearest.map(nearmiss_lanes::id32));
        let found = distance((&scan, &mesh), plan.distance(), budget, scratch, Some(&mut hint));
        *nearest = hint.nearest.map_or(*nearest, |found| found.map(|i| i as usize));
        found
    }

    fn touches(
        &self,
        poses: &[Pose; 2],
        plan: &SweepPlan,
        budget: &Budget,
        scratch: &mut ContactScratch,
    ) -> Answer {
        let (scan, mesh) = self.placed(poses);
        let plan = MeshScanPlan::sweeping(plan);
        collide(AskedOfMesh { scan: &scan, mesh: &mesh, plan: &plan, budget }, scratch, (None, None))
    }
}
