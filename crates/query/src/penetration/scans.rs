//! The penetration of two scans.

use std::ops::ControlFlow;

use crate::ask::answer::{Answer, Contacts, Evidence, Reason, Statistics, Verdict};
use crate::ask::budget::Budget;
use crate::ask::options::{CollidePlan, Semantics};
use crate::contact::collide::{Asked, ContactScratch, Outputs, collide};
use crate::pair::placed::Placed;
use crate::pair::placed_balls::is_proper;
use crate::penetration::answer::{Interior, Penetration};
use crate::penetration::apart::out_of_balls;
use crate::penetration::interior::{
    Depth, TESTED, contains, counts, some_points, world_axes, world_ball, world_depth_in, world_nearest_part,
};
use crate::penetration::probe::{Deep, Probe, SLACK, Vector, Where};
use crate::penetration::search::{SearchScratch, search};
use crate::penetration::survey::{ContactSurvey, way_out};
use crate::solid::crossing::Crossing;
use crate::solid::elements::Elements;
use crate::solid::plan::ShapePlan;

/// Reusable memory.
#[derive(Debug, Clone, Default)]
pub(crate) struct PenetrationScratch {
    pub(crate) search: SearchScratch,
    pub(crate) contacts: Contacts,
}

/// Two placed scans, or parts of them, and the cost of all tests so far. Shifts are those of b, in the world.
struct ScanProbe<'s> {
    scans: [Placed<'s>; 2],
    elements: [Elements<'s>; 2],
    /// The whole scans, whose surfaces enclose the solids.
    wholes: [Elements<'s>; 2],
    points: [[Vector; TESTED]; 2],
    /// `true` for scans whose inside counts.
    solid: [bool; 2],
    plan: CollidePlan,
    budget: Budget,
    contact: &'s mut ContactScratch,
    crossings: &'s mut Vec<Crossing>,
    contacts: &'s mut Contacts,
    spent: Statistics,
}

/// A scan or a part of one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Piece<'s> {
    pub(crate) part: Placed<'s>,
    /// The whole scan, whose surface encloses the solid.
    pub(crate) whole: Placed<'s>,
}

impl<'s> Piece<'s> {
    pub(crate) fn whole(scan: &Placed<'s>) -> Self {
        Self { part: *scan, whole: *scan }
    }
}

/// Bounds the penetration of two scans.
pub(crate) fn penetration<'s>(
    scans: [&Placed<'s>; 2],
    (plan, interiors): (&CollidePlan, [Interior; 2]),
    budget: &Budget,
    (contact, crossings): (&'s mut ContactScratch, &'s mut Vec<Crossing>),
    scratch: &'s mut PenetrationScratch,
) -> Penetration {
    of_pieces(scans.map(Piece::whole), (plan, interiors), budget, (contact, crossings), scratch)
}

/// Bounds the penetration of two scans or parts of scans.
pub(crate) fn of_pieces<'s>(
    pieces: [Piece<'s>; 2],
    (plan, interiors): (&CollidePlan, [Interior; 2]),
    budget: &Budget,
    (contact, crossings): (&'s mut ContactScratch, &'s mut Vec<Crossing>),
    scratch: &'s mut PenetrationScratch,
) -> Penetration {
    let scans = pieces.map(|piece| piece.part);
    if !scans.iter().all(|scan| is_proper(scan.stored_to_world())) {
        return Penetration::UNKNOWN;
    }
    let of_shapes = ShapePlan::of_pair(plan.options());
    let elements = scans.map(|scan| Elements::new(scan, &of_shapes));
    let wholes = pieces.map(|piece| Elements::new(piece.whole, &of_shapes));
    let solid = [0, 1].map(|k: usize| counts(&elements[k], interiors[k]));
    let PenetrationScratch { search: memory, contacts } = scratch;
    let mut probe = ScanProbe {
        scans,
        elements,
        wholes,
        points: scans.each_ref().map(some_points),
        solid,
        plan: plan.of_verdicts(),
        budget: Budget { resolution: None, ..*budget },
        contact,
        crossings,
        contacts,
        spent: Statistics::default(),
    };
    let Some(out) = probe.out_of_balls() else { return Penetration::UNKNOWN };
    let bounds = search(&mut probe, out, memory);
    let answer = probe.collide_with(bounds.shift, plan, Outputs::default(), &Budget::UNLIMITED);
    let evidence = match answer.verdict {
        Verdict::Separated { evidence, .. } => evidence,
        _ => Evidence::Estimated,
    };
    Penetration::new(&bounds, (1.0, |way| way.into()), (evidence, answer.band), probe.spent)
}

impl ScanProbe<'_> {
    /// Asks whether the scans meet after a shift.
    fn collide_with(
        &mut self,
        t: Vector,
        plan: &CollidePlan,
        outputs: Outputs<'_>,
        budget: &Budget,
    ) -> Answer {
        let [a, b] = &self.scans;
        let b = b.shifted(t.into());
        let asked = Asked { scans: [a, &b], plan, budget };
        let answer = collide(asked, self.contact, outputs);
        self.spent.add(&answer.statistics);
        answer
    }

    /// Asks whether the scans meet after a shift. Breaks if the budget is spent.
    fn collide(&mut self, t: Vector, outputs: Outputs<'_>) -> ControlFlow<(), Answer> {
        let (plan, budget) = (self.plan, self.budget.less(self.spent.work()));
        let answer = self.collide_with(t, &plan, outputs, &budget);
        match answer.verdict {
            Verdict::Undecided(Reason::Budget { .. }) => ControlFlow::Break(()),
            _ => ControlFlow::Continue(answer),
        }
    }

    /// Finds a shift after which the scans are apart.
    fn out_of_balls(&mut self) -> Option<Vector> {
        let (balls, plan) = (self.elements.each_ref().map(world_ball), self.plan);
        out_of_balls(balls, plan.options().margin, |t| {
            let answer = self.collide_with(t, &plan, Outputs::default(), &Budget::UNLIMITED);
            // A part may be inside the solid even far from the other part.
            answer.verdict.is_separated() && !self.is_nested(t)
        })
    }

    /// Returns `true` if a part of the other scan is inside the solid of scan `k` after a shift.
    ///
    /// If the surfaces do not meet, each part of a scan is inside or outside as a whole.
    fn has_part_inside(&mut self, k: usize, t: Vector) -> bool {
        let shift = if k == 0 { t } else { -t };
        self.points[1 - k].iter().any(|place| {
            self.spent.evaluations += 1;
            let working = (self.contact.level, &mut *self.crossings, &mut self.contact.gathers[k]);
            contains(&self.wholes[k], &(place + shift), working)
        })
    }

    /// Returns `true` if something is inside a solid after a shift that separates the surfaces.
    fn is_nested(&mut self, t: Vector) -> bool {
        (0..2).any(|k| self.solid[k] && self.has_part_inside(k, t))
    }

    /// Breaks if the budget is spent.
    fn go_on(&self) -> ControlFlow<()> {
        self.budget.go_on(self.spent.work())
    }

    /// Measures how deep a place is in both scans. It is moved to the nearest place of the surface that it is
    /// to be on.
    fn measured(&mut self, place: Vector, t: Vector, at: Where) -> Option<Deep> {
        let (shifts, is_inside) = ([Vector::zeros(), t], at.is_inside());
        let margin = self.plan.options().margin;
        let mut found = Deep { place, at, depth: margin, in_a: 0.0, uphill: Vector::zeros() };
        for k in (0..2).filter(|&k| !is_inside[k]) {
            let (point, radius) =
                world_nearest_part(&self.elements[k], &(found.place - shifts[k]), self.contact.level)?;
            found.place = point + shifts[k];
            found.depth += radius;
            found.in_a += if k == 0 { radius } else { 0.0 };
        }
        let mut other: Option<Depth> = None;
        for k in (0..2).filter(|&k| is_inside[k]) {
            let working = (self.contact.level, &mut *self.crossings, &mut self.contact.gathers[k]);
            let own = world_depth_in(&self.wholes[k], &(found.place - shifts[k]), working)?;
            // The depth so far is the radius of a ball in the other scan, which has holes as well.
            found.depth = match other {
                None => own.with_ball(found.depth),
                Some(other) => own.with_ball(other.length + margin).min(other.with_ball(own.length + margin)),
            };
            other = Some(own);
            found.in_a += if k == 0 { own.length } else { 0.0 };
            found.uphill += own.uphill;
        }
        Some(found)
    }

    /// The greatest shift under which two balls of thickened points stay in contact, from the residual of
    /// their contact; 0 for surfaces.
    fn depth_of(&self, residual: f64) -> f64 {
        match self.plan.options().semantics {
            Semantics::Thickened(_) => self.plan.reach() - 2.0 * residual,
            _ => 0.0,
        }
    }
}

impl Probe for ScanProbe<'_> {
    fn is_apart(&mut self, t: Vector) -> ControlFlow<(), bool> {
        let answer = self.collide(t, Outputs::default())?;
        ControlFlow::Continue(answer.verdict.is_separated() && !self.is_nested(t))
    }

    /// The direction is that of the normal that is nearest to the shift.
    fn touch(&mut self, t: Vector) -> ControlFlow<(), Option<(Vector, Vector)>> {
        let Verdict::Intersecting { contact, .. } = self.collide(t, Outputs::default())?.verdict else {
            return ControlFlow::Continue(None);
        };
        ControlFlow::Continue(Some((contact.point.into(), way_out(&contact, t))))
    }

    fn survey(&mut self, survey: &mut ContactSurvey) -> ControlFlow<()> {
        survey.clear();
        let mut contacts = std::mem::take(self.contacts);
        let outputs = Outputs { contacts: Some(&mut contacts), ..Outputs::default() };
        let flow = self.collide(Vector::zeros(), outputs);
        survey.add_all(&contacts, |residual| self.depth_of(residual));
        let is_cut_short = !contacts.complete && self.budget.may_end();
        *self.contacts = contacts;
        flow?;
        if is_cut_short { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn places(&self) -> &'static [Where] {
        Where::of(self.solid)
    }

    fn deep_at(&mut self, place: Vector, t: Vector, at: Where) -> ControlFlow<(), Option<Deep>> {
        self.go_on()?;
        self.spent.evaluations += 1;
        ControlFlow::Continue(self.measured(place, t, at))
    }

    fn centres(&self) -> [Vector; 2] {
        self.elements.each_ref().map(|elements| world_ball(elements).0)
    }

    fn axes(&self) -> [[Vector; 3]; 2] {
        self.elements.each_ref().map(world_axes)
    }

    fn slack(&self) -> f64 {
        SLACK * self.scans.iter().map(Placed::sampling_radius).fold(0.0, f64::max)
    }

    fn rounding(&self) -> f64 {
        let far = self.elements.each_ref().map(|elements| {
            let (centre, radius) = world_ball(elements);
            centre.amax() + radius
        });
        1e-12 * (far[0] + far[1])
    }
}
