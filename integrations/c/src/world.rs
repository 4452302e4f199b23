//! Worlds: many placed scans.

use std::mem::MaybeUninit;

use nearmiss::{Bodies, BodyId};

use crate::answer::Answer;
use crate::handle::{Handle, free, get, get_mut, make, opaque};
use crate::hint::Hint;
use crate::options::{Budget, budget};
use crate::plan::Plan;
use crate::pointer::{fill, required, slice, write};
use crate::pose::{Placed, Pose};
use crate::scratch::Scratch;
use crate::status::{Failure, Status, guard};

/// Placed scans, each a body with an id. Any number of threads may ask at the same time, while none
/// changes it.
#[derive(Debug)]
pub struct World(Handle<nearmiss::World<nearmiss::Scan>>);

opaque!(World of nearmiss::World<nearmiss::Scan> as b"nm-world");

/// The ids of two bodies, the smaller one first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub struct BodyPair {
    /// The smaller id.
    pub a: u64,
    /// The greater id.
    pub b: u64,
}

fn no_body(id: u64) -> Failure {
    Failure::argument(format_args!("expected the id of a body of this world, got {id}"))
}

/// Makes an empty world. Thread safety: any thread.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_world_new(out: Option<&mut MaybeUninit<*mut World>>) -> Status {
    guard(|| make(out, || Ok(nearmiss::World::new())))
}

/// Frees a world; null is fine. Thread safety: no other call may use the handle at the same time or
/// later.
///
/// # Safety
/// `world` is null or a handle that no other call uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_world_free(world: *mut World) -> Status {
    guard(|| free(world))
}

/// Adds a placed scan and writes its id to `out`. The world keeps the scan; its handle may be freed.
/// Thread safety: no other call may use the world at the same time.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_world_insert(
    world: Option<&mut World>,
    scan: Option<&Placed<'_>>,
    out: Option<&mut MaybeUninit<u64>>,
) -> Status {
    guard(|| {
        let world = get_mut(world, "world")?;
        let placed = required(scan, "scan")?;
        let (scan, pose) = (get(placed.scan, "scan")?, placed.pose.checked()?);
        let out = out.ok_or_else(|| Failure::null("out"))?;
        write(Some(out), world.insert(scan.clone(), &pose).0)
    })
}

/// Removes a body. Thread safety: no other call may use the world at the same time.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_world_remove(world: Option<&mut World>, id: u64) -> Status {
    guard(|| get_mut(world, "world")?.remove(BodyId(id)).map(drop).ok_or_else(|| no_body(id)))
}

/// Moves a body. Thread safety: no other call may use the world at the same time.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_world_move(world: Option<&mut World>, id: u64, pose: Option<&Pose>) -> Status {
    guard(|| {
        let (world, pose) = (get_mut(world, "world")?, required(pose, "pose")?.checked()?);
        if world.move_to(BodyId(id), &pose) { Ok(()) } else { Err(no_body(id)) }
    })
}

/// Writes the pairs of bodies that may meet under `plan` to `out`, as many as its capacity holds, in
/// ascending order, and their whole number to `count`. With `id_count` above 0, only pairs with one of
/// the bodies `ids`, such as those that have moved. Thread safety: one call at a time for each scratch.
///
/// # Safety
/// `ids` are `id_count` numbers, `out` are `capacity` places; other pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_world_near_pairs(
    world: Option<&World>,
    plan: Option<&Plan>,
    ids: *const u64,
    id_count: usize,
    scratch: Option<&mut Scratch>,
    out: *mut BodyPair,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> Status {
    guard(|| {
        let (world, reach) = (get(world, "world")?, get(plan, "plan")?.collide.reach());
        let memory = get_mut(scratch, "scratch")?;
        // SAFETY: the caller promises the ids.
        let ids = unsafe { slice(ids, id_count, "ids") }?;
        memory.ids.clear();
        memory.ids.extend(ids.iter().map(|&id| BodyId(id)));
        let bodies = if ids.is_empty() { Bodies::All } else { Bodies::These(&memory.ids) };
        world.near_pairs(bodies, reach, &mut memory.pairs);
        let pairs = memory.pairs.iter().map(|&[a, b]| BodyPair { a: a.0, b: b.0 });
        // SAFETY: the caller promises the places.
        unsafe { fill(pairs, (out, capacity), count) }
    })
}

/// Decides whether two bodies touch, as `nearmiss_collide` does for two scans. Thread safety: one call
/// at a time for each scratch and each hint.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_world_collide(
    world: Option<&World>,
    plan: Option<&Plan>,
    pair: BodyPair,
    limits: Option<&Budget>,
    hint: Option<&mut Hint>,
    scratch: Option<&mut Scratch>,
    out: Option<&mut MaybeUninit<Answer>>,
) -> Status {
    guard(|| {
        let (world, plan) = (get(world, "world")?, &get(plan, "plan")?.collide);
        let ids = [BodyId(pair.a), BodyId(pair.b)];
        let missing = || no_body(if world.placed(ids[0]).is_none() { pair.a } else { pair.b });
        let pair = world.pair(ids).ok_or_else(missing)?.within(&budget(limits)?);
        let memory = get_mut(scratch, "scratch")?;
        let answer = match hint {
            None => pair.collide(plan, &mut memory.scratch),
            hint => pair.hinted(get_mut(hint, "hint")?).collide(plan, &mut memory.scratch),
        };
        write(out, Answer::new(&answer))
    })
}
