//! The penetration of a scan and a mesh.

use std::ops::ControlFlow;

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::MeshView;

use crate::ask::answer::{Answer, Contacts, Evidence, Reason, Statistics, Verdict};
use crate::ask::budget::Budget;
use crate::ask::options::Semantics;
use crate::contact::collide::ContactScratch;
use crate::mesh::foot::{depth_in_solid, foot};
use crate::mesh::penetration::piece::MeshPiece;
use crate::mesh::placed::PlacedMesh;
use crate::mesh::solid::{MeshSolid, SolidView};
use crate::mesh_scan::collide::{AskedOfMesh, collide};
use crate::mesh_scan::plan::MeshScanPlan;
use crate::pair::placed::Placed;
use crate::pair::placed_balls::is_proper;
use crate::penetration::answer::{Interior, Penetration};
use crate::penetration::apart::out_of_balls;
use crate::penetration::interior::{
    contains, counts, some_points, world_axes, world_ball, world_depth_in, world_nearest_part,
};
use crate::penetration::probe::{Deep, Probe, SLACK, Where};
use crate::penetration::scans::{PenetrationScratch, Piece};
use crate::penetration::search::search;
use crate::penetration::survey::{ContactSurvey, way_out};
use crate::solid::crossing::Crossing;
use crate::solid::elements::Elements;
use crate::solid::plan::ShapePlan;

type Vector = Vector3<f64>;

/// A placed scan as a, a placed mesh as b, or parts of them, and the cost of all tests so far. Shifts are
/// those of the mesh, in the world.
struct MeshScanProbe<'s> {
    scan: Placed<'s>,
    elements: Elements<'s>,
    /// The whole scan, whose surface encloses the solid.
    whole_scan: Elements<'s>,
    mesh: MeshPiece<'s>,
    view: &'s MeshView<'s>,
    whole_view: &'s MeshView<'s>,
    /// `true` for each of the scan and the mesh whose inside counts.
    are_solid: [bool; 2],
    plan: MeshScanPlan,
    budget: Budget,
    contact: &'s mut ContactScratch,
    crossings: &'s mut Vec<Crossing>,
    contacts: &'s mut Contacts,
    spent: Statistics,
}

/// Bounds the penetration of a scan and a mesh, whose solid is `solid`.
pub(crate) fn penetration<'s>(
    (scan, mesh): (Placed<'s>, PlacedMesh<'s>),
    (interior, solid): (Interior, &'s MeshSolid),
    asked: (&MeshScanPlan, &Budget),
    working: (&'s mut ContactScratch, &'s mut Vec<Crossing>),
    scratch: &'s mut PenetrationScratch,
) -> Penetration {
    if !solid.is_of(mesh.mesh()) {
        return Penetration::UNKNOWN;
    }
    of_pieces((Piece::whole(&scan), MeshPiece::whole(mesh, solid)), interior, asked, working, scratch)
}

/// Bounds the penetration of a scan and a mesh or parts of them.
pub(crate) fn of_pieces<'s>(
    (scan, mesh): (Piece<'s>, MeshPiece<'s>),
    interior: Interior,
    (plan, budget): (&MeshScanPlan, &Budget),
    (contact, crossings): (&'s mut ContactScratch, &'s mut Vec<Crossing>),
    scratch: &'s mut PenetrationScratch,
) -> Penetration {
    let Piece { part: scan, whole } = scan;
    if !is_proper(scan.stored_to_world()) || !is_proper(mesh.part.stored_to_world()) {
        return Penetration::UNKNOWN;
    }
    let of_shapes = ShapePlan::of_pair(plan.options());
    let (elements, whole_scan) = (Elements::new(scan, &of_shapes), Elements::new(whole, &of_shapes));
    let (view, whole_view) = (mesh.part.mesh().arrays(), mesh.whole.arrays());
    let PenetrationScratch { search: memory, contacts } = scratch;
    let mut probe = MeshScanProbe {
        scan,
        elements,
        whole_scan,
        mesh,
        view: &view,
        whole_view: &whole_view,
        are_solid: [counts(&elements, interior), mesh.solid.is_closed()],
        plan: plan.of_verdicts(),
        budget: Budget { resolution: None, ..*budget },
        contact,
        crossings,
        contacts,
        spent: Statistics::default(),
    };
    let Some(out) = probe.out_of_balls() else { return Penetration::UNKNOWN };
    let bounds = search(&mut probe, out, memory);
    let answer = probe.collide_with(bounds.shift, plan, None, &Budget::UNLIMITED);
    let evidence = match answer.verdict {
        Verdict::Separated { evidence, .. } => evidence,
        _ => Evidence::Estimated,
    };
    Penetration::new(&bounds, (1.0, |way| way.into()), (evidence, answer.band), probe.spent)
}

impl<'s> MeshScanProbe<'s> {
    /// Asks whether the scan and the mesh meet after a shift.
    fn collide_with(
        &mut self,
        t: Vector,
        plan: &MeshScanPlan,
        contacts: Option<&mut Contacts>,
        budget: &Budget,
    ) -> Answer {
        let mesh = self.mesh.part.shifted(t.into());
        let asked = AskedOfMesh { scan: &self.scan, mesh: &mesh, plan, budget };
        let answer = collide(asked, self.contact, (None, contacts));
        self.spent.add(&answer.statistics);
        answer
    }

    /// Asks whether they meet after a shift. Breaks if the budget is spent.
    fn collide(&mut self, t: Vector, contacts: Option<&mut Contacts>) -> ControlFlow<(), Answer> {
        let (plan, budget) = (self.plan, self.budget.less(self.spent.work()));
        let answer = self.collide_with(t, &plan, contacts, &budget);
        match answer.verdict {
            Verdict::Undecided(Reason::Budget { .. }) => ControlFlow::Break(()),
            _ => ControlFlow::Continue(answer),
        }
    }

    /// A ball about the mesh, in the world.
    fn ball_of_mesh(&self) -> (Vector, f64) {
        let placed = self.mesh.part.stored_to_world();
        (placed.apply(self.view.ball.centre).into(), self.view.ball.radius * placed.scale())
    }

    /// Finds a shift after which the scan and the mesh are apart.
    fn out_of_balls(&mut self) -> Option<Vector> {
        let (balls, plan) = ([world_ball(&self.elements), self.ball_of_mesh()], self.plan);
        out_of_balls(balls, plan.options().margin, |t| {
            let answer = self.collide_with(t, &plan, None, &Budget::UNLIMITED);
            // A part may be inside the solid even far from the other part.
            answer.verdict.is_separated() && !self.are_nested(t)
        })
    }

    /// The solid of the whole mesh.
    fn solid_view(&self) -> SolidView<'s> {
        self.mesh.solid_view(self.whole_view, self.contact.level)
    }

    /// Returns `true` if a part of one is inside the other, which is solid, after a shift.
    ///
    /// If the surfaces do not meet, each part is inside or outside as a whole.
    fn are_nested(&mut self, t: Vector) -> bool {
        let [is_scan_solid, is_mesh_solid] = self.are_solid;
        let (pose, solid) = (*self.mesh.part.pose(), self.solid_view());
        let of_scan =
            || some_points(&self.scan).into_iter().map(|place| pose.apply_inverse((place - t).into()));
        if is_mesh_solid && of_scan().any(|place| solid.contains(place)) {
            return true;
        }
        is_scan_solid
            && self.mesh.any_place(self.whole_view, |place| {
                self.spent.evaluations += 1;
                let working = (self.contact.level, &mut *self.crossings, &mut self.contact.gathers[0]);
                contains(&self.whole_scan, &(Vector::from(pose.apply(place)) + t), working)
            })
    }

    /// Measures how deep a place is in both. It is moved to the nearest place of the surface that it is to be
    /// on.
    fn measured(&mut self, place: Vector, t: Vector, at: Where) -> Option<Deep> {
        let margin = self.plan.options().margin;
        let mut found = Deep { place, at, depth: margin, in_a: 0.0, uphill: Vector::zeros() };
        if at == Where::OnA {
            let (point, radius) = world_nearest_part(&self.elements, &found.place, self.contact.level)?;
            found.place = point;
            found.depth += radius;
            found.in_a = radius;
        }
        let (mesh, level) = (self.mesh.part, self.contact.level);
        if at == Where::OnB {
            let own = mesh.pose().apply_inverse((found.place - t).into());
            found.place = t + Vector::from(mesh.pose().apply(foot(mesh.mesh(), self.view, level, own)));
        }
        if at != Where::OnB {
            let (depth, uphill) = depth_in_solid(&self.solid_view(), &mesh, found.place - t)?;
            found.depth += depth;
            found.uphill += uphill;
        }
        if at != Where::OnA {
            let working = (self.contact.level, &mut *self.crossings, &mut self.contact.gathers[0]);
            let own = world_depth_in(&self.whole_scan, &found.place, working)?;
            found.depth = own.with_ball(found.depth);
            found.in_a = own.length;
            found.uphill += own.uphill;
        }
        Some(found)
    }
}

impl Probe for MeshScanProbe<'_> {
    fn is_apart(&mut self, t: Vector) -> ControlFlow<(), bool> {
        let answer = self.collide(t, None)?;
        ControlFlow::Continue(answer.verdict.is_separated() && !self.are_nested(t))
    }

    /// The direction is that of the normal that is nearest to the shift.
    fn touch(&mut self, t: Vector) -> ControlFlow<(), Option<(Vector, Vector)>> {
        let Verdict::Intersecting { contact, .. } = self.collide(t, None)?.verdict else {
            return ControlFlow::Continue(None);
        };
        ControlFlow::Continue(Some((contact.point.into(), way_out(&contact, t))))
    }

    fn survey(&mut self, survey: &mut ContactSurvey) -> ControlFlow<()> {
        survey.clear();
        let mut contacts = std::mem::take(self.contacts);
        let flow = self.collide(Vector::zeros(), Some(&mut contacts));
        // The greatest shift under which a ball and a triangle stay in contact.
        let is_thickened = matches!(self.plan.options().semantics, Semantics::Thickened(_));
        let reach = self.plan.reach();
        survey.add_all(&contacts, |residual| if is_thickened { reach - 2.0 * residual } else { 0.0 });
        let is_cut_short = !contacts.complete && self.budget.may_end();
        *self.contacts = contacts;
        flow?;
        if is_cut_short { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn places(&self) -> &'static [Where] {
        Where::of(self.are_solid)
    }

    fn deep_at(&mut self, place: Vector, t: Vector, at: Where) -> ControlFlow<(), Option<Deep>> {
        self.budget.go_on(self.spent.work())?;
        self.spent.evaluations += 1;
        ControlFlow::Continue(self.measured(place, t, at))
    }

    fn centres(&self) -> [Vector; 2] {
        [world_ball(&self.elements).0, self.ball_of_mesh().0]
    }

    fn axes(&self) -> [[Vector; 3]; 2] {
        let placed = self.mesh.part.stored_to_world();
        let of_mesh = self.view.tree.root_box().axes;
        [world_axes(&self.elements), of_mesh.map(|axis| placed.rotate(axis.map(f64::from)).into())]
    }

    fn slack(&self) -> f64 {
        SLACK * self.scan.sampling_radius()
    }

    fn rounding(&self) -> f64 {
        let far =
            [world_ball(&self.elements), self.ball_of_mesh()].map(|(centre, radius)| centre.amax() + radius);
        1e-12 * (far[0] + far[1])
    }
}
