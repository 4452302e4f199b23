//! Questions about two scans.

use std::mem::MaybeUninit;

use nearmiss::Pair;

use crate::answer::{Answer, Contact, Distance, ManifoldPoint};
use crate::handle::{get, get_mut};
use crate::hint::Hint;
use crate::options::{Budget, budget};
use crate::plan::Plan;
use crate::pointer::{fill, required, write};
use crate::pose::Placed;
use crate::scratch::Scratch;
use crate::status::{Failure, Status, guard};

/// Returns the pair of two placed scans.
#[inline(always)]
pub(crate) fn pair<'a>(
    a: Option<&Placed<'a>>,
    b: Option<&Placed<'a>>,
    limits: Option<&Budget>,
) -> Result<Pair<'a>, Failure> {
    let pair = Pair::new(required(a, "a")?.at()?, required(b, "b")?.at()?);
    Ok(if limits.is_some() { pair.within(&budget(limits)?) } else { pair })
}

/// Decides whether two scans touch. `limits` and `hint` may be null. Does not allocate once the scratch
/// is warm. Thread safety: one call at a time for each scratch and each hint.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_collide(
    plan: Option<&Plan>,
    a: Option<&Placed<'_>>,
    b: Option<&Placed<'_>>,
    limits: Option<&Budget>,
    hint: Option<&mut Hint>,
    scratch: Option<&mut Scratch>,
    out: Option<&mut MaybeUninit<Answer>>,
) -> Status {
    guard(|| {
        let plan = &get(plan, "plan")?.collide;
        let (pair, memory) = (pair(a, b, limits)?, get_mut(scratch, "scratch")?);
        let answer = match hint {
            None => pair.collide(plan, &mut memory.scratch),
            hint => pair.hinted(get_mut(hint, "hint")?).collide(plan, &mut memory.scratch),
        };
        write(out, Answer::new(&answer))
    })
}

/// The places for a list, and the number of entries there are. Fields that are written need no value before.
#[derive(Debug)]
#[repr(C)]
pub struct ManifoldList {
    /// Room for `capacity` points; eight suffice. May be null if `capacity` is 0.
    pub points: *mut ManifoldPoint,
    /// The number of places.
    pub capacity: usize,
    /// Written: the number of points, which may exceed the capacity. The first ones are written.
    pub count: MaybeUninit<usize>,
}

/// The places for a list, and the number of entries there are. Fields that are written need no value before.
#[derive(Debug)]
#[repr(C)]
pub struct ContactList {
    /// Room for `capacity` contacts. May be null if `capacity` is 0.
    pub contacts: *mut Contact,
    /// The number of places.
    pub capacity: usize,
    /// Written: the number of contacts, which may exceed the capacity. The first ones are written.
    pub count: MaybeUninit<usize>,
    /// Written: true if the budget did not end the search, so that the list has all contacts.
    pub complete: MaybeUninit<bool>,
}

/// Like `nearmiss_collide`, and writes up to eight contact points for a physics solver to `list`. The
/// first is the deepest; each of the others is the candidate furthest from all earlier ones. Thread
/// safety: as for `nearmiss_collide`.
///
/// # Safety
/// `list` is null or valid, and so are its places.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_manifold(
    plan: Option<&Plan>,
    a: Option<&Placed<'_>>,
    b: Option<&Placed<'_>>,
    limits: Option<&Budget>,
    hint: Option<&mut Hint>,
    scratch: Option<&mut Scratch>,
    list: Option<&mut ManifoldList>,
    out: Option<&mut MaybeUninit<Answer>>,
) -> Status {
    guard(|| {
        let plan = &get(plan, "plan")?.collide;
        let (pair, memory) = (pair(a, b, limits)?, get_mut(scratch, "scratch")?);
        let list = list.ok_or_else(|| Failure::null("list"))?;
        let mut question = pair.manifold(&mut memory.manifold);
        if hint.is_some() {
            question = question.hinted(get_mut(hint, "hint")?);
        }
        let answer = question.collide(plan, &mut memory.scratch);
        let points = memory.manifold.iter().map(ManifoldPoint::new);
        // SAFETY: the caller promises the places of the list.
        unsafe { fill(points, (list.points, list.capacity), Some(&mut list.count)) }?;
        write(out, Answer::new(&answer))
    })
}

/// Like `nearmiss_collide` without a hint, and writes a contact of each pair of leaves that touch to
/// `list`. Thread safety: as for `nearmiss_collide`.
///
/// # Safety
/// `list` is null or valid, and so are its places.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_contacts(
    plan: Option<&Plan>,
    a: Option<&Placed<'_>>,
    b: Option<&Placed<'_>>,
    limits: Option<&Budget>,
    scratch: Option<&mut Scratch>,
    list: Option<&mut ContactList>,
    out: Option<&mut MaybeUninit<Answer>>,
) -> Status {
    guard(|| {
        let plan = &get(plan, "plan")?.collide;
        let (pair, memory) = (pair(a, b, limits)?, get_mut(scratch, "scratch")?);
        let list = list.ok_or_else(|| Failure::null("list"))?;
        let answer = pair.contacts(&mut memory.contacts).collide(plan, &mut memory.scratch);
        list.complete.write(memory.contacts.complete);
        let contacts = memory.contacts.contacts.iter().map(Contact::new);
        // SAFETY: the caller promises the places of the list.
        unsafe { fill(contacts, (list.contacts, list.capacity), Some(&mut list.count)) }?;
        write(out, Answer::new(&answer))
    })
}

/// Bounds the distance of two scans. `limits` may be null. Thread safety: one call at a time for each
/// scratch.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_distance(
    plan: Option<&Plan>,
    a: Option<&Placed<'_>>,
    b: Option<&Placed<'_>>,
    limits: Option<&Budget>,
    scratch: Option<&mut Scratch>,
    out: Option<&mut MaybeUninit<Distance>>,
) -> Status {
    guard(|| {
        let plan = &get(plan, "plan")?.distance;
        let (pair, memory) = (pair(a, b, limits)?, get_mut(scratch, "scratch")?);
        write(out, Distance::new(&pair.distance(plan, &mut memory.scratch)))
    })
}
