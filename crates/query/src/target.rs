//! A placed scan as the target of convex shapes and rays.

use nearmiss_geometry::Motion;

use crate::ask::answer::{Evidence, Reason};
use crate::ask::budget::Budget;
use crate::motion::answer::{ShapeSweep, ShapeSweepVerdict, SweepReason};
use crate::motion::solids::sweep;
use crate::pair::placed::Placed;
use crate::pair::placed_balls::is_proper;
use crate::penetration::answer::{Interior, Penetration};
use crate::penetration::shapes::penetration;
use crate::question::Scratch;
use crate::solid::answer::{ShapeAnswer, ShapeContact, ShapeDistance, ShapeVerdict};
use crate::solid::cast::{Wanted, all_hits, crossings};
use crate::solid::contacts::contacts;
use crate::solid::core::Solid;
use crate::solid::distance::distance;
use crate::solid::elements::Elements;
use crate::solid::hint::ShapeHint;
use crate::solid::plan::ShapePlan;
use crate::solid::ray::{Ray, RayAnswer, RayHit, StoredRay};
use crate::solid::ray_hits::next_hit;
use crate::solid::shape::Shape;
use crate::solid::touch::touch_shape;

/// A placed scan, with the meaning of a plan, as the target of convex [shapes](Shape) and
/// [rays](Ray).
///
/// The scan is its obstacle (`docs/theory/obstacle.md`) unless the plan says otherwise: tangent discs
/// where points sample a sheet, balls elsewhere. [`Placed::touches`] and [`Placed::nearest`] ask about
/// the points alone. Make a target once for each pose of a scan; it takes about 100 ns.
///
/// Nothing allocates once `scratch` and the outputs are warm. Deterministic.
///
/// ```
/// use nearmiss_geometry::{PointCloud, Pose};
/// use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
/// use nearmiss_query::{CollideOptions, Prepared, Ray, Scratch, Shape, ShapePlan, Target};
///
/// // A scanned floor, and a ball on it.
/// let points: Vec<[f32; 3]> =
///     (0..2500_u16).map(|i| [f32::from(i % 50) * 0.02, f32::from(i / 50) * 0.02, 0.0]).collect();
/// let floor = PointHierarchy::build(&PointCloud::from_positions(&points)?, &BuildOptions::default())?;
/// let plan = ShapePlan::new(&CollideOptions::default(), &floor)?;
/// let target = Target::new(floor.at(&Pose::IDENTITY), &plan);
/// let mut scratch = Scratch::default();
///
/// let ball = Shape::Sphere { centre: [0.503, 0.497, 0.099], radius: 0.1 };
/// assert!(target.touch(&ball, &mut scratch).verdict.is_touching());
/// let mut contacts = Vec::new();
/// target.contacts(&ball, &mut contacts, &mut scratch);
/// assert!((contacts[0].depth - 0.001).abs() < 1e-6 && contacts[0].normal[2] > 0.999);
///
/// let above = Shape::Sphere { centre: [0.5, 0.5, 0.4], radius: 0.1 };
/// let distance = target.distance(&above, f64::INFINITY, &mut scratch).expect("within reach");
/// assert!(distance.lower > 0.28 && (distance.upper - 0.3).abs() < 1e-6);
///
/// let down = Ray::new([0.2, 0.3, 1.0], [0.0, 0.0, -2.0]);
/// let hit = target.cast(&down, &mut scratch).hit.expect("the floor");
/// assert!((hit.t - 1.0).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Target<'a> {
    elements: Elements<'a>,
    is_proper: bool,
}

impl<'a> Target<'a> {
    /// A target with the meaning of `plan`.
    #[inline]
    #[must_use]
    pub fn new(scan: Placed<'a>, plan: &ShapePlan) -> Self {
        Self { elements: Elements::new(scan, plan), is_proper: is_proper(scan.stored_to_world()) }
    }

    /// The scan.
    #[must_use]
    pub fn scan(&self) -> &Placed<'a> {
        &self.elements.placed
    }

    /// Decides whether a shape touches the scan, or is within the margin of it.
    ///
    /// A shape touches a disc within 1/20 of the disc's radius, as it does as a mesh
    /// ([`MeshScanPair`](crate::MeshScanPair)). The scan is two-sided and open: a shape behind the
    /// surface, or inside a closed one, does not touch it. Contacts are certified by a measured point in
    /// the shape, by a ball, or, with [`Detail::Witness`](crate::Detail), by a point of the surface in
    /// the shape. Separations are certified by enclosures and by the volumes about points that contain
    /// the obstacle (`docs/theory/shapes.md`).
    ///
    /// Costs O(log n) for a shape of a few local radii, and in proportion to the leaves near larger ones.
    #[must_use]
    pub fn touch(&self, shape: &Shape<'_>, scratch: &mut Scratch) -> ShapeAnswer {
        if !self.is_proper {
            let verdict = ShapeVerdict::Undecided(Reason::Pose);
            return ShapeAnswer { verdict, band: f64::INFINITY };
        }
        let level = scratch.level();
        touch_shape(&self.elements, shape, (level, &mut scratch.contact.gathers[0]))
    }

    /// Bounds the distance of a shape and the scan: lower ≤ distance ≤ upper. `None` if the nearest disc
    /// or ball is further away than `within`, or if the shape or the pose is invalid.
    ///
    /// The upper bound is exact for the nearest disc or ball. The lower bound, which is proven, is at
    /// most about 0.3 local radii less before a sheet. Points about which nothing is known do not count
    /// with [`Semantics::Surface`](crate::Semantics).
    #[must_use]
    pub fn distance(&self, shape: &Shape<'_>, within: f64, scratch: &mut Scratch) -> Option<ShapeDistance> {
        let solid = self.solid(shape).filter(|_| self.is_proper);
        let level = scratch.level();
        let corners = &mut scratch.contact.gathers[0].corners;
        distance(&self.elements, solid.as_ref(), within, (level, corners))
    }

    /// Writes up to eight contacts of a shape with the scan to `out`. Clears `out` first.
    ///
    /// The first contact is the deepest, up to 0.01 local radii. The others are spread out, at least
    /// half a local radius apart. If the plan has a margin, a shape that is apart by less than the
    /// margin has contacts of negative depth.
    ///
    /// The normal of a disc points outwards if the scan is oriented, otherwise to the side of the
    /// shape's centre, or to the other side if the shape reaches four times as far behind the disc as
    /// before it. If the shape's centre is before some surfaces of an oriented scan and behind others,
    /// as at a thin plate, contacts with those that it is behind are left out. With
    /// [`Detail::Witness`](crate::Detail) each contact is moved onto the surface by one evaluation of the
    /// implicit function.
    pub fn contacts(&self, shape: &Shape<'_>, out: &mut Vec<ShapeContact>, scratch: &mut Scratch) {
        self.gather(shape, None, out, scratch);
    }

    /// Like [`Self::contacts`], with contacts that continue those of the last frame: they keep their
    /// ids, are preferred to others of equal depth, and keep the side of surfaces that are not oriented.
    pub fn contacts_hinted(
        &self,
        shape: &Shape<'_>,
        hint: &mut ShapeHint,
        out: &mut Vec<ShapeContact>,
        scratch: &mut Scratch,
    ) {
        self.gather(shape, Some(hint), out, scratch);
    }

    /// Finds the first place where a ray, or a ball that moves along it, hits the scan.
    ///
    /// Between discs, the surface continues in the cells of points that sample the inside of a sheet, so
    /// a ray does not pass between them. With [`Detail::Witness`](crate::Detail) a hit is moved to
    /// where the implicit function vanishes, which certifies it.
    #[must_use]
    pub fn cast(&self, ray: &Ray, scratch: &mut Scratch) -> RayAnswer {
        let none = RayAnswer { hit: None, evidence: Evidence::Estimated };
        let Some(stored) = self.ray(ray) else { return none };
        let (level, Scratch { contact, solid, .. }) = (scratch.level(), scratch);
        let found = &mut solid.crossings;
        let evidence = crossings(&self.elements, &stored, Wanted::First, (level, &mut *found));
        let hit = next_hit(&self.elements, &stored, (found, false), &mut 0, &mut contact.gathers[0]);
        let hit = hit.map(|(hit, _)| hit);
        RayAnswer { hit, evidence: hit.map_or(evidence, |hit| hit.evidence) }
    }

    /// Returns `true` if a ray hits anything, which is faster than finding the first place.
    #[must_use]
    pub fn is_hit(&self, ray: &Ray, scratch: &mut Scratch) -> bool {
        let Some(stored) = self.ray(ray) else { return false };
        let (level, Scratch { contact, solid, .. }) = (scratch.level(), scratch);
        let found = &mut solid.crossings;
        // Without a disc or ball, a hole between discs may still hold surface.
        let _evidence = crossings(&self.elements, &stored, Wanted::Any, (level, &mut *found));
        found.iter().any(|it| it.is_sure())
            || next_hit(&self.elements, &stored, (found, false), &mut 0, &mut contact.gathers[0]).is_some()
    }

    /// Writes all places where a ray hits the scan to `out`, the nearest first: one for each sheet that
    /// it crosses, and for each ball. Of places nearer to each other than 0.3 local radii the first
    /// counts.
    pub fn cast_all(&self, ray: &Ray, out: &mut Vec<RayHit>, scratch: &mut Scratch) {
        out.clear();
        let Some(stored) = self.ray(ray) else { return };
        let (level, Scratch { contact, solid, .. }) = (scratch.level(), scratch);
        let working = (level, &mut solid.crossings, &mut contact.gathers[0]);
        all_hits(&self.elements, &stored, working, |hit| out.push(hit));
    }

    /// Decides whether a shape keeps the margin of the plan from the scan during a whole motion, and
    /// finds the first impact otherwise. The poses of `motion` map the frame in which `shape` is given to
    /// the world.
    ///
    /// `Free` and `t_free` are proofs, as for two scans ([`Sweep`](crate::Sweep)); plans without
    /// certificates prove nothing. Where nothing is proven, contacts are looked for as far apart as the
    /// nearest disc or ball allows, and at least a quarter of a local radius of travel, or less for smaller
    /// shapes.
    ///
    /// Costs a few distance queries, more the longer the shape moves within about one local radius of
    /// the scan.
    ///
    /// ```
    /// use nearmiss_geometry::{Motion, PointCloud, Pose};
    /// use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
    /// use nearmiss_query::{CollideOptions, Prepared, Scratch, Shape, ShapePlan, ShapeSweepVerdict, Target};
    ///
    /// let points: Vec<[f32; 3]> =
    ///     (0..2500_u16).map(|i| [f32::from(i % 50) * 0.02, f32::from(i / 50) * 0.02, 0.0]).collect();
    /// let floor = PointHierarchy::build(&PointCloud::from_positions(&points)?, &BuildOptions::default())?;
    /// let plan = ShapePlan::new(&CollideOptions::default(), &floor)?;
    /// let target = Target::new(floor.at(&Pose::IDENTITY), &plan);
    ///
    /// // A ball of radius 0.1 is lowered from 1 above the floor to 1 below it.
    /// let ball = Shape::Sphere { centre: [0.0; 3], radius: 0.1 };
    /// let at = |z: f64| Pose::from_translation([0.5, 0.5, z]);
    /// let lowered = Motion::through(&[at(1.0), at(-1.0)])?;
    /// let answer = target.sweep(&ball, &lowered, &mut Scratch::default());
    /// let ShapeSweepVerdict::Impact { t_free, t_hit, .. } = answer.verdict else { panic!("they meet") };
    /// assert!(t_free <= t_hit && (t_hit - 0.45).abs() < 0.005 && t_hit - t_free < 0.02);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn sweep(&self, shape: &Shape<'_>, motion: &Motion, scratch: &mut Scratch) -> ShapeSweep {
        self.sweep_within(shape, motion, &Budget::UNLIMITED, scratch)
    }

    /// Like [`Self::sweep`], with limits on the cost. When `budget` ends the search, what has been proven up
    /// to then is told. A distance query counts as one unit of work; a contact that was found takes ten more
    /// to tell its time.
    #[must_use]
    pub fn sweep_within(
        &self,
        shape: &Shape<'_>,
        motion: &Motion,
        budget: &Budget,
        scratch: &mut Scratch,
    ) -> ShapeSweep {
        if !self.is_proper {
            let verdict = ShapeSweepVerdict::Undecided { t_free: 0.0, reason: SweepReason::Pose };
            return ShapeSweep { verdict, band: f64::INFINITY, distances: 0 };
        }
        let (level, Scratch { contact, solid, .. }) = (scratch.level(), scratch);
        let working = (level, &mut contact.gathers[0], &mut solid.candidates, &mut solid.contacts);
        sweep(&self.elements, shape, (motion, budget), working)
    }

    /// Bounds the penetration of a shape and the scan: how far the shape must at least be shifted, in any
    /// direction, to be separate from the scan. Separate means that [`touch`](Self::touch) separates them,
    /// with the margin of the plan, and that the shape is not inside the scan if that is
    /// [solid](Interior::Solid). The shift out of a hollow scan may lead to either side of a surface.
    ///
    /// Both bounds are valid whenever `budget` ends the search; a test of the shape counts as one unit of
    /// work. The upper bound comes from a shift that was tested, and is a local minimum. The lower one comes
    /// from places of the scan that are deep in the shape or, if the scan is solid, from places that are deep
    /// in both. With [`Semantics::Surface`](crate::Semantics) it is 0 for hollow scans.
    ///
    /// Costs some 200 to 500 times as much as [`touch`](Self::touch). Does not allocate once `scratch` is
    /// warm.
    ///
    /// ```
    /// use nearmiss_geometry::{PointCloud, Pose};
    /// use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
    /// use nearmiss_query::{
    ///     Budget, CollideOptions, Interior, Prepared, Scratch, Shape, ShapePlan, Target,
    /// };
    ///
    /// let points: Vec<[f32; 3]> =
    ///     (0..2500_u16).map(|i| [f32::from(i % 50) * 0.02, f32::from(i / 50) * 0.02, 0.0]).collect();
    /// let floor = PointHierarchy::build(&PointCloud::from_positions(&points)?, &BuildOptions::default())?;
    /// let plan = ShapePlan::new(&CollideOptions::default(), &floor)?;
    /// let target = Target::new(floor.at(&Pose::IDENTITY), &plan);
    ///
    /// // A box whose lower face is 0.05 below the floor.
    /// let pose = Pose::from_translation([0.5, 0.5, 0.15]);
    /// let crate_ = Shape::Box { pose, half: [0.2, 0.2, 0.2], radius: 0.0 };
    /// let scratch = &mut Scratch::default();
    /// let found = target.penetration(&crate_, Interior::Hollow, &Budget::UNLIMITED, scratch);
    /// assert!((found.lower - 0.05).abs() < 1e-6 && (found.upper - 0.05).abs() < 0.002, "{found:?}");
    /// assert!(found.direction[2] > 0.999);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn penetration(
        &self,
        shape: &Shape<'_>,
        interior: Interior,
        budget: &Budget,
        scratch: &mut Scratch,
    ) -> Penetration {
        let elements = self.elements.without_witness();
        let shape = self.solid(shape).filter(|_| self.is_proper);
        let (level, Scratch { contact, solid, penetration: own, .. }) = (scratch.level(), scratch);
        let working = (level, &mut contact.gathers[0], solid);
        penetration(&elements, shape.as_ref(), (interior, budget), working, &mut own.search)
    }

    fn solid<'s>(&'s self, shape: &Shape<'s>) -> Option<Solid<'s>> {
        Solid::new(shape, self.elements.placed.stored_to_world())
    }

    fn ray(&self, ray: &Ray) -> Option<StoredRay> {
        StoredRay::new(ray, self.elements.placed.stored_to_world()).filter(|_| self.is_proper)
    }

    fn gather(
        &self,
        shape: &Shape<'_>,
        hint: Option<&mut ShapeHint>,
        out: &mut Vec<ShapeContact>,
        scratch: &mut Scratch,
    ) {
        let shape = self.solid(shape).filter(|_| self.is_proper);
        let (level, Scratch { contact, solid, .. }) = (scratch.level(), scratch);
        let working = (level, &mut contact.gathers[0], &mut solid.candidates);
        contacts(&self.elements, shape.as_ref(), hint, out, working);
    }
}
