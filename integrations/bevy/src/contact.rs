//! Contacts between scans that move.

use std::mem;

use bevy_ecs::prelude::*;
use nearmiss::{Bodies, BodyId, ManifoldPoint, Scratch};

use crate::collider::{ScanWorld, Touching};

/// A contact of two scans, of which at least one was placed, moved or removed in this frame.
#[derive(Debug, Clone, PartialEq, Message)]
pub struct ScanContact {
    /// The entities of both scans, that whose scan was placed first before the other.
    pub entities: [Entity; 2],
    /// Begin, course or end.
    pub phase: ContactPhase,
    /// Points of contact with normals and gaps, as for a solver; the first is the deepest. None at the end.
    pub points: Vec<ManifoldPoint>,
}

/// The phase of a contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ContactPhase {
    /// The scans did not touch in the last frame.
    Began,
    /// They go on touching.
    Stays,
    /// They touch no more, or one of them is gone.
    Ended,
}

/// Writes the contacts of all scans that moved, pair after pair in the order of their bodies.
pub(crate) fn find(
    mut world: ResMut<'_, ScanWorld>,
    mut contacts: MessageWriter<'_, ScanContact>,
    mut pairs: Local<'_, Vec<[BodyId; 2]>>,
    mut scratch: Local<'_, Scratch>,
) {
    let world = &mut *world;
    let mut moved = mem::take(&mut world.moved);
    moved.sort_unstable();
    moved.dedup();
    let mut touching = mem::take(&mut world.touching);
    let is_moved = |body: &BodyId| moved.binary_search(body).is_ok();
    let reach = moved.first().and_then(|&body| Some(world.plan([body; 2])?.reach())).unwrap_or(0.0);
    world.bodies().near_pairs(Bodies::These(&moved), reach, &mut pairs);
    for &bodies in &*pairs {
        let entities = bodies.map(|body| world.entity_of(body));
        let ([Some(a), Some(b)], Some(pair)) = (entities, world.bodies().pair(bodies)) else { continue };
        let Some(plan) = world.plan(bodies) else { continue };
        let known = touching.remove(&bodies);
        let phase = if known.is_some() { ContactPhase::Stays } else { ContactPhase::Began };
        let mut it = known.unwrap_or_else(|| Touching { entities: [a, b], hint: Default::default() });
        let mut points = Vec::new();
        let answer = pair.manifold(&mut points).hinted(&mut it.hint).collide(&plan, &mut scratch);
        if answer.verdict.is_intersecting() {
            contacts.write(ScanContact { entities: it.entities, phase, points });
            world.touching.insert(bodies, it);
        } else if phase == ContactPhase::Stays {
            contacts.write(ScanContact {
                entities: it.entities,
                phase: ContactPhase::Ended,
                points: Vec::new(),
            });
        }
    }
    // Pairs that are no longer near, and those that rest.
    for (bodies, it) in touching {
        let is_there = bodies.iter().all(|&body| world.entity_of(body).is_some());
        if is_there && !bodies.iter().any(is_moved) {
            world.touching.insert(bodies, it);
        } else {
            contacts.write(ScanContact {
                entities: it.entities,
                phase: ContactPhase::Ended,
                points: Vec::new(),
            });
        }
    }
    moved.clear();
    world.moved = moved;
}
