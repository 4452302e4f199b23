//! Scratch memory.

use nearmiss::{BodyId, Contacts, ManifoldPoint, RayHit, ShapeContact};
use std::mem::MaybeUninit;

use crate::handle::{Handle, free, make, opaque};
use crate::status::{Status, guard};

/// The memory of a thread's questions, and of their outputs.
#[derive(Debug, Default)]
pub(crate) struct Memory {
    pub(crate) scratch: nearmiss::Scratch,
    pub(crate) contacts: Contacts,
    pub(crate) manifold: Vec<ManifoldPoint>,
    pub(crate) shape_contacts: Vec<ShapeContact>,
    pub(crate) hits: Vec<RayHit>,
    pub(crate) pairs: Vec<[BodyId; 2]>,
    pub(crate) ids: Vec<BodyId>,
}

/// Working memory of questions. Make one for each thread, and reuse it: a question does not
/// allocate once its scratch is warm. It serves every question and never changes an answer.
#[derive(Debug)]
pub struct Scratch(Handle<Memory>);

opaque!(Scratch of Memory as b"nm-scrat");

/// Makes scratch memory. Thread safety: any thread; later, one call at a time.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_scratch_new(out: Option<&mut MaybeUninit<*mut Scratch>>) -> Status {
    guard(|| make(out, || Ok(Memory::default())))
}

/// Frees scratch memory; null is fine. Thread safety: no other call may use the handle at the same time
/// or later.
///
/// # Safety
/// `scratch` is null or a handle that no other call uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_scratch_free(scratch: *mut Scratch) -> Status {
    guard(|| free(scratch))
}
