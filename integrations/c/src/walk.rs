//! Avatars that walk in a slice map.

use std::mem::MaybeUninit;

use nearmiss::slices::{AvatarOptions, Route, Slide, Walker as Walking};

use crate::answer::NONE;
use crate::handle::{Handle, free, get, get_mut, make, opaque};
use crate::pointer::{fill, required, write};
use crate::slices::{SliceMap, unloaded};
use crate::status::{Failure, Status, guard};

/// An avatar somewhere in a map.
#[derive(Debug)]
pub struct Walker(Handle<Walking>);

opaque!(Walker of Walking as b"nm-walke");

/// The size of an avatar. Start from `nearmiss_avatar`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Avatar {
    /// The width and depth of its base.
    pub base: [f64; 2],
    /// Its height.
    pub height: f64,
    /// The height that it steps up at once.
    pub climb: f64,
    /// The distance of a step.
    pub step: f64,
}

/// The result of a step.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Step {
    /// The place of the feet.
    pub position: [f64; 3],
    /// True if something was in the way.
    pub blocked: bool,
    /// True if it fell, or is about to fall.
    pub falling: bool,
}

/// Returns a person: 0.4 by 0.4 wide, 1.6 high, climbs 0.35. Thread safety: any thread.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_avatar() -> Avatar {
    let AvatarOptions { base, height, climb, step, .. } = AvatarOptions::default();
    Avatar { base, height, climb, step }
}

fn avatar(given: Option<&Avatar>) -> Result<nearmiss::slices::Avatar, Failure> {
    let Avatar { base, height, climb, step } = given.copied().unwrap_or_else(|| nearmiss_avatar());
    let options = AvatarOptions::default().with_box(base, height).with_climb(climb).with_step(step);
    nearmiss::slices::Avatar::new(&options).map_err(Failure::argument)
}

/// Puts an avatar's feet at a place where it can stand. `size` may be null. Thread safety: any thread;
/// later, one call at a time.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_walker_new(
    map: Option<&SliceMap>,
    size: Option<&Avatar>,
    start: Option<&[f64; 3]>,
    out: Option<&mut MaybeUninit<*mut Walker>>,
) -> Status {
    guard(|| {
        make(out, || {
            let (map, start) = (get(map, "map")?, *required(start, "start")?);
            avatar(size)?.placed(map, start).map_err(Failure::argument)
        })
    })
}

/// Frees a walker; null is fine. Thread safety: no other call may use the handle at the same time or
/// later.
///
/// # Safety
/// `walker` is null or a handle that no other call uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_walker_free(walker: *mut Walker) -> Status {
    guard(|| free(walker))
}

/// Takes one step towards a place, given as two horizontal coordinates, and slides along walls. The
/// map is that of the walker. Thread safety: one call at a time for each walker.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_walker_step(
    walker: Option<&mut Walker>,
    map: Option<&SliceMap>,
    target: Option<&[f64; 2]>,
    out: Option<&mut MaybeUninit<Step>>,
) -> Status {
    guard(|| {
        let (walker, map, target) =
            (get_mut(walker, "walker")?, get(map, "map")?, *required(target, "target")?);
        if !target.iter().all(|c| c.is_finite()) {
            return Err(Failure::argument(format_args!("expected a finite target, got {target:?}")));
        }
        let step = walker.step(map, target, &Slide).map_err(unloaded)?;
        write(out, Step { position: step.position, blocked: step.blocked, falling: step.falling })
    })
}

/// Finds a short route that an avatar can walk, and writes its points, two horizontal coordinates
/// each, to `out`, as many as its capacity holds, their whole number to `count`, and the length of the
/// route to `length`, which is NaN if there is none. `size` may be null. Thread safety: any thread.
///
/// # Safety
/// `out` are `2 · capacity` places; other pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_route(
    map: Option<&SliceMap>,
    size: Option<&Avatar>,
    from: Option<&[f64; 3]>,
    to: Option<&[f64; 3]>,
    out: *mut f64,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
    length: Option<&mut MaybeUninit<f64>>,
) -> Status {
    guard(|| {
        let length = length.ok_or_else(|| Failure::null("length"))?;
        length.write(NONE);
        let (map, ends) = (get(map, "map")?, [*required(from, "from")?, *required(to, "to")?]);
        let found = Route::find(map, &avatar(size)?, ends, false).map_err(Failure::argument)?;
        length.write(found.length);
        // SAFETY: the caller promises the places; two in a row are one array.
        unsafe { fill(found.route.points.into_iter(), (out.cast::<[f64; 2]>(), capacity), count) }
    })
}
