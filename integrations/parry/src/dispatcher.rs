//! Questions of parry about a scan and another shape, in either order.

use std::any::Any;
use std::cell::RefCell;

use parry3d::math::{Pose, Real, Vector};
use parry3d::query::details::{ContactManifoldsWorkspace, NormalConstraints};
use parry3d::query::{
    ClosestPoints, Contact, ContactManifold, NonlinearRigidMotion, PersistentQueryDispatcher,
    QueryDispatcher, ShapeCastHit, ShapeCastOptions, ShapeCastStatus, ShapeDistance, ShapeIntersection,
    Unsupported,
};
use parry3d::shape::Shape;

use nearmiss::{DistanceOptions, DistancePlan, ManifoldPoint, Pair, Ray, ShapeContact};

use crate::convert::{from_pose, from_vector, to_real, to_vector};
use crate::manifolds::{Kept, Manifolds, Touch, deepest};
use crate::parts::for_parts;
use crate::scan_shape::{ScanShape, with_scratch};

thread_local! {
    static TOUCHES: RefCell<Vec<Touch>> = RefCell::default();
    static CONTACTS: RefCell<Vec<ShapeContact>> = RefCell::default();
    static POINTS: RefCell<Vec<ManifoldPoint>> = RefCell::default();
}

/// Answers the questions of parry about [`ScanShape`] and any other shape, or another scan, in either
/// order. Everything else is [`Unsupported`], so that a chain asks the next dispatcher.
///
/// ```
/// use parry3d::query::{DefaultQueryDispatcher, QueryDispatcher};
///
/// let dispatcher = nearmiss_parry::ScanDispatcher.chain(DefaultQueryDispatcher);
/// ```
#[derive(Debug, Clone, Copy, Default)]
pub struct ScanDispatcher;

/// A distance, and the nearest points of the scan and of the other shape, in the frame of the scan.
type Nearest = (f64, [[f64; 3]; 2]);

/// A scan and another shape.
struct Question<'a> {
    scan: &'a ScanShape,
    other: &'a dyn Shape,
    /// Maps the other shape to the frame of the scan.
    pose: Pose,
    /// `true` if the scan is the second shape.
    flipped: bool,
}

fn scan_of(shape: &dyn Shape) -> Option<&ScanShape> {
    let any: &dyn Any = shape;
    any.downcast_ref()
}

impl<'a> Question<'a> {
    /// `None` if neither shape is a scan. Of two scans, the first is the scan of the question.
    fn new(pos12: &Pose, g1: &'a dyn Shape, g2: &'a dyn Shape) -> Option<Self> {
        if let Some(scan) = scan_of(g1) {
            return Some(Self { scan, other: g2, pose: *pos12, flipped: false });
        }
        let scan = scan_of(g2)?;
        Some(Self { scan, other: g1, pose: pos12.inverse(), flipped: true })
    }

    fn asked(pos12: &Pose, g1: &'a dyn Shape, g2: &'a dyn Shape) -> Result<Self, Unsupported> {
        Self::new(pos12, g1, g2).ok_or(Unsupported)
    }

    /// Both scans, the second in the frame of the first.
    fn pair(&self) -> Option<(&'a ScanShape, Pair<'a>)> {
        let other = scan_of(self.other)?;
        let placed = from_pose(&self.pose).after(other.pose());
        let pair = Pair::new(self.scan.scan().at(self.scan.pose()), other.scan().at(&placed));
        Some((other, pair))
    }

    /// A place on the other shape, in its frame.
    fn on_other(&self, place: [f64; 3]) -> Vector {
        to_vector(from_pose(&self.pose).apply_inverse(place))
    }

    /// Puts what belongs to the scan and to the other shape into the order of the caller.
    fn ordered<T>(&self, of_scan: T, of_other: T) -> (T, T) {
        if self.flipped { (of_other, of_scan) } else { (of_scan, of_other) }
    }

    fn touches(&self) -> Result<bool, Unsupported> {
        if let Some((other, pair)) = self.pair() {
            let plan = self.scan.pair_plan(other, 0.0).ok_or(Unsupported)?;
            return Ok(with_scratch(|scratch| pair.collide(&plan, scratch)).verdict.is_intersecting());
        }
        let target = self.scan.target();
        let mut found = false;
        for_parts(self.scan, self.other, &self.pose, Some(0.0), &mut |part| {
            found = found || with_scratch(|scratch| target.touch(part.shape, scratch)).verdict.is_touching();
        })?;
        Ok(found)
    }

    /// The distance and the nearest points, if they are nearer than `within`.
    fn nearest(&self, within: Real) -> Result<Option<Nearest>, Unsupported> {
        if let Some((other, pair)) = self.pair() {
            let plan = DistancePlan::new(&DistanceOptions::default(), self.scan.scan(), other.scan());
            let plan = plan.or(Err(Unsupported))?;
            let found = with_scratch(|scratch| pair.distance(&plan, scratch));
            return Ok((found.upper <= f64::from(within)).then_some((found.upper, found.points)));
        }
        let target = self.scan.target();
        let mut best = None;
        let mut within = f64::from(within);
        for_parts(self.scan, self.other, &self.pose, None, &mut |part| {
            if let Some(found) = with_scratch(|scratch| target.distance(part.shape, within, scratch)) {
                within = found.upper;
                best = Some((found.upper, found.points));
            }
        })?;
        Ok(best)
    }

    /// Calls `visit` with all contacts within `margin`: the part of the other shape, its pose there,
    /// and the contact.
    fn contacts(
        &self,
        margin: Real,
        mut kept: Option<&mut Kept>,
        visit: &mut dyn FnMut(u32, Option<Pose>, &Touch),
    ) -> Result<(), Unsupported> {
        if let Some((other, pair)) = self.pair() {
            let plan = self.scan.pair_plan(other, margin).ok_or(Unsupported)?;
            let mut points = POINTS.take();
            points.clear();
            let question = pair.manifold(&mut points);
            with_scratch(|scratch| match kept {
                Some(kept) => question.hinted(&mut kept.pair).collide(&plan, scratch),
                None => question.collide(&plan, scratch),
            });
            points.iter().for_each(|point| visit(0, None, &point.into()));
            POINTS.set(points);
            return Ok(());
        }
        let target = self.scan.target_within(margin);
        let mut contacts = CONTACTS.take();
        let asked = for_parts(self.scan, self.other, &self.pose, Some(margin), &mut |part| {
            let mut fresh = Kept::default();
            let hint = kept.as_deref_mut().unwrap_or(&mut fresh).hint(part.id, part.centre);
            with_scratch(|scratch| target.contacts_hinted(part.shape, hint, &mut contacts, scratch));
            contacts.iter().for_each(|contact| visit(part.id, part.pose, &contact.into()));
        });
        CONTACTS.set(contacts);
        asked
    }
}

impl QueryDispatcher for ScanDispatcher {
    fn intersection_test(
        &self,
        pos12: &Pose,
        g1: &dyn Shape,
        g2: &dyn Shape,
    ) -> Result<ShapeIntersection, Unsupported> {
        Question::asked(pos12, g1, g2)?.touches().map(ShapeIntersection::new)
    }

    fn distance(&self, pos12: &Pose, g1: &dyn Shape, g2: &dyn Shape) -> Result<ShapeDistance, Unsupported> {
        let found = Question::asked(pos12, g1, g2)?.nearest(Real::MAX)?;
        Ok(ShapeDistance::new(found.map_or(Real::MAX, |(distance, _)| to_real(distance))))
    }

    fn contact(
        &self,
        pos12: &Pose,
        g1: &dyn Shape,
        g2: &dyn Shape,
        prediction: Real,
    ) -> Result<Option<Contact>, Unsupported> {
        let asked = Question::asked(pos12, g1, g2)?;
        let mut touches = TOUCHES.take();
        touches.clear();
        let searched = asked.contacts(prediction, None, &mut |_, _, touch| touches.push(*touch));
        let found = deepest(touches.iter().copied(), prediction);
        TOUCHES.set(touches);
        searched?;
        Ok(found.map(|touch| {
            let normal = to_vector(touch.normal);
            let away = asked.pose.rotation.inverse() * -normal;
            let points = asked.ordered(to_vector(touch.points[0]), asked.on_other(touch.points[1]));
            let normals = asked.ordered(normal, away);
            Contact::new(points.0, points.1, normals.0, normals.1, to_real(touch.gap))
        }))
    }

    fn closest_points(
        &self,
        pos12: &Pose,
        g1: &dyn Shape,
        g2: &dyn Shape,
        max_dist: Real,
    ) -> Result<ClosestPoints, Unsupported> {
        let asked = Question::asked(pos12, g1, g2)?;
        Ok(match asked.nearest(max_dist)? {
            None => ClosestPoints::Disjoint,
            Some((distance, _)) if distance <= 0.0 => ClosestPoints::Intersecting,
            Some((_, [on_scan, on_other])) => {
                let (p1, p2) = asked.ordered(to_vector(on_scan), asked.on_other(on_other));
                ClosestPoints::WithinMargin(p1, p2)
            }
        })
    }

    /// Supported for balls.
    fn cast_shapes(
        &self,
        pos12: &Pose,
        local_vel12: Vector,
        g1: &dyn Shape,
        g2: &dyn Shape,
        options: ShapeCastOptions,
    ) -> Result<Option<ShapeCastHit>, Unsupported> {
        let asked = Question::asked(pos12, g1, g2)?;
        let ball = asked.other.as_ball().ok_or(Unsupported)?;
        // The motion of the ball in the frame of the scan.
        let velocity = if asked.flipped { asked.pose.rotation * -local_vel12 } else { local_vel12 };
        let speed = f64::from(velocity.length());
        let radius = f64::from(ball.radius + options.target_distance);
        let ray = Ray::new(from_vector(asked.pose.translation), from_vector(velocity))
            .with_max(f64::from(options.max_time_of_impact) * speed)
            .with_radius(radius);
        let hit = with_scratch(|scratch| asked.scan.target().cast(&ray, scratch).hit);
        Ok(hit.map(|hit| {
            let normal = to_vector(hit.normal);
            let away = asked.pose.rotation.inverse() * -normal;
            let (normal1, normal2) = asked.ordered(normal, away);
            let (witness1, witness2) = asked.ordered(to_vector(hit.point), away * ball.radius);
            let status = if hit.t > 0.0 {
                ShapeCastStatus::Converged
            } else {
                ShapeCastStatus::PenetratingOrWithinTargetDist
            };
            let time_of_impact = if speed > 0.0 { to_real(hit.t / speed) } else { 0.0 };
            ShapeCastHit {
                time_of_impact,
                witness1,
                witness2,
                normal1,
                normal2,
                status,
                subshape1: 0,
                subshape2: 0,
            }
        }))
    }

    /// Not supported.
    fn cast_shapes_nonlinear(
        &self,
        _motion1: &NonlinearRigidMotion,
        _g1: &dyn Shape,
        _motion2: &NonlinearRigidMotion,
        _g2: &dyn Shape,
        _start_time: Real,
        _end_time: Real,
        _stop_at_penetration: bool,
    ) -> Result<Option<ShapeCastHit>, Unsupported> {
        Err(Unsupported)
    }
}

impl<M, C> PersistentQueryDispatcher<M, C> for ScanDispatcher
where
    M: Default + Clone,
    C: Default + Copy,
{
    fn contact_manifolds(
        &self,
        pos12: &Pose,
        g1: &dyn Shape,
        g2: &dyn Shape,
        prediction: Real,
        manifolds: &mut Vec<ContactManifold<M, C>>,
        workspace: &mut Option<ContactManifoldsWorkspace>,
    ) -> Result<(), Unsupported> {
        let asked = Question::asked(pos12, g1, g2)?;
        let kept = Kept::of(workspace).ok_or(Unsupported)?;
        kept.begin();
        let mut written = Manifolds::new(manifolds, &asked.pose, asked.flipped);
        asked.contacts(prediction, Some(kept), &mut |part, pose, touch| written.push(part, pose, touch))?;
        written.finish();
        kept.end();
        Ok(())
    }

    /// Not supported: a scan is not convex, and needs more than one manifold.
    fn contact_manifold_convex_convex(
        &self,
        _pos12: &Pose,
        _g1: &dyn Shape,
        _g2: &dyn Shape,
        _normal_constraints1: Option<&dyn NormalConstraints>,
        _normal_constraints2: Option<&dyn NormalConstraints>,
        _prediction: Real,
        _manifold: &mut ContactManifold<M, C>,
    ) -> Result<(), Unsupported> {
        Err(Unsupported)
    }
}
