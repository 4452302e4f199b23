//! Hints: what the last question found out, for the next similar one.

use nearmiss::PairHint;
use std::mem::MaybeUninit;

use crate::handle::{Handle, free, get_mut, make, opaque};
use crate::status::{Status, guard};

/// The findings of the last question about a pair of scans. Keep one for each pair whose poses
/// change little between questions. It never changes a verdict, except one that a budget ends.
#[derive(Debug)]
pub struct Hint(Handle<PairHint>);

opaque!(Hint of PairHint as b"nm-hint.");

/// The contacts of a shape and a scan in the last frame. Keep one for each pair: contacts keep
/// their ids, and the shape its side of a surface.
#[derive(Debug)]
pub struct ShapeHint(Handle<nearmiss::ShapeHint>);

opaque!(ShapeHint of nearmiss::ShapeHint as b"nm-shape");

/// Makes a hint for a pair of scans. Thread safety: any thread; later, one call at a time.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_hint_new(out: Option<&mut MaybeUninit<*mut Hint>>) -> Status {
    guard(|| make(out, || Ok(PairHint::default())))
}

/// Frees a hint; null is fine. Thread safety: no other call may use the handle at the same time or
/// later.
///
/// # Safety
/// `hint` is null or a handle that no other call uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_hint_free(hint: *mut Hint) -> Status {
    guard(|| free(hint))
}

/// Makes a hint for a shape and a scan. Thread safety: any thread; later, one call at a time.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_shape_hint_new(out: Option<&mut MaybeUninit<*mut ShapeHint>>) -> Status {
    guard(|| make(out, || Ok(nearmiss::ShapeHint::default())))
}

/// Forgets all contacts, as the shape was moved elsewhere. Thread safety: one call at a time.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_shape_hint_clear(hint: Option<&mut ShapeHint>) -> Status {
    guard(|| {
        get_mut(hint, "hint")?.clear();
        Ok(())
    })
}

/// Frees a hint; null is fine. Thread safety: no other call may use the handle at the same time or
/// later.
///
/// # Safety
/// `hint` is null or a handle that no other call uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_shape_hint_free(hint: *mut ShapeHint) -> Status {
    guard(|| free(hint))
}
