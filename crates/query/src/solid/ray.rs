//! Rays, and where they hit a scan.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_geometry::{PointId, Pose};
use serde::{Deserialize, Serialize};

use crate::ask::answer::Evidence;

/// A ray in world coordinates, or the path of a ball along one. A ray whose direction has no length,
/// with a number that is NaN, or with a negative length hits nothing. Neither does a ray from so far away
/// that rounding moves it by a thousandth of a sampling radius: some 10¹¹ of these radii.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Ray {
    /// The start.
    pub origin: [f64; 3],
    /// The direction, of any length above zero.
    pub direction: [f64; 3],
    /// The length of the ray. Infinite by default.
    pub max: f64,
    /// The radius of the ball that moves along the ray. Zero by default.
    pub radius: f64,
}

impl Ray {
    /// A ray without end and without thickness.
    #[must_use]
    pub const fn new(origin: [f64; 3], direction: [f64; 3]) -> Self {
        Self { origin, direction, max: f64::INFINITY, radius: 0.0 }
    }

    /// The same ray with an end, `max` from the origin.
    #[must_use]
    pub const fn with_max(self, max: f64) -> Self {
        Self { max, ..self }
    }

    /// The path of a ball of this radius along the same ray.
    #[must_use]
    pub const fn with_radius(self, radius: f64) -> Self {
        Self { radius, ..self }
    }
}

/// A place where a ray hits a scan, in the world.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RayHit {
    /// The distance from the origin, or how far a ball moves until it touches.
    pub t: f64,
    /// The place on the surface.
    pub point: [f64; 3],
    /// The unit normal there: outwards if the scan is oriented, otherwise to the side that the ray
    /// comes from. For a ball that touches before it moves, to the side of its centre.
    pub normal: [f64; 3],
    /// The measured point whose disc or ball is hit, as the caller numbered it.
    pub source: PointId,
    /// Certified: the place was verified to be on the surface, or belongs to a ball. Estimated: it
    /// belongs to a tangent disc.
    pub evidence: Evidence,
}

/// The first hit of a ray.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RayAnswer {
    /// The hit; `None` if the ray hits nothing.
    pub hit: Option<RayHit>,
    /// The evidence of the hit, or of there being none. Certified: the ray passes outside all volumes
    /// that contain the obstacle.
    pub evidence: Evidence,
}

/// A ray in the stored frame of a scan.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StoredRay {
    pub(crate) origin: Vector3<f64>,
    /// A unit vector.
    pub(crate) direction: Vector3<f64>,
    pub(crate) max: f64,
    pub(crate) radius: f64,
}

impl StoredRay {
    /// Moves a ray into a stored frame with this pose. `None` if the ray is invalid.
    pub(crate) fn new(ray: &Ray, placed: &Pose) -> Option<Self> {
        let origin = Vector3::from(placed.apply_inverse(ray.origin));
        let way = Vector3::from(placed.rotate_inverse(ray.direction));
        let longest = way.amax();
        // The length of a very short or long direction is out of range.
        let direction = (longest > 0.0 && longest.is_finite()).then(|| (way / longest).normalize())?;
        let (max, radius) = (ray.max / placed.scale(), ray.radius / placed.scale());
        let is_valid = origin.iter().chain(&direction).all(|c| c.is_finite())
            && max >= 0.0
            && radius >= 0.0
            && radius.is_finite();
        is_valid.then_some(Self { origin, direction, max, radius })
    }

    /// The place at distance `t`.
    pub(crate) fn at(&self, t: f64) -> Vector3<f64> {
        self.origin + self.direction * t
    }
}
