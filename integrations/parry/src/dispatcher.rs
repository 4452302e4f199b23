//! Questions of parry about a scan and another shape, in either order.

use parry3d::math::{Pose, Real, Vector};
use parry3d::query::details::{ContactManifoldsWorkspace, NormalConstraints};
use parry3d::query::{
    ClosestPoints, Contact, ContactManifold, NonlinearRigidMotion, PersistentQueryDispatcher,
    QueryDispatcher, ShapeCastHit, ShapeCastOptions, ShapeDistance, ShapeIntersection, Unsupported,
};
use parry3d::shape::Shape;

use crate::casts::{cast, cast_turning};
use crate::convert::{to_real, to_vector};
use crate::manifolds::{Kept, Manifolds};
use crate::question::Question;

/// Answers the questions of parry about [`ScanShape`](crate::ScanShape) and any other shape, or another
/// scan, in either order. Everything else is [`Unsupported`], so that a chain asks the next dispatcher.
///
/// ```
/// use parry3d::query::{DefaultQueryDispatcher, QueryDispatcher};
///
/// let dispatcher = nearmiss_parry::ScanDispatcher.chain(DefaultQueryDispatcher);
/// ```
#[derive(Debug, Clone, Copy, Default)]
pub struct ScanDispatcher;

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
        Ok(asked.deepest(prediction)?.map(|touch| {
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

    fn cast_shapes(
        &self,
        pos12: &Pose,
        local_vel12: Vector,
        g1: &dyn Shape,
        g2: &dyn Shape,
        options: ShapeCastOptions,
    ) -> Result<Option<ShapeCastHit>, Unsupported> {
        let asked = Question::asked(pos12, g1, g2)?;
        // The motion of the other shape in the frame of the scan.
        let velocity = if asked.flipped { asked.pose.rotation * -local_vel12 } else { local_vel12 };
        let hit = cast(&asked, velocity, &options)?;
        let is_leaving = |hit: &ShapeCastHit| {
            let away = if asked.flipped { hit.normal2 } else { hit.normal1 };
            hit.time_of_impact <= 0.0 && away.dot(velocity) >= 0.0
        };
        Ok(hit.filter(|hit| options.stop_at_penetration || !is_leaving(hit)))
    }

    /// If the shapes touch at `start_time`, and
    /// `stop_at_penetration` is `false`, a ball about the centre of mass is asked for instead, with a
    /// quarter of the shape's thickness. So no shape passes through by its centre.
    fn cast_shapes_nonlinear(
        &self,
        motion1: &NonlinearRigidMotion,
        g1: &dyn Shape,
        motion2: &NonlinearRigidMotion,
        g2: &dyn Shape,
        start_time: Real,
        end_time: Real,
        stop_at_penetration: bool,
    ) -> Result<Option<ShapeCastHit>, Unsupported> {
        let [start1, start2] = [motion1, motion2].map(|motion| motion.position_at_time(start_time));
        let asked = Question::asked(&start1.inv_mul(&start2), g1, g2)?;
        let motions = if asked.flipped { [motion2, motion1] } else { [motion1, motion2] };
        cast_turning(&asked, motions, [start_time, end_time], stop_at_penetration)
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
