//! The penetration of a convex shape and a mesh, in the stored frame of the mesh.

use std::ops::ControlFlow;

use fearless_simd::Level;
use nearmiss_geometry::Pose;
use nearmiss_hierarchy::MeshView;

use crate::ask::answer::{Evidence, Statistics};
use crate::ask::budget::Budget;
use crate::mesh::foot::{depth_in_solid, foot};
use crate::mesh::placed::PlacedMesh;
use crate::mesh::solid::{MeshSolid, SolidView};
use crate::penetration::answer::Penetration;
use crate::penetration::apart::out_of_balls;
use crate::penetration::probe::{Deep, Probe, Vector, Where};
use crate::penetration::search::{SearchScratch, search};
use crate::penetration::survey::{ContactSurvey, Surveyed};
use crate::shape_pairs::mesh_distance::visit_near;
use crate::solid::core::Solid;
use crate::solid::overlap::{Overlap, enough, overlap};
use crate::solid::shape::Shape;

/// A mesh as a, and a shape as b.
struct ShapeMeshProbe<'s> {
    mesh: PlacedMesh<'s>,
    view: &'s MeshView<'s>,
    parts: &'s MeshSolid,
    solid: &'s Solid<'s>,
    budget: Budget,
    level: Level,
    spent: Statistics,
}

/// Bounds the penetration of a mesh with these closed parts and `solid`, which is in the mesh's stored frame.
pub(crate) fn penetration(
    mesh: PlacedMesh<'_>,
    parts: &MeshSolid,
    solid: &Solid<'_>,
    (budget, level): (&Budget, Level),
    memory: &mut SearchScratch,
) -> Penetration {
    if !parts.is_of(mesh.mesh()) {
        return Penetration::UNKNOWN;
    }
    let view = mesh.mesh().arrays();
    let (budget, spent) = (*budget, Statistics::default());
    let mut probe = ShapeMeshProbe { mesh, view: &view, parts, solid, budget, level, spent };
    let Some(out) = probe.out_of_balls() else { return Penetration::UNKNOWN };
    let bounds = search(&mut probe, out, memory);
    let placed = mesh.stored_to_world();
    let turned = |way: Vector| placed.rotate(way.into());
    Penetration::new(&bounds, (placed.scale(), turned), (Evidence::Certified, 0.0), probe.spent)
}

impl<'s> ShapeMeshProbe<'s> {
    /// Calls `visit` with the triangles that touch the shape after a shift, until it ends. The shift and each
    /// triangle that is compared count as evaluations.
    fn each_touched(
        &mut self,
        t: Vector,
        mut visit: impl FnMut(&mut Self, &[Vector; 3], Vector) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let (solid, mesh) = (self.solid.shifted(&t), self.mesh.mesh());
        let (view, level) = (self.view, self.level);
        self.spent.evaluations += 1;
        visit_near(mesh, view, (&solid, 0.0), level, |_, corners, found| {
            self.spent.evaluations += 1;
            // NaN and distances that are not proven count as touching.
            let is_apart = found.lower > solid.radius;
            if !is_apart {
                visit(self, corners, found.points[1])?;
            }
            ControlFlow::Continue(0.0)
        })
    }

    /// Returns `true` if a triangle touches the shape after a shift.
    fn is_touched(&mut self, t: Vector) -> bool {
        self.each_touched(t, |_, _, _| ControlFlow::Break(())).is_break()
    }

    /// Bounds the least shift out of a triangle of the shape shifted by `t`. `None` if it is at most `least`,
    /// by the directions of the shape's box.
    fn out_of(&self, corners: &[Vector; 3], t: Vector, least: f64) -> Option<Overlap> {
        let points = corners.map(Into::into);
        let triangle = Solid::new(&Shape::Triangle { points, radius: 0.0 }, &Pose::IDENTITY)?;
        let shape = self.solid.shifted(&t);
        let is_less = |axis: &Vector| {
            enough(&triangle, &shape, axis) <= least || enough(&triangle, &shape, &-axis) <= least
        };
        let is_least = shape.axes.iter().any(is_less);
        (!is_least).then(|| overlap(&triangle, &shape))
    }

    /// Finds a shift after which the shape touches nothing.
    fn out_of_balls(&mut self) -> Option<Vector> {
        let (ball, solid) = (self.view.ball, self.solid);
        let of_mesh = (Vector::from(ball.centre), ball.radius);
        let own = (solid.centre, solid.half.norm() + solid.radius);
        out_of_balls([of_mesh, own], 0.0, |t| !self.is_touched(t))
    }

    /// Breaks if the budget is spent.
    fn go_on(&self) -> ControlFlow<()> {
        self.budget.go_on(self.spent.work())
    }

    fn in_world(&self, place: Vector) -> Vector {
        self.mesh.stored_to_world().apply(place.into()).into()
    }

    /// Moves a place to the frame of the mesh's input.
    fn in_input(&self, place: Vector) -> [f64; 3] {
        self.mesh.pose().apply_inverse(self.in_world(place).into())
    }

    fn solid_view(&self) -> SolidView<'s> {
        SolidView {
            mesh: self.mesh.mesh(),
            view: self.view,
            solid: self.parts,
            some: None,
            level: self.level,
        }
    }

    /// Measures how deep a place is in the closed parts of the mesh and in the shape. A place beside the core
    /// is moved there.
    fn deep_in_both(&self, solid: &Solid<'_>, place: Vector) -> Option<Deep> {
        let (place, (own, uphill)) = solid.deep_near(&place);
        let placed = self.mesh.stored_to_world();
        let (depth, away) = depth_in_solid(&self.solid_view(), &self.mesh, self.in_world(place))?;
        let away = Vector::from(placed.rotate_inverse(away.into()));
        let in_a = depth / placed.scale();
        Some(Deep { place, at: Where::Inside, depth: own + in_a, in_a, uphill: uphill + away })
    }

    /// Measures how deep the place of the mesh that is nearest to another one is in the shape.
    fn deep_on_mesh(&self, solid: &Solid<'_>, place: Vector) -> Option<Deep> {
        let on_mesh = foot(self.mesh.mesh(), self.view, self.level, self.in_input(place));
        let in_world = self.mesh.pose().apply(on_mesh);
        let place = Vector::from(self.mesh.stored_to_world().apply_inverse(in_world));
        let (depth, uphill) = solid.depth(&place)?;
        Some(Deep { place, at: Where::OnA, depth, in_a: 0.0, uphill })
    }
}

impl Probe for ShapeMeshProbe<'_> {
    /// If no triangle touches the shape, it is inside or outside of the closed parts as a whole.
    fn is_apart(&mut self, t: Vector) -> ControlFlow<(), bool> {
        self.go_on()?;
        if self.is_touched(t) {
            return ControlFlow::Continue(false);
        }
        let inside = self.solid.inside + t;
        let is_nested = self.parts.is_closed() && self.solid_view().contains(self.in_input(inside));
        ControlFlow::Continue(!is_nested)
    }

    /// The direction is that in which the shape leaves the triangle there soonest.
    fn touch(&mut self, t: Vector) -> ControlFlow<(), Option<(Vector, Vector)>> {
        self.go_on()?;
        let mut met = None;
        let _first = self.each_touched(t, |probe, corners, place| {
            met = probe.out_of(corners, t, f64::NEG_INFINITY).map(|out| (place, out.way));
            if met.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        ControlFlow::Continue(met)
    }

    fn survey(&mut self, survey: &mut ContactSurvey) -> ControlFlow<()> {
        survey.clear();
        let zero = Vector::zeros();
        self.each_touched(zero, |probe, corners, place| {
            probe.go_on()?;
            let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
            let normal = normal.try_normalize(0.0).unwrap_or(zero);
            let out = probe.out_of(corners, zero, survey.least);
            let (way, depth) = out.map_or((zero, 0.0), |out| (out.way, out.lower));
            survey.add(Surveyed { point: place, normals: [way, normal], depths: [depth, 0.0] }, depth);
            ControlFlow::Continue(())
        })
    }

    fn places(&self) -> &'static [Where] {
        Where::of_shape(self.parts.is_closed())
    }

    fn deep_at(&mut self, place: Vector, t: Vector, at: Where) -> ControlFlow<(), Option<Deep>> {
        self.go_on()?;
        self.spent.evaluations += 1;
        let solid = &self.solid.shifted(&t);
        ControlFlow::Continue(match at {
            Where::OnA => self.deep_on_mesh(solid, place),
            Where::Inside | Where::OnB => self.deep_in_both(solid, place),
        })
    }

    fn centres(&self) -> [Vector; 2] {
        [self.view.tree.root_box().centre.map(f64::from).into(), self.solid.inside]
    }

    fn axes(&self) -> [[Vector; 3]; 2] {
        let of_mesh = self.view.tree.root_box().axes;
        [of_mesh.map(|axis| axis.map(f64::from).into()), self.solid.axes]
    }

    fn slack(&self) -> f64 {
        0.0
    }

    /// Places go through the world and the frame of the mesh's input to its closed parts and back.
    fn rounding(&self) -> f64 {
        let (ball, solid) = (self.view.ball, self.solid);
        let of_mesh = Vector::from(ball.centre).amax() + ball.radius;
        let stored = of_mesh + solid.centre.amax() + solid.half.amax() + solid.radius;
        let (frame, placed, pose) = (self.mesh.mesh().frame(), self.mesh.stored_to_world(), self.mesh.pose());
        let far = |pose: &Pose| Vector::from(pose.translation()).amax() / placed.scale();
        let input = Vector::from(frame.origin).amax() / frame.scale;
        1e-12 * stored + 1e-14 * (input + far(placed) + far(pose))
    }
}
