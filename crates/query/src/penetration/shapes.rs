//! The penetration of a convex shape and a scan, in the stored frame of the scan.

use std::ops::ControlFlow;

use fearless_simd::Level;

use crate::ask::answer::{Evidence, Statistics};
use crate::ask::budget::Budget;
use crate::pair::placed::ViewScratch;
use crate::penetration::across::across;
use crate::penetration::answer::{Interior, Penetration};
use crate::penetration::apart::out_of_balls;
use crate::penetration::interior::{counts, depth_in, is_inside, nearest_part};
use crate::penetration::probe::{Deep, Probe, SLACK, Vector, Where};
use crate::penetration::search::{SearchScratch, search};
use crate::penetration::survey::{ContactSurvey, Surveyed};
use crate::solid::answer::{ShapeAnswer, ShapeVerdict};
use crate::solid::contacts::contacts;
use crate::solid::core::Solid;
use crate::solid::elements::Elements;
use crate::solid::scratch::SolidScratch;
use crate::solid::touch::touch;

/// A scan as a, and a shape as b.
struct ShapeProbe<'s, 'a> {
    elements: &'s Elements<'a>,
    solid: &'s Solid<'s>,
    /// `true` if the inside of the scan counts.
    is_solid: bool,
    budget: Budget,
    level: Level,
    scratch: &'s mut ViewScratch,
    memory: &'s mut SolidScratch,
    spent: Statistics,
}

/// Bounds the penetration of a shape and a scan. `elements` has the detail `Verdict`.
pub(crate) fn penetration(
    elements: &Elements<'_>,
    solid: Option<&Solid<'_>>,
    (interior, budget): (Interior, &Budget),
    (level, scratch, solids): (Level, &mut ViewScratch, &mut SolidScratch),
    memory: &mut SearchScratch,
) -> Penetration {
    let Some(solid) = solid else { return Penetration::UNKNOWN };
    let is_solid = counts(elements, interior);
    let (budget, spent) = (*budget, Statistics::default());
    let mut probe = ShapeProbe { elements, solid, is_solid, budget, level, scratch, memory: solids, spent };
    let Some(out) = probe.out_of_balls() else { return Penetration::UNKNOWN };
    let bounds = search(&mut probe, out, memory);
    let answer = probe.touch_at(bounds.shift);
    let evidence = match answer.verdict {
        ShapeVerdict::Separated { evidence } => evidence,
        _ => Evidence::Estimated,
    };
    let turned = |way: Vector| elements.turned(&way);
    Penetration::new(&bounds, (elements.scale(), turned), (evidence, answer.band), probe.spent)
}

impl ShapeProbe<'_, '_> {
    /// Asks whether the shape touches the scan after a shift.
    fn touch_at(&mut self, t: Vector) -> ShapeAnswer {
        self.spent.evaluations += 1;
        touch(self.elements, Some(&self.solid.shifted(&t)), None, (self.level, &mut *self.scratch))
    }

    /// Finds a shift after which the shape touches nothing.
    fn out_of_balls(&mut self) -> Option<Vector> {
        let (elements, solid) = (self.elements, self.solid);
        let bounds = elements.arrays.tree.root_box();
        let radius = f64::from(bounds.radius() + bounds.reach) + elements.beyond_boxes();
        let of_scan = (Vector::from(bounds.centre.map(f64::from)), radius);
        let own = (solid.centre, solid.half.norm() + solid.radius);
        out_of_balls([of_scan, own], elements.margin, |t| self.touch_at(t).verdict.is_separated())
    }

    /// Measures how deep the place of the scan that is nearest to another one is in the shape.
    fn deep_on_scan(&self, solid: &Solid<'_>, place: Vector) -> Option<Deep> {
        let (place, radius) = nearest_part(self.elements, &place, self.level)?;
        let (own, uphill) = solid.depth(&place).unwrap_or_else(|| {
            let way = solid.nearest(&place) - place;
            (solid.radius - way.norm(), way.try_normalize(0.0).unwrap_or_else(Vector::zeros))
        });
        let depth = self.elements.margin + radius + own;
        (depth > 0.0).then_some(Deep { place, at: Where::OnA, depth, in_a: radius, uphill })
    }

    /// Measures how deep a place is in the scan and in the shape. A place outside the shape is moved to its
    /// core.
    fn deep_in_scan(&mut self, solid: &Solid<'_>, place: Vector) -> Option<Deep> {
        let (place, (own, uphill)) = solid.deep_near(&place);
        let elements = self.elements;
        let working = (self.level, &mut self.memory.crossings, &mut *self.scratch);
        let own_in_a = depth_in(elements, &place, working)?;
        let (depth, in_a) = (own_in_a.with_ball(own + elements.margin), own_in_a.length);
        Some(Deep { place, at: Where::Inside, depth, in_a, uphill: uphill + own_in_a.uphill })
    }

    /// Breaks if the budget is spent. A test of the shape counts as an evaluation.
    fn go_on(&self) -> ControlFlow<()> {
        self.budget.go_on(self.spent.evaluations)
    }
}

impl Probe for ShapeProbe<'_, '_> {
    /// If the shape touches nothing, it is inside or outside as a whole.
    fn is_apart(&mut self, t: Vector) -> ControlFlow<(), bool> {
        self.go_on()?;
        let is_separated = self.touch_at(t).verdict.is_separated();
        let working = (self.level, &mut self.memory.crossings, &mut *self.scratch);
        let is_nested =
            is_separated && self.is_solid && is_inside(self.elements, &(self.solid.inside + t), working);
        ControlFlow::Continue(is_separated && !is_nested)
    }

    /// The direction is that of the normal of the deepest contact.
    fn touch(&mut self, t: Vector) -> ControlFlow<(), Option<(Vector, Vector)>> {
        self.go_on()?;
        self.spent.evaluations += 1;
        let SolidScratch { candidates, contacts: found, .. } = &mut *self.memory;
        let working = (self.level, &mut *self.scratch, candidates);
        contacts(self.elements, Some(&self.solid.shifted(&t)), None, found, working);
        let frame = self.elements.placed.stored_to_world();
        ControlFlow::Continue(found.first().map(|contact| {
            let normal = Vector::from(frame.rotate_inverse(contact.normal));
            (frame.apply_inverse(contact.point).into(), normal * 1.0_f64.copysign(normal.dot(&t)))
        }))
    }

    fn survey(&mut self, survey: &mut ContactSurvey) -> ControlFlow<()> {
        survey.clear();
        let _deepest = self.touch(Vector::zeros())?;
        let frame = self.elements.placed.stored_to_world();
        for contact in &self.memory.contacts {
            let normal = Vector::from(frame.rotate_inverse(contact.normal));
            let point = Vector::from(frame.apply_inverse(contact.point));
            let more = self.elements.margin;
            // A shift to the other side of the surface leads into a solid.
            let beyond = match self.is_solid {
                true => 0.0,
                false => normal.dot(&(self.solid.support(&normal) - point)) + self.solid.radius + more,
            };
            let depths = [contact.depth / frame.scale() + more, beyond];
            survey.add(Surveyed { point, normals: [normal, Vector::zeros()], depths }, 0.0);
        }
        ControlFlow::Continue(())
    }

    fn places(&self) -> &'static [Where] {
        Where::of_shape(self.is_solid)
    }

    fn deep_at(&mut self, place: Vector, t: Vector, at: Where) -> ControlFlow<(), Option<Deep>> {
        self.go_on()?;
        self.spent.evaluations += 1;
        let solid = &self.solid.shifted(&t);
        ControlFlow::Continue(match at {
            Where::OnA => self.deep_on_scan(solid, place),
            Where::Inside | Where::OnB => self.deep_in_scan(solid, place),
        })
    }

    fn across(&mut self, way: Vector, contacts: &ContactSurvey) -> ControlFlow<(), f64> {
        self.go_on()?;
        let normals = contacts.some.iter().map(|contact| contact.normals[0]);
        let ways = [way].into_iter().chain(self.solid.axes).chain(normals).flat_map(|way| [way, -way]);
        let working = (self.level, &mut self.memory.crossings, &mut *self.scratch);
        let asked = (&self.budget, &mut self.spent.evaluations);
        let found = across(self.elements, self.solid, ways, working, asked)?;
        ControlFlow::Continue(if found > 0.0 { found + self.elements.margin } else { 0.0 })
    }

    fn centres(&self) -> [Vector; 2] {
        [self.elements.arrays.tree.root_box().centre.map(f64::from).into(), self.solid.inside]
    }

    fn axes(&self) -> [[Vector; 3]; 2] {
        let of_scan = self.elements.arrays.tree.root_box().axes;
        [of_scan.map(|axis| axis.map(f64::from).into()), self.solid.axes]
    }

    fn slack(&self) -> f64 {
        SLACK * f64::from(self.elements.arrays.sampling_radius)
    }

    fn rounding(&self) -> f64 {
        1e-12 * (self.elements.far + self.solid.centre.amax() + self.solid.half.amax() + self.solid.radius)
    }
}
