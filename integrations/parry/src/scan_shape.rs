//! A scan as a shape of parry.

use std::cell::RefCell;
use std::sync::Arc;

use parry3d::bounding_volume::{Aabb, BoundingSphere, BoundingVolume as _};
use parry3d::mass_properties::MassProperties;
use parry3d::math::{Real, Vector};
use parry3d::query::{PointProjection, PointQuery, Ray as ParryRay, RayCast, RayIntersection};
use parry3d::shape::{FeatureId, Shape as ParryShape, ShapeType, SharedShape, TypedShape};

use nearmiss::{
    CollideOptions, CollidePlan, PlanError, Pose, Ray, Scan, Scratch, Semantics, Shape, ShapePlan, Target,
};

use crate::convert::{from_vector, to_real, to_vector};
use crate::mass::Mass;

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

/// Calls `ask` with this thread's working memory. It allocates nothing once warm.
pub(crate) fn with_scratch<R>(ask: impl FnOnce(&mut Scratch) -> R) -> R {
    SCRATCH.with(|scratch| match scratch.try_borrow_mut() {
        Ok(mut scratch) => ask(&mut scratch),
        // A support map of the caller's own asks about another scan.
        Err(_) => ask(&mut Scratch::default()),
    })
}

/// A scan as a [`Shape`](ParryShape) of parry, for [`ScanDispatcher`](crate::ScanDispatcher). Cloning
/// it costs a reference count.
///
/// The shape is the obstacle of the scan: the surface between its points, which has two sides and no
/// inside, and balls where points sample no surface. parry computes in single precision; place a scan
/// with large coordinates by [`Self::placed`].
#[derive(Debug, Clone)]
pub struct ScanShape(Arc<Inner>);

#[derive(Debug, Clone)]
struct Inner {
    scan: Scan,
    options: CollideOptions,
    plan: ShapePlan,
    /// Maps the scan to the frame of the shape.
    pose: Pose,
    bounds: Aabb,
    /// In the frame of the shape.
    mass: Mass,
}

impl ScanShape {
    /// The surface of a scan, estimated between its points, as physics needs it: contacts are on the
    /// tangent discs, and no separation is proven.
    ///
    /// # Errors
    /// If the scan's metric does not serve collisions with shapes.
    pub fn new(scan: Scan) -> Result<Self, PlanError> {
        Self::with_options(scan, &CollideOptions::estimated().with_detail(nearmiss::Detail::Verdict))
    }

    /// The scan with the meaning and the accuracy of these options. Their margin is ignored.
    ///
    /// # Errors
    /// If an option is out of range, or not for shapes. The error names it.
    pub fn with_options(scan: Scan, options: &CollideOptions) -> Result<Self, PlanError> {
        let plan = ShapePlan::new(options, &scan)?;
        CollidePlan::new(options, &scan, &scan)?;
        let bounds = bounds(&scan, &Pose::IDENTITY, options);
        let mass = Mass::default();
        Ok(Self(Arc::new(Inner { scan, options: *options, plan, pose: Pose::IDENTITY, bounds, mass })))
    }

    /// The same shape with its scan placed in the frame of the shape, for example to move the
    /// coordinates of a survey near zero, or to scale it. The pose replaces the one before.
    ///
    /// Mass properties move and scale with the scan: `shape.solid()?.placed(&pose)` has those of
    /// `shape.placed(&pose).solid()?`.
    #[must_use]
    pub fn placed(self, pose: &Pose) -> Self {
        let bounds = bounds(&self.0.scan, pose, &self.0.options);
        let mass = self.0.mass.moved(&pose.after(&self.0.pose.inverse()));
        Self(Arc::new(Inner { pose: *pose, bounds, mass, ..Arc::unwrap_or_clone(self.0) }))
    }

    /// The same shape with the mass properties of the solid that the scan encloses
    /// ([`Target::moments`] with 64 lines: some 50 ms). `None` if it encloses none, or if
    /// the volumes by lines along the three axes differ by more than a twentieth, because of a hole.
    #[must_use]
    pub fn solid(self) -> Option<Self> {
        /// Lines along each of two axes.
        const LINES: u16 = 64;
        /// The greatest difference between volumes by lines along one axis.
        const SPREAD: f64 = 0.05;
        let moments = with_scratch(|scratch| self.target().moments(LINES, scratch))?;
        (moments.spread <= SPREAD).then(|| self.weighing(Mass::of(&moments)))
    }

    /// The same shape with the mass properties of a solid of density one, in the frame of the shape.
    /// A scan is a surface; without this call or [`Self::solid`] it has no mass.
    #[must_use]
    pub fn with_mass(self, of_density_one: MassProperties) -> Self {
        self.weighing(of_density_one.into())
    }

    fn weighing(self, mass: Mass) -> Self {
        Self(Arc::new(Inner { mass, ..Arc::unwrap_or_clone(self.0) }))
    }

    /// The scan.
    #[must_use]
    pub fn scan(&self) -> &Scan {
        &self.0.scan
    }

    /// The shape behind a reference count, as colliders of rapier hold it.
    #[must_use]
    pub fn shared(self) -> SharedShape {
        SharedShape::new(self)
    }

    /// Box around the obstacle, in the frame of the shape.
    pub(crate) fn bounds(&self) -> &Aabb {
        &self.0.bounds
    }

    /// Maps the scan to the frame of the shape.
    pub(crate) fn pose(&self) -> &Pose {
        &self.0.pose
    }

    /// The part of the scan that counts.
    pub(crate) fn semantics(&self) -> Semantics {
        self.0.options.semantics
    }

    pub(crate) fn target(&self) -> Target<'_> {
        Target::new(self.0.scan.at(&self.0.pose), &self.0.plan)
    }

    /// The scan for questions that count what is within `margin`, which may be any number.
    pub(crate) fn target_within(&self, margin: Real) -> Target<'_> {
        let options = self.0.options.with_margin(f64::from(margin).max(0.0));
        let plan = ShapePlan::new(&options, &self.0.scan).unwrap_or(self.0.plan);
        Target::new(self.0.scan.at(&self.0.pose), &plan)
    }

    /// Options for this scan and another one. `None` if they cannot be compared.
    pub(crate) fn pair_plan(&self, other: &Self, margin: Real) -> Option<CollidePlan> {
        let options = self.0.options.with_margin(f64::from(margin).max(0.0));
        CollidePlan::new(&options, &self.0.scan, &other.0.scan).ok()
    }
}

/// Box around all discs and balls of a scan, in the frame into which `pose` maps it.
fn bounds(scan: &Scan, pose: &Pose, options: &CollideOptions) -> Aabb {
    let growth = to_real(options.semantics.growth());
    match scan.at(pose).bounds() {
        Some(bounds) => Aabb::new(to_vector(bounds.min), to_vector(bounds.max)).loosened(growth),
        // A pose out of range: the shape touches nothing.
        None => Aabb::new_invalid(),
    }
}

impl RayCast for ScanShape {
    fn cast_local_ray_and_get_normal(
        &self,
        ray: &ParryRay,
        max_time_of_impact: Real,
        _solid: bool,
    ) -> Option<RayIntersection> {
        let hit =
            with_scratch(|scratch| self.target().cast(&converted(ray, max_time_of_impact), scratch).hit)?;
        let time = hit.t / f64::from(ray.dir.length());
        let feature = FeatureId::Face(hit.source.0);
        Some(RayIntersection::new(to_real(time), to_vector(hit.normal), feature))
    }

    fn intersects_local_ray(&self, ray: &ParryRay, max_time_of_impact: Real) -> bool {
        with_scratch(|scratch| self.target().is_hit(&converted(ray, max_time_of_impact), scratch))
    }
}

fn converted(ray: &ParryRay, max_time_of_impact: Real) -> Ray {
    let max = f64::from(max_time_of_impact) * f64::from(ray.dir.length());
    Ray::new(from_vector(ray.origin), from_vector(ray.dir)).with_max(max)
}

impl PointQuery for ScanShape {
    fn project_local_point(&self, point: Vector, _solid: bool) -> PointProjection {
        self.project_local_point_and_get_feature(point).0
    }

    fn project_local_point_with_max_dist(
        &self,
        point: Vector,
        _solid: bool,
        max_dist: Real,
    ) -> Option<PointProjection> {
        self.nearest(point, f64::from(max_dist)).map(|(projection, _)| projection)
    }

    /// A point that is not finite is its own projection.
    fn project_local_point_and_get_feature(&self, point: Vector) -> (PointProjection, FeatureId) {
        self.nearest(point, f64::INFINITY).unwrap_or((PointProjection::new(false, point), FeatureId::Unknown))
    }
}

impl ScanShape {
    fn nearest(&self, point: Vector, within: f64) -> Option<(PointProjection, FeatureId)> {
        let place = Shape::Sphere { centre: from_vector(point), radius: 0.0 };
        let found = with_scratch(|scratch| self.target().distance(&place, within, scratch))?;
        let projection = PointProjection::new(false, to_vector(found.points[0]));
        Some((projection, FeatureId::Face(found.source.0)))
    }
}

impl ParryShape for ScanShape {
    fn compute_local_aabb(&self) -> Aabb {
        self.0.bounds
    }

    fn compute_local_bounding_sphere(&self) -> BoundingSphere {
        self.0.bounds.bounding_sphere()
    }

    fn clone_dyn(&self) -> Box<dyn ParryShape> {
        Box::new(self.clone())
    }

    /// `None` unless the scale is positive and the same along all axes.
    fn scale_dyn(&self, scale: Vector, _num_subdivisions: u32) -> Option<Box<dyn ParryShape>> {
        let is_uniform = scale.x > 0.0 && scale.x == scale.y && scale.x == scale.z;
        let pose = Pose::IDENTITY.with_scale(f64::from(scale.x)).after(&self.0.pose);
        is_uniform.then(|| Box::new(self.clone().placed(&pose)) as Box<dyn ParryShape>)
    }

    fn mass_properties(&self, density: Real) -> MassProperties {
        self.0.mass.with_density(density)
    }

    fn shape_type(&self) -> ShapeType {
        ShapeType::Custom
    }

    fn as_typed_shape(&self) -> TypedShape<'_> {
        TypedShape::Custom(self)
    }

    /// Half the least extent of its box, as of a solid of that size.
    fn ccd_thickness(&self) -> Real {
        self.0.bounds.half_extents().min_element()
    }

    /// As for triangle meshes.
    fn ccd_angular_thickness(&self) -> Real {
        std::f32::consts::FRAC_PI_4
    }
}
