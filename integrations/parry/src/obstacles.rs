//! The shapes around a character, and casts among them.

use std::fmt;

use parry3d::math::{Pose, Real, Vector};
use parry3d::query::{QueryDispatcher, Ray, ShapeCastOptions};
use parry3d::shape::Shape;

/// A shape in the way of a [`Character`](crate::Character): a scan, or any shape of parry.
#[derive(Clone, Copy)]
pub struct Obstacle<'a> {
    /// Maps the shape to the world.
    pub pose: Pose,
    /// The shape.
    pub shape: &'a dyn Shape,
}

impl fmt::Debug for Obstacle<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Obstacle").field("pose", &self.pose).field("shape", &self.shape.shape_type()).finish()
    }
}

/// A place where a moving shape, or a ray, meets an obstacle first. World coordinates.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hit {
    /// The share of the way, from 0 to 1.
    pub(crate) share: Real,
    pub(crate) point: Vector,
    /// The unit normal, away from the obstacle.
    pub(crate) normal: Vector,
}

/// All obstacles.
#[derive(Clone, Copy)]
pub(crate) struct Obstacles<'a> {
    pub(crate) list: &'a [Obstacle<'a>],
    pub(crate) dispatcher: &'a dyn QueryDispatcher,
}

impl Obstacles<'_> {
    /// The first obstacle that `shape` meets on a straight way from `at`. Pairs of shapes that the
    /// dispatcher does not support pass each other.
    pub(crate) fn cast(&self, shape: &dyn Shape, at: Vector, way: Vector) -> Option<Hit> {
        let options = ShapeCastOptions {
            max_time_of_impact: 1.0,
            target_distance: 0.0,
            stop_at_penetration: false,
            compute_impact_geometry_on_penetration: true,
        };
        let hits = self.list.iter().filter_map(|obstacle| {
            let pos12 = obstacle.pose.inv_mul(&Pose::from_translation(at));
            let way = obstacle.pose.rotation.inverse() * way;
            let hit = self.dispatcher.cast_shapes(&pos12, way, obstacle.shape, shape, options).ok()??;
            Some(Hit {
                share: hit.time_of_impact,
                point: obstacle.pose * hit.witness1,
                normal: obstacle.pose.rotation * hit.normal1,
            })
        });
        hits.min_by(|a, b| a.share.total_cmp(&b.share))
    }

    /// The gap to the nearest obstacle, if that is below `within`, and the way out. Negative in an
    /// obstacle.
    pub(crate) fn gap(&self, shape: &dyn Shape, at: Vector, within: Real) -> Option<(Real, Vector)> {
        let gaps = self.list.iter().filter_map(|obstacle| {
            let pos12 = obstacle.pose.inv_mul(&Pose::from_translation(at));
            let contact = self.dispatcher.contact(&pos12, obstacle.shape, shape, within).ok()??;
            Some((contact.dist, obstacle.pose.rotation * contact.normal1))
        });
        gaps.min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// The unit normal where a ray along `way` hits an obstacle first, on the side that it comes from.
    pub(crate) fn normal_along(&self, from: Vector, way: Vector) -> Option<Vector> {
        let ray = Ray::new(from, way);
        let hits = self.list.iter().filter_map(|it| {
            let hit = it.shape.cast_ray_and_get_normal(&it.pose, &ray, 1.0, false)?;
            Some((hit.time_of_impact, hit.normal))
        });
        let (_, normal) = hits.min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(if normal.dot(way) > 0.0 { -normal } else { normal })
    }
}
