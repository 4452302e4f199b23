//! Pointers of C as references and slices.

use std::ffi::{CStr, c_char};
use std::mem::MaybeUninit;
use std::path::PathBuf;

use crate::status::Failure;

/// Returns the value at a pointer that must not be null.
#[inline]
pub(crate) fn required<'a, T>(value: Option<&'a T>, name: &str) -> Result<&'a T, Failure> {
    value.ok_or_else(|| Failure::null(name))
}

/// Writes a value to a place that must not be null.
#[inline]
pub(crate) fn write<T>(out: Option<&mut MaybeUninit<T>>, value: T) -> Result<(), Failure> {
    out.ok_or_else(|| Failure::null("out"))?.write(value);
    Ok(())
}

/// The greatest number of elements of an array whose bytes can be counted.
const fn most<T>() -> usize {
    isize::MAX.unsigned_abs() / if size_of::<T>() == 0 { 1 } else { size_of::<T>() }
}

/// Refuses a pointer to `count` values that is not aligned, or too many values.
pub(crate) fn check<T>(first: *const T, count: usize, name: &str) -> Result<(), Failure> {
    if count > most::<T>() {
        return Err(Failure::argument(format_args!(
            "expected at most {} values for {name}, got {count}",
            most::<T>()
        )));
    }
    if !first.is_aligned() {
        let align = align_of::<T>();
        return Err(Failure::argument(format_args!(
            "expected a pointer aligned to {align} bytes for {name}, got another one"
        )));
    }
    Ok(())
}

/// Returns `count` values as a slice. The pointer may be null if there are none.
///
/// # Safety
/// The pointer is null or points to `count` values, which nothing changes meanwhile.
pub(crate) unsafe fn slice<'a, T>(first: *const T, count: usize, name: &str) -> Result<&'a [T], Failure> {
    if count == 0 {
        return Ok(&[]);
    }
    if first.is_null() {
        return Err(Failure::null(name));
    }
    check(first, count, name)?;
    // SAFETY: it is not null, aligned and not too long; the caller promises the values.
    Ok(unsafe { std::slice::from_raw_parts(first, count) })
}

/// Copies as many `values` as fit into `capacity` places at `first`, and writes their whole number to
/// `count`.
///
/// # Safety
/// The pointer is null or points to `capacity` places, which nothing else uses meanwhile.
pub(crate) unsafe fn fill<T>(
    values: impl ExactSizeIterator<Item = T>,
    (first, capacity): (*mut T, usize),
    count: Option<&mut MaybeUninit<usize>>,
) -> Result<(), Failure> {
    let count = count.ok_or_else(|| Failure::null("count"))?;
    count.write(values.len());
    if capacity == 0 {
        return Ok(());
    }
    if first.is_null() {
        return Err(Failure::null("the places of a list"));
    }
    check(first, capacity, "the places of a list")?;
    for (i, value) in values.take(capacity).enumerate() {
        // SAFETY: `i` is below `capacity`, so the place is one of those that the caller promises.
        unsafe { first.add(i).write(value) };
    }
    Ok(())
}

/// Returns the text at a pointer.
///
/// # Safety
/// The pointer is null or points to text that ends with a zero byte.
pub(crate) unsafe fn text<'a>(text: *const c_char, name: &str) -> Result<&'a str, Failure> {
    if text.is_null() {
        return Err(Failure::null(name));
    }
    // SAFETY: it is not null, and the caller promises the zero byte.
    let text = unsafe { CStr::from_ptr(text) };
    text.to_str()
        .map_err(|_bytes| Failure::argument(format_args!("expected UTF-8 for `{name}`, got other bytes")))
}

/// Returns the path at a pointer.
///
/// # Safety
/// As for [`text`].
pub(crate) unsafe fn path(given: *const c_char) -> Result<PathBuf, Failure> {
    // SAFETY: as the caller promises.
    unsafe { text(given, "file") }.map(PathBuf::from)
}
