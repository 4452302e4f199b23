//! A placed convex shape and a placed scan.

use crate::ask::answer::Reason;
use crate::ask::budget::Budget;
use crate::pair::placed::Placed;
use crate::penetration::answer::{Interior, Penetration};
use crate::penetration::shapes::penetration;
use crate::question::Scratch;
use crate::solid::answer::{ShapeAnswer, ShapeContact, ShapeDistance, ShapeVerdict};
use crate::solid::contacts::contacts;
use crate::solid::core::Solid;
use crate::solid::distance::distance;
use crate::solid::elements::Elements;
use crate::solid::hint::ShapeHint;
use crate::solid::placed::PlacedShape;
use crate::solid::plan::ShapePlan;
use crate::solid::touch::touch;

/// A placed convex shape and a placed scan.
///
/// The questions are those of [`Target`](crate::Target), with the same answers, for a shape that is given
/// in its own frame. Answers are in world units and world coordinates. A target is faster for many shapes
/// and one scan.
///
/// ```
/// use nearmiss_geometry::{PointCloud, Pose};
/// use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
/// use nearmiss_query::{AsShape, CollideOptions, Prepared, Scratch, Shape, ShapePlan, ShapeScanPair};
///
/// let points: Vec<[f32; 3]> =
///     (0..2500_u16).map(|i| [f32::from(i % 50) * 0.02, f32::from(i / 50) * 0.02, 0.0]).collect();
/// let floor = PointHierarchy::build(&PointCloud::from_positions(&points)?, &BuildOptions::default())?;
/// let plan = ShapePlan::new(&CollideOptions::default(), &floor)?;
///
/// // A hull with its tip at the origin of its frame, at two heights above the floor.
/// let corners = [[0.0; 3], [0.2, 0.0, 0.3], [-0.2, 0.1, 0.3], [0.0, -0.2, 0.3]];
/// let hull = Shape::Hull { points: &corners, radius: 0.0 };
/// let at = |z: f64| {
///     let pose = Pose::from_translation([0.5, 0.5, z]);
///     ShapeScanPair::new(floor.at(&Pose::IDENTITY), hull.at(&pose))
/// };
/// let mut scratch = Scratch::default();
/// assert!(at(-0.05).touch(&plan, &mut scratch).verdict.is_touching());
/// let distance = at(0.2).distance(&plan, f64::INFINITY, &mut scratch).expect("there is a floor");
/// assert!(distance.lower > 0.18 && (distance.upper - 0.2).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct ShapeScanPair<'a> {
    scan: Placed<'a>,
    shape: PlacedShape<'a>,
}

impl<'a> ShapeScanPair<'a> {
    /// A pair of a scan and a shape.
    #[inline]
    #[must_use]
    pub fn new(scan: Placed<'a>, shape: PlacedShape<'a>) -> Self {
        Self { scan, shape }
    }

    /// The scan.
    #[must_use]
    pub fn scan(&self) -> &Placed<'a> {
        &self.scan
    }

    /// The shape.
    #[must_use]
    pub fn shape(&self) -> &PlacedShape<'a> {
        &self.shape
    }

    /// Decides whether the shape touches the scan, or is within the margin of it; see
    /// [`Target::touch`](crate::Target::touch).
    #[must_use]
    pub fn touch(&self, plan: &ShapePlan, scratch: &mut Scratch) -> ShapeAnswer {
        let level = scratch.level();
        let scratch = &mut scratch.contact.gathers[0];
        self.ask(plan, |elements, solid| touch(elements, solid, None, (level, scratch))).unwrap_or(INVALID)
    }

    /// Bounds the distance of the shape and the scan. `None` if the nearest disc or ball is further away
    /// than `within`, or if the shape or a pose is invalid; see
    /// [`Target::distance`](crate::Target::distance).
    #[must_use]
    pub fn distance(&self, plan: &ShapePlan, within: f64, scratch: &mut Scratch) -> Option<ShapeDistance> {
        let level = scratch.level();
        let corners = &mut scratch.contact.gathers[0].corners;
        self.ask(plan, |elements, solid| distance(elements, solid, within, (level, corners)))?
    }

    /// Writes up to eight contacts of the shape with the scan to `out`. Clears `out` first; see
    /// [`Target::contacts`](crate::Target::contacts).
    pub fn contacts(&self, plan: &ShapePlan, out: &mut Vec<ShapeContact>, scratch: &mut Scratch) {
        self.gather(plan, None, out, scratch);
    }

    /// Like [`Self::contacts`], with contacts that continue those of the last frame; see
    /// [`Target::contacts_hinted`](crate::Target::contacts_hinted).
    pub fn contacts_hinted(
        &self,
        plan: &ShapePlan,
        hint: &mut ShapeHint,
        out: &mut Vec<ShapeContact>,
        scratch: &mut Scratch,
    ) {
        self.gather(plan, Some(hint), out, scratch);
    }

    /// Bounds the penetration of the shape: how far it must at least be shifted to touch nothing; see
    /// [`Target::penetration`](crate::Target::penetration).
    #[must_use]
    pub fn penetration(
        &self,
        plan: &ShapePlan,
        interior: Interior,
        budget: &Budget,
        scratch: &mut Scratch,
    ) -> Penetration {
        let (level, Scratch { contact, solid: own, penetration: memory, .. }) = (scratch.level(), scratch);
        let working = (level, &mut contact.gathers[0], own);
        let found = self.ask(plan, |elements, solid| {
            let elements = elements.without_witness();
            penetration(&elements, solid, (interior, budget), working, &mut memory.search)
        });
        found.unwrap_or(Penetration::UNKNOWN)
    }

    fn gather(
        &self,
        plan: &ShapePlan,
        hint: Option<&mut ShapeHint>,
        out: &mut Vec<ShapeContact>,
        scratch: &mut Scratch,
    ) {
        out.clear();
        let (level, Scratch { contact, solid: own, .. }) = (scratch.level(), scratch);
        let working = (level, &mut contact.gathers[0], &mut own.candidates);
        self.ask(plan, |elements, solid| contacts(elements, solid, hint, out, working));
    }

    /// Calls `ask` with the scan and with the shape in the stored frame of the scan, `None` if the shape
    /// is invalid. Does nothing if a pose is invalid.
    fn ask<R>(
        &self,
        plan: &ShapePlan,
        ask: impl FnOnce(&Elements<'_>, Option<&Solid<'_>>) -> R,
    ) -> Option<R> {
        let frame = self.shape.frame_of(self.scan.stored_to_world())?;
        Some(ask(&Elements::new(self.scan, plan), Solid::new(self.shape.shape(), &frame).as_ref()))
    }
}

/// The answer for an invalid pose.
const INVALID: ShapeAnswer =
    ShapeAnswer { verdict: ShapeVerdict::Undecided(Reason::Pose), band: f64::INFINITY };
