//! Scans that entities place in the world.

use std::collections::{BTreeMap, BTreeSet};

use bevy_asset::{AssetEvent, Assets, Handle};
use bevy_ecs::prelude::*;
use bevy_transform::components::{GlobalTransform, Transform};
use nearmiss::{
    BodyId, CollideOptions, CollidePlan, PairHint, Placed, Scan, ShapePlan, Target, World as Bodies,
};

use crate::asset::ScanAsset;
use crate::convert::pose_of;

/// Makes the scan of an asset, at the transform of the entity, part of the [`ScanWorld`] as soon as the
/// asset is loaded. The transform has one scale for all axes.
#[derive(Debug, Clone, Component, PartialEq, Eq)]
#[require(Transform)]
pub struct ScanCollider(pub Handle<ScanAsset>);

/// All placed scans. [`Scans`](crate::Scans) asks about them.
#[derive(Debug, Resource)]
pub struct ScanWorld {
    options: CollideOptions,
    bodies: Bodies<Scan>,
    /// By entity, and by body.
    of_entity: BTreeMap<Entity, BodyId>,
    of_body: BTreeMap<BodyId, Placing>,
    /// The bodies that were placed or moved since contacts were looked for.
    pub(crate) moved: Vec<BodyId>,
    /// The pairs that touch.
    pub(crate) touching: BTreeMap<[BodyId; 2], Touching>,
}

#[derive(Debug)]
struct Placing {
    entity: Entity,
    plan: ShapePlan,
}

/// A pair that touches.
#[derive(Debug)]
pub(crate) struct Touching {
    /// Outlive the bodies, so that the end of a contact can be told.
    pub(crate) entities: [Entity; 2],
    pub(crate) hint: PairHint,
}

impl ScanWorld {
    /// An empty world, whose scans have the meaning and the accuracy of `options`.
    #[must_use]
    pub fn new(options: &CollideOptions) -> Self {
        Self {
            options: *options,
            bodies: Bodies::new(),
            of_entity: BTreeMap::new(),
            of_body: BTreeMap::new(),
            moved: Vec::new(),
            touching: BTreeMap::new(),
        }
    }

    /// The scans as nearmiss places them, for questions that [`Scans`](crate::Scans) does not ask.
    #[must_use]
    pub fn bodies(&self) -> &Bodies<Scan> {
        &self.bodies
    }

    /// The body of an entity; `None` while its scan is not placed.
    #[must_use]
    pub fn body_of(&self, entity: Entity) -> Option<BodyId> {
        self.of_entity.get(&entity).copied()
    }

    /// The entity of a body.
    #[must_use]
    pub fn entity_of(&self, body: BodyId) -> Option<Entity> {
        Some(self.of_body.get(&body)?.entity)
    }

    /// The scan of an entity where it is placed.
    #[must_use]
    pub fn placed(&self, entity: Entity) -> Option<Placed<'_>> {
        self.bodies.placed(self.body_of(entity)?)
    }

    /// The options of all queries.
    #[must_use]
    pub fn options(&self) -> &CollideOptions {
        &self.options
    }

    /// The distance from the box of a scan up to which a shape may touch it.
    pub(crate) fn reach(&self) -> f64 {
        self.options.semantics.growth() + self.options.margin
    }

    /// A body as the target of shapes and rays.
    pub(crate) fn target(&self, body: BodyId) -> Option<(Entity, Target<'_>)> {
        let Placing { entity, plan } = self.of_body.get(&body)?;
        Some((*entity, Target::new(self.bodies.placed(body)?, plan)))
    }

    /// The plan of a pair; `None` if the two cannot be compared.
    pub(crate) fn plan(&self, [a, b]: [BodyId; 2]) -> Option<CollidePlan> {
        let scan = |body| self.bodies.placed(body).map(|it| it.scan());
        CollidePlan::new(&self.options, scan(a)?, scan(b)?).ok()
    }

    fn remove(&mut self, entity: Entity) {
        if let Some(body) = self.of_entity.remove(&entity) {
            self.bodies.remove(body);
            self.of_body.remove(&body);
        }
    }

    /// Places or moves the scan of an entity, or says why it cannot be placed.
    fn place(
        &mut self,
        entity: Entity,
        scan: Option<&Scan>,
        transform: &GlobalTransform,
    ) -> Result<(), String> {
        let pose = pose_of(transform).map_err(|cause| cause.to_string());
        if let Some(&body) = self.of_entity.get(&entity) {
            match pose {
                Ok(pose) => _ = self.bodies.move_to(body, &pose),
                Err(cause) => {
                    self.remove(entity);
                    return Err(cause);
                }
            }
            self.moved.push(body);
        } else if let Some(scan) = scan {
            let plan = ShapePlan::new(&self.options, scan).map_err(|cause| cause.to_string())?;
            let body = self.bodies.insert(scan.clone(), &pose?);
            self.of_entity.insert(entity, body);
            self.of_body.insert(body, Placing { entity, plan });
            self.moved.push(body);
        }
        Ok(())
    }
}

/// Follows colliders, transforms and assets.
pub(crate) fn follow(
    mut world: ResMut<'_, ScanWorld>,
    assets: Res<'_, Assets<ScanAsset>>,
    mut events: MessageReader<'_, '_, AssetEvent<ScanAsset>>,
    colliders: Query<'_, '_, (Entity, Ref<'_, ScanCollider>, Ref<'_, GlobalTransform>)>,
    mut removed: RemovedComponents<'_, '_, ScanCollider>,
) {
    removed.read().for_each(|entity| world.remove(entity));
    let changed: BTreeSet<_> = events
        .read()
        .filter_map(|event| match event {
            AssetEvent::Added { id } | AssetEvent::Modified { id } | AssetEvent::Removed { id } => Some(*id),
            _ => None,
        })
        .collect();
    for (entity, collider, transform) in &colliders {
        let is_other = collider.is_changed() || changed.contains(&collider.0.id());
        if !is_other && !transform.is_changed() {
            continue;
        }
        if is_other {
            world.remove(entity);
        }
        let scan = assets.get(&collider.0).map(|asset| &asset.0);
        if let Err(cause) = world.place(entity, scan, &transform) {
            tracing::error!("the scan of {entity} is not placed: {cause}");
        }
    }
}
