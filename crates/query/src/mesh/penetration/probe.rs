//! Tests of two solids at shifted poses.

use std::ops::ControlFlow;

use fearless_simd::Level;
use nearmiss_geometry::Pose;
use nearmiss_hierarchy::{MeshView, Stack};

use crate::ask::answer::Statistics;
use crate::ask::budget::Budget;
use crate::mesh::collide::first_met;
use crate::mesh::foot::depth_in_solid;
use crate::mesh::mesh_pair::MeshPairing;
use crate::mesh::penetration::contacts::survey;
use crate::mesh::penetration::triangle_depth::triangle_depth;
use crate::mesh::placed::PlacedMesh;
use crate::mesh::solid::{MeshSolid, SolidView};
use crate::penetration::apart::out_of_balls;
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

    /// Returns the meshes with b shifted by `t`.
    fn shifted(&self, t: Vector) -> [PlacedMesh<'s>; 2] {
        let [a, b] = self.meshes;
        [a, b.shifted(t.into())]
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
        self.budget.less(self.spent.work())
    }

    /// Returns a shift after which the bounding balls are apart; `None` if a pose is invalid.
    pub(crate) fn out_of_balls(&self) -> Option<Vector> {
        let balls = [0, 1].map(|k: usize| {
            let (placed, ball) = (self.meshes[k].stored_to_world(), self.views[k].ball);
            (Vector::from(placed.apply(ball.centre)), ball.radius * placed.scale())
        });
        out_of_balls(balls, 0.0, |t| self.pair(&self.shifted(t)).is_some_and(|pair| pair.gap > 0.0))
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
        self.spent.add(&pair.meter.spent);
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
        self.spent.add(&pair.meter.spent);
        if met.is_some() {
            return ControlFlow::Continue(false);
        }
        flow?;
        let poses = meshes.map(|placed| *placed.pose());
        let is_nested =
            !are_balls_apart && (self.has_part_inside(0, &poses) || self.has_part_inside(1, &poses));
        ControlFlow::Continue(!is_nested)
    }

    fn survey(&mut self, found: &mut ContactSurvey) -> ControlFlow<()> {
        let meshes = self.meshes;
        let Some(mut pair) = self.pair(&meshes) else { return ControlFlow::Break(()) };
        let flow = survey(&mut pair, self.stack, found);
        self.spent.add(&pair.meter.spent);
        flow
    }

    fn deep(&mut self, place: Vector) -> ControlFlow<(), Option<Deep>> {
        let (Some(a), Some(b)) = (self.solid(0), self.solid(1)) else { return ControlFlow::Continue(None) };
        let meshes = self.meshes;
        let Some(mut pair) = self.pair(&meshes) else { return ControlFlow::Break(()) };
        pair.meter.go_on()?;
        self.spent.evaluations += 1;
        let mut found = Deep { place, depth: 0.0, uphill: Vector::zeros() };
        for (solid, placed) in [a, b].iter().zip(&self.meshes) {
            let Some((depth, uphill)) = depth_in_solid(solid, placed, place) else {
                return ControlFlow::Continue(None);
            };
            found.depth += depth;
            found.uphill += uphill;
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
