//! Tests of two solids at shifted poses.

use std::ops::ControlFlow;

use fearless_simd::Level;
use nearmiss_hierarchy::{MeshView, Stack};

use crate::ask::answer::Statistics;
use crate::ask::budget::Budget;
use crate::mesh::collide::first_met;
use crate::mesh::foot::{depth_in_solid, foot};
use crate::mesh::mesh_pair::MeshPairing;
use crate::mesh::penetration::contacts::survey;
use crate::mesh::penetration::piece::MeshPiece;
use crate::mesh::penetration::triangle_depth::triangle_depth;
use crate::mesh::placed::PlacedMesh;
use crate::mesh::solid::SolidView;
use crate::penetration::apart::out_of_balls;
use crate::penetration::probe::{Deep, Probe, Vector, Where};
use crate::penetration::survey::ContactSurvey;

/// Two placed meshes, or parts of them, with their solids, and the cost of all tests so far. Shifts are
/// those of b, in the world.
pub(crate) struct MeshProbe<'s> {
    pieces: [MeshPiece<'s>; 2],
    /// The arrays of the pieces.
    views: &'s [MeshView<'s>; 2],
    /// The arrays of the whole meshes.
    wholes: &'s [MeshView<'s>; 2],
    /// The solids, of the whole meshes; `None` without a closed part.
    solids: [Option<SolidView<'s>>; 2],
    budget: Budget,
    level: Level,
    stack: &'s mut Stack,
    pub(crate) spent: Statistics,
}

impl<'s> MeshProbe<'s> {
    /// A probe of meshes, given the arrays of both and of both whole meshes.
    pub(crate) fn new(
        pieces: [MeshPiece<'s>; 2],
        [views, wholes]: [&'s [MeshView<'s>; 2]; 2],
        budget: &Budget,
        (level, stack): (Level, &'s mut Stack),
    ) -> Self {
        let solids = [0, 1]
            .map(|k: usize| pieces[k].solid.is_closed().then(|| pieces[k].solid_view(&wholes[k], level)));
        Self { pieces, views, wholes, solids, budget: *budget, level, stack, spent: Statistics::default() }
    }

    fn meshes(&self) -> [PlacedMesh<'s>; 2] {
        self.pieces.map(|piece| piece.part)
    }

    /// Returns the meshes with b shifted by `t`.
    fn shifted(&self, t: Vector) -> [PlacedMesh<'s>; 2] {
        let [a, b] = self.meshes();
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

    /// Returns a shift after which the meshes are apart, as their bounding balls are; `None` if a pose is
    /// invalid.
    pub(crate) fn out_of_balls(&mut self) -> Option<Vector> {
        let balls = [0, 1].map(|k: usize| {
            let (placed, ball) = (self.pieces[k].part.stored_to_world(), self.views[k].ball);
            (Vector::from(placed.apply(ball.centre)), ball.radius * placed.scale())
        });
        out_of_balls(balls, 0.0, |t| {
            let meshes = self.shifted(t);
            // A part may be inside a solid even far from the other part.
            self.pair(&meshes).is_some_and(|pair| pair.gap > 0.0) && !self.are_nested(true, &meshes)
        })
    }

    /// Returns `true` if a piece of one mesh begins inside the solid of the other, for meshes without common
    /// points, whose bounding balls are apart or not.
    fn are_nested(&mut self, are_balls_apart: bool, meshes: &[PlacedMesh<'_>; 2]) -> bool {
        if are_balls_apart && self.pieces.iter().all(MeshPiece::is_whole) {
            return false;
        }
        let poses = meshes.map(|placed| *placed.pose());
        (0..2).any(|k| {
            let Some(outer) = self.solids[k] else { return false };
            let other = 1 - k;
            self.pieces[other].any_place(&self.wholes[other], |place| {
                self.spent.evaluations += 1;
                outer.contains(poses[k].apply_inverse(poses[other].apply(place)))
            })
        })
    }

    /// Measures how deep a place is in both things. It is moved to the nearest point of the surface that it
    /// is to be on.
    fn measured(&self, place: Vector, t: Vector, at: Where) -> Option<Deep> {
        let (shifts, is_inside) = ([Vector::zeros(), t], at.is_inside());
        let mut found = Deep { place, at, depth: 0.0, in_a: 0.0, uphill: Vector::zeros() };
        for k in (0..2).filter(|&k| !is_inside[k]) {
            let part = self.pieces[k].part;
            let own = part.pose().apply_inverse((found.place - shifts[k]).into());
            let on_mesh = part.pose().apply(foot(part.mesh(), &self.views[k], self.level, own));
            found.place = shifts[k] + Vector::from(on_mesh);
        }
        for k in (0..2).filter(|&k| is_inside[k]) {
            let placed = &self.pieces[k].part;
            let (depth, uphill) = depth_in_solid(self.solids[k].as_ref()?, placed, found.place - shifts[k])?;
            found.depth += depth;
            found.in_a += if k == 0 { depth } else { 0.0 };
            found.uphill += uphill;
        }
        Some(found)
    }
}

impl Probe for MeshProbe<'_> {
    /// The direction is that in which the two triangles there are separated soonest.
    fn touch(&mut self, t: Vector) -> ControlFlow<(), Option<(Vector, Vector)>> {
        self.budget.go_on(self.spent.work())?;
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
        // A test that ends at the first pair of leaves does not ask.
        self.budget.go_on(self.spent.work())?;
        let meshes = self.shifted(t);
        let Some(mut pair) = self.pair(&meshes) else { return ControlFlow::Break(()) };
        let are_balls_apart = pair.gap > 0.0;
        let (flow, met) = first_met(&mut pair, self.stack);
        self.spent.add(&pair.meter.spent);
        if met.is_some() {
            return ControlFlow::Continue(false);
        }
        flow?;
        ControlFlow::Continue(!self.are_nested(are_balls_apart, &meshes))
    }

    fn survey(&mut self, found: &mut ContactSurvey) -> ControlFlow<()> {
        let meshes = self.meshes();
        let Some(mut pair) = self.pair(&meshes) else { return ControlFlow::Break(()) };
        let flow = survey(&mut pair, self.stack, found);
        self.spent.add(&pair.meter.spent);
        flow
    }

    fn places(&self) -> &'static [Where] {
        Where::of(self.solids.map(|solid| solid.is_some()))
    }

    fn deep_at(&mut self, place: Vector, t: Vector, at: Where) -> ControlFlow<(), Option<Deep>> {
        let meshes = self.meshes();
        let Some(mut pair) = self.pair(&meshes) else { return ControlFlow::Break(()) };
        pair.meter.go_on()?;
        self.spent.evaluations += 1;
        ControlFlow::Continue(self.measured(place, t, at))
    }

    fn centres(&self) -> [Vector; 2] {
        [0, 1].map(|k| {
            let centre = self.views[k].tree.root_box().centre.map(f64::from);
            self.pieces[k].part.stored_to_world().apply(centre).into()
        })
    }

    fn axes(&self) -> [[Vector; 3]; 2] {
        [0, 1].map(|k| {
            let placed = self.pieces[k].part.stored_to_world();
            self.views[k].tree.root_box().axes.map(|axis| Vector::from(placed.rotate(axis.map(f64::from))))
        })
    }

    fn slack(&self) -> f64 {
        0.0
    }

    fn rounding(&self) -> f64 {
        let far = |k: usize| {
            let (mesh, pose) = (self.pieces[k].part.mesh(), self.pieces[k].part.pose());
            let extent =
                mesh.bounds().min.iter().chain(&mesh.bounds().max).fold(0.0_f64, |far, x| far.max(x.abs()));
            pose.scale() * extent + Vector::from(pose.translation()).amax()
        };
        1e-13 * (far(0) + far(1))
    }
}
