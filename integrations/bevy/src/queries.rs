//! Questions about all placed scans.

use bevy_ecs::prelude::*;
use bevy_ecs::system::SystemParam;
use nearmiss::{BodyId, Ray, RayHit, Scratch, Shape, ShapeContact, ShapeDistance};

use crate::collider::ScanWorld;

/// Questions about all placed scans, as a parameter of a system. Everything is in world coordinates, and
/// as of the last run of [`ScanSystems`](crate::ScanSystems), at the end of the frame.
///
/// ```
/// # use bevy_ecs::prelude::*;
/// # use bevy_math::{Dir3, Ray3d, Vec3};
/// # use nearmiss_bevy::{Scans, ray_of};
/// fn ground_below(mut scans: Scans) {
///     let down = Ray3d::new(Vec3::Y * 10.0, Dir3::NEG_Y);
///     if let Some((entity, hit)) = scans.cast(&ray_of(down, 100.0)) {
///         println!("{entity} is {} below", hit.t);
///     }
/// }
/// ```
#[derive(Debug, SystemParam)]
pub struct Scans<'w, 's> {
    world: Res<'w, ScanWorld>,
    working: Local<'s, Working>,
}

/// The memory of queries, which do not allocate once it is warm.
#[derive(Debug, Default)]
struct Working {
    scratch: Scratch,
    near: Vec<BodyId>,
    contacts: Vec<ShapeContact>,
}

impl Scans<'_, '_> {
    /// All placed scans.
    #[must_use]
    pub fn world(&self) -> &ScanWorld {
        &self.world
    }

    /// The first scan that a ray, or a ball along it, hits.
    #[must_use]
    pub fn cast(&mut self, ray: &Ray) -> Option<(Entity, RayHit)> {
        let Working { scratch, near, .. } = &mut *self.working;
        let length = ray.direction.iter().map(|c| c * c).sum::<f64>().sqrt();
        let end = [0, 1, 2].map(|k| ray.origin[k] + ray.direction[k] / length * ray.max);
        let path = Shape::Capsule { ends: [ray.origin, end], radius: ray.radius };
        self.world.bodies().near_shape(&path, self.world.options().semantics.growth(), near);
        let mut first: Option<(Entity, RayHit)> = None;
        for (entity, target) in near.iter().filter_map(|&body| self.world.target(body)) {
            let hit = target.cast(ray, scratch).hit;
            if let Some(hit) = hit.filter(|hit| first.is_none_or(|(_, first)| hit.t < first.t)) {
                first = Some((entity, hit));
            }
        }
        first
    }

    /// Writes the entities whose scans a shape touches to `out`.
    pub fn touching(&mut self, shape: &Shape<'_>, out: &mut Vec<Entity>) {
        out.clear();
        let Working { scratch, near, .. } = &mut *self.working;
        self.world.bodies().near_shape(shape, self.world.reach(), near);
        for (entity, target) in near.iter().filter_map(|&body| self.world.target(body)) {
            if target.touch(shape, scratch).verdict.is_touching() {
                out.push(entity);
            }
        }
    }

    /// Writes the contacts of a shape with all scans to `out`, up to eight of each. The first of each scan is
    /// the deepest.
    pub fn contacts(&mut self, shape: &Shape<'_>, out: &mut Vec<(Entity, ShapeContact)>) {
        out.clear();
        let Working { scratch, near, contacts } = &mut *self.working;
        self.world.bodies().near_shape(shape, self.world.reach(), near);
        for (entity, target) in near.iter().filter_map(|&body| self.world.target(body)) {
            target.contacts(shape, contacts, scratch);
            out.extend(contacts.iter().map(|&contact| (entity, contact)));
        }
    }

    /// The scan nearest to a shape, if it is nearer than `within`.
    #[must_use]
    pub fn nearest(&mut self, shape: &Shape<'_>, within: f64) -> Option<(Entity, ShapeDistance)> {
        let Working { scratch, near, .. } = &mut *self.working;
        self.world.bodies().near_shape(shape, within + self.world.options().semantics.growth(), near);
        let mut best: Option<(Entity, ShapeDistance)> = None;
        for (entity, target) in near.iter().filter_map(|&body| self.world.target(body)) {
            let within = best.map_or(within, |(_, best)| best.upper);
            let found = target.distance(shape, within, scratch);
            if let Some(found) = found.filter(|it| best.is_none_or(|(_, best)| it.upper < best.upper)) {
                best = Some((entity, found));
            }
        }
        best
    }

    /// Writes the entities whose scans overlap that of `entity` to `out`.
    pub fn overlapping(&mut self, entity: Entity, out: &mut Vec<Entity>) {
        out.clear();
        let world = &*self.world;
        let Some((body, placed)) = world.body_of(entity).zip(world.placed(entity)) else { return };
        let Working { scratch, near, .. } = &mut *self.working;
        let reach = world.plan([body; 2]).map_or(0.0, |plan| plan.reach());
        world.bodies().near(&placed, reach, near);
        for &other in near.iter().filter(|&&other| other != body) {
            let Some((plan, pair)) = world.plan([body, other]).zip(world.bodies().pair([body, other])) else {
                continue;
            };
            if pair.collide(&plan, scratch).verdict.is_intersecting() {
                out.extend(world.entity_of(other));
            }
        }
    }
}
