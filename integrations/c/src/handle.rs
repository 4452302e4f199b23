//! Opaque handles, with a mark that tells if a handle is of the right kind and not freed.

use std::collections::VecDeque;
use std::mem::MaybeUninit;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use crate::status::{Failure, Status};

/// The mark of a freed handle.
const FREED: u64 = u64::from_le_bytes(*b"nm-freed");

/// The number of freed handles whose memory is kept, so that their use is noticed.
const KEPT: usize = 256;

/// The target of a handle. The mark comes first in handles of all kinds, so that one of another kind
/// is recognised.
#[derive(Debug)]
#[repr(C)]
pub(crate) struct Handle<T> {
    mark: AtomicU64,
    value: Option<T>,
}

/// A kind of handle.
pub(crate) trait Opaque: Sized + Send {
    /// The value behind the handle.
    type Value;
    /// The mark of this kind.
    const MARK: u64;
    /// The name in messages.
    const NAME: &'static str;

    fn wrap(handle: Handle<Self::Value>) -> Self;
    fn handle(&self) -> &Handle<Self::Value>;
    fn handle_mut(&mut self) -> &mut Handle<Self::Value>;
}

/// Makes a struct a kind of handle. It is declared outside the macro, where cbindgen sees it.
macro_rules! opaque {
    ($name:ident of $value:ty as $mark:literal) => {
        impl $crate::handle::Opaque for $name {
            type Value = $value;
            const MARK: u64 = u64::from_le_bytes(*$mark);
            const NAME: &'static str = stringify!($name);

            fn wrap(handle: $crate::handle::Handle<$value>) -> Self {
                Self(handle)
            }

            #[inline]
            fn handle(&self) -> &$crate::handle::Handle<$value> {
                &self.0
            }

            #[inline]
            fn handle_mut(&mut self) -> &mut $crate::handle::Handle<$value> {
                &mut self.0
            }
        }
    };
}
pub(crate) use opaque;

#[cold]
fn wrong<H: Opaque>(mark: u64) -> Failure {
    let got = if mark == FREED { "one that was freed" } else { "another kind of pointer" };
    Failure::new(Status::Handle, format_args!("expected a handle of Nearmiss{}, got {got}", H::NAME))
}

/// Returns the value of a handle.
#[inline(always)]
pub(crate) fn get<'a, H: Opaque>(handle: Option<&'a H>, name: &str) -> Result<&'a H::Value, Failure> {
    let handle = handle.ok_or_else(|| Failure::null(name))?.handle();
    let mark = handle.mark.load(Ordering::Relaxed);
    if mark != H::MARK {
        return Err(wrong::<H>(mark));
    }
    handle.value.as_ref().ok_or_else(|| wrong::<H>(mark))
}

/// Returns the value of a handle, to change it.
#[inline(always)]
pub(crate) fn get_mut<'a, H: Opaque>(
    handle: Option<&'a mut H>,
    name: &str,
) -> Result<&'a mut H::Value, Failure> {
    let handle = handle.ok_or_else(|| Failure::null(name))?.handle_mut();
    let mark = handle.mark.load(Ordering::Relaxed);
    if mark != H::MARK {
        return Err(wrong::<H>(mark));
    }
    handle.value.as_mut().ok_or_else(|| wrong::<H>(mark))
}

/// Makes a value and writes its handle to `out`, or null if that fails.
pub(crate) fn make<H: Opaque>(
    out: Option<&mut MaybeUninit<*mut H>>,
    value: impl FnOnce() -> Result<H::Value, Failure>,
) -> Result<(), Failure> {
    let out = out.ok_or_else(|| Failure::null("out"))?;
    out.write(std::ptr::null_mut());
    let handle = Handle { mark: AtomicU64::new(H::MARK), value: Some(value()?) };
    out.write(Box::into_raw(Box::new(H::wrap(handle))));
    Ok(())
}

/// The memory of a freed handle.
struct Freed {
    memory: *mut (),
    drop: unsafe fn(*mut ()),
}

// SAFETY: the value is gone, and what is left of a handle is a mark, which any thread may free.
unsafe impl Send for Freed {}

static FREED_HANDLES: Mutex<VecDeque<Freed>> = Mutex::new(VecDeque::new());

/// Drops the value of a handle, marks it as freed, and keeps its memory for a while. Null is fine.
pub(crate) fn free<H: Opaque>(handle: *mut H) -> Result<(), Failure> {
    /// Frees the memory of a handle.
    unsafe fn release<H>(memory: *mut ()) {
        // SAFETY: `memory` came from `Box::into_raw` of this type in `make`, and left the queue once.
        drop(unsafe { Box::from_raw(memory.cast::<H>()) });
    }

    // SAFETY: the caller passes null or a handle that no other call uses at this time. Its memory is
    // that of `make`, or is kept in the queue below if it was freed before.
    let Some(inner) = (unsafe { handle.as_mut() }) else { return Ok(()) };
    get_mut(Some(&mut *inner), "handle")?;
    let inner = inner.handle_mut();
    inner.mark.store(FREED, Ordering::Relaxed);
    drop(inner.value.take());
    let mut queue = FREED_HANDLES.lock().unwrap_or_else(PoisonError::into_inner);
    queue.push_back(Freed { memory: handle.cast(), drop: release::<H> });
    if queue.len() > KEPT
        && let Some(oldest) = queue.pop_front()
    {
        // SAFETY: `drop` is that of the kind of this handle, and is called once, as it left the queue.
        unsafe { (oldest.drop)(oldest.memory) };
    }
    Ok(())
}
