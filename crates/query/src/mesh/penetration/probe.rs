//! Tests of two solids at shifted poses.

use std::ops::ControlFlow;

use fearless_simd::Level;
use nearmiss_geometry::Pose;
use nearmiss_hierarchy::{MeshView, Stack};

use crate::ask::answer::Statistics;
use crate::ask::budget::Budget;
use crate::mesh::collide::first_met;
use crate::mesh::foot::foot;
use crate::mesh::mesh_pair::MeshPairing;
use crate::mesh::penetration::contacts::survey;
use crate::mesh::penetration::triangle_depth::triangle_depth;
use crate::mesh::placed::PlacedMesh;
use crate::mesh::solid::{MeshSolid, SolidView};
use crate::penetration::probe::{Deep, Probe, Vector};
use crate::penetration::survey::ContactSurvey;

/// Two placed meshes with their solids, and the cost of all tests so far. Shifts are those of b, in
/// the world.
pub(crate) struct MeshProbe<'s> {
    meshes: [PlacedMesh<'s>; 2],
    views: &'s [MeshView<'s>; 2],
    solids: [&'s MeshSolid; 2],
    budget: Budget,
    level: Level,
    stack: &'s mut Stack,
    pub(crate) spent: Statistics,
}

impl<'s> MeshProbe<'s> {
    pub(crate) fn new(
        meshes: [PlacedMesh<'s>; 2],
        views: &'s [MeshView<'s>; 2],
        solids: [&'s MeshSolid; 2],
        budget: &Budget,
        (level, stack): (Level, &'s mut Stack),
    ) -> Self {
        Self { meshes, views, solids, budget: *budget, level, stack, spent: Statistics::default() }
    }

    /// Returns the pose of b, shifted by `t`.
    fn pose_of_b(&self, t: Vector) -> Pose {
        let pose = self.meshes[1].pose();
        pose.with_translation((Vector::from(pose.translation()) + t).into())
    }

    /// Returns the meshes with b shifted by `t`.
    fn shifted(&self, t: Vector) -> [PlacedMesh<'s>; 2] {
        let [a, b] = self.meshes;
        [a, PlacedMesh::new(b.mesh(), &self.pose_of_b(t))]
    }

    /// Returns the pair of shifted meshes; `None` if a pose is invalid.
    fn pair<'m>(&self, meshes: &'m [PlacedMesh<'m>; 2]) -> Option<MeshPairing<'m>>
    where
        's: 'm,
    {
        MeshPairing::new(meshes, self.views.each_ref(), &self.budget(), self.level)
    }

    /// Returns what is left of the budget. The limit against damaged files is that of each test.
    fn budget(&self) -> Budget {
        let spent = self.spent.evaluations + self.spent.node_pairs;
        Budget { work: self.budget.work.map(|work| work.saturating_sub(spent)), ..self.budget }
    }

    /// Counts what a test has spent.
    fn spend(&mut self, spent: &Statistics) {
        self.spent.evaluations += spent.evaluations;
        self.spent.node_pairs += spent.node_pairs;
        self.spent.leaf_pairs += spent.leaf_pairs;
    }

    /// Returns a shift along the line of the centres after which the bounding balls are apart; `None`
    /// if a pose is invalid.
    pub(crate) fn out_of_balls(&self) -> Option<Vector> {
        let ball = |k: usize| {
            let (placed, ball) = (self.meshes[k].stored_to_world(), self.views[k].ball);
            (Vector::from(placed.apply(ball.centre)), ball.radius * placed.scale())
        };
        let ((a, r), (b, s)) = (ball(0), ball(1));
        let between = b - a;
        let way = between.try_normalize(1e-9 * (r + s)).unwrap_or_else(Vector::z);
        let mut length = (r + s - way.dot(&between)).max(0.0) * (1.0 + 1e-5) + 1e-9 * (r + s);
        // Rounding grows with the distance from the origin.
        for _ in 0..64 {
            if self.pair(&self.shifted(way * length))?.gap > 0.0 {
                return Some(way * length);
            }
            length *= 2.0;
        }
        None
    }

    /// Returns `true` if a part of the other mesh begins inside the solid of mesh `k`.
    fn has_part_inside(&mut self, k: usize, poses: &[Pose; 2]) -> bool {
        let Some(outer) = self.solid(k) else { return false };
        let other = 1 - k;
        self.solids[other].places(&self.views[other]).any(|place| {
            self.spent.evaluations += 1;
            outer.contains(poses[k].apply_inverse(poses[other].apply(place)))
        })
    }

    /// Returns the solid of mesh `k`; `None` if it has no closed part.
    fn solid(&self, k: usize) -> Option<SolidView<'s>> {
        let solid = Some(self.solids[k]).filter(|solid| solid.is_closed())?;
        Some(SolidView { mesh: self.meshes[k].mesh(), view: &self.views[k], solid, level: self.level })
    }
}

impl Probe for MeshProbe<'_> {
    /// The direction is that in which the two triangles there are separated soonest.
    fn touch(&mut self, t: Vector) -> ControlFlow<(), Option<(Vector, Vector)>> {
        let meshes = self.shifted(t);
        let Some(mut pair) = self.pair(&meshes) else { return ControlFlow::Break(()) };
        let (flow, met) = first_met(&mut pair, self.stack);
        self.spend(&pair.meter.spent);
        let Some(met) = met else { return flow.map_continue(|()| None) };
        let [a, b] = pair.corners(met);
        let pose = pair.meshes[0].pose();
        let place = pair.contact(met).map_or(pose.apply(a[0]), |contact| contact.point);
        let way = pose.rotate(triangle_depth(&a, &b).1.into());
        ControlFlow::Continue(Some((place.into(), way.into())))
    }

    /// If no triangles meet, each part of a mesh is inside or outside of the other solid as a whole.
    fn is_apart(&mut self, t: Vector) -> ControlFlow<(), bool> {
        let meshes = self.shifted(t);
        let Some(mut pair) = self.pair(&meshes) else { return ControlFlow::Break(()) };
        let are_balls_apart = pair.gap > 0.0;
        let (flow, met) = first_met(&mut pair, self.stack);
        self.spend(&pair.meter.spent);
        if met.is_some() {
            return ControlFlow::Continue(false);
        }
        flow?;
        let poses = [*self.meshes[0].pose(), self.pose_of_b(t)];
        let is_nested =
            !are_balls_apart && (self.has_part_inside(0, &poses) || self.has_part_inside(1, &poses));
        ControlFlow::Continue(!is_nested)
    }

    fn survey(&mut self, found: &mut ContactSurvey) -> ControlFlow<()> {
        let meshes = self.meshes;
        let Some(mut pair) = self.pair(&meshes) else { return ControlFlow::Break(()) };
        let flow = survey(&mut pair, self.stack, found);
        self.spend(&pair.meter.spent);
        flow
    }

    fn deep(&mut self, place: Vector) -> ControlFlow<(), Option<Deep>> {
        let (Some(a), Some(b)) = (self.solid(0), self.solid(1)) else { return ControlFlow::Continue(None) };
        let meshes = self.meshes;
        let Some(mut pair) = self.pair(&meshes) else { return ControlFlow::Break(()) };
        pair.meter.go_on()?;
        self.spent.evaluations += 1;
        let mut found = Deep { place, depth: 0.0, uphill: Vector::zeros() };
        for (k, solid) in [a, b].iter().enumerate() {
            let pose = self.meshes[k].pose();
            let own = pose.apply_inverse(place.into());
            if !solid.contains(own) {
                return ControlFlow::Continue(None);
            }
            let away = place - Vector::from(pose.apply(foot(solid.mesh, solid.view, self.level, own)));
            found.depth += away.norm();
            found.uphill += away.try_normalize(0.0).unwrap_or_else(Vector::zeros);
        }
        ControlFlow::Continue(Some(found))
    }

    fn centres(&self) -> [Vector; 2] {
        [0, 1].map(|k| {
            let centre = self.views[k].tree.root_box().centre.map(f64::from);
            self.meshes[k].stored_to_world().apply(centre).into()
        })
    }

    fn axes(&self) -> [[Vector; 3]; 2] {
        [0, 1].map(|k| {
            let placed = self.meshes[k].stored_to_world();
            self.views[k].tree.root_box().axes.map(|axis| Vector::from(placed.rotate(axis.map(f64::from))))
        })
    }

    fn slack(&self) -> f64 {
        0.0
    }

    fn rounding(&self) -> f64 {
        let far = |k: usize| {
            let (mesh, pose) = (self.meshes[k].mesh(), self.meshes[k].pose());
            let extent =
                mesh.bounds().min.iter().chain(&mesh.bounds().max).fold(0.0_f64, |far, x| far.max(x.abs()));
            pose.scale() * extent + Vector::from(pose.translation()).amax()
        };
        1e-13 * (far(0) + far(1))
    }
}
