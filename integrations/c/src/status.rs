//! Statuses, messages, and the guard of every function.

use std::cell::RefCell;
use std::ffi::{CString, c_char};
use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// The outcome of a function. `nearmiss_last_error` tells more about all but OK.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub enum Status {
    /// It worked, whatever the verdict.
    Ok = 0,
    /// A pointer is null that must not be.
    Null = 1,
    /// A handle is of another kind, was freed, or is no handle.
    Handle = 2,
    /// An argument is out of range, NaN, or of the wrong size.
    Argument = 3,
    /// The system could not read or write a file.
    Io = 4,
    /// Data are damaged, of another version, or no scan or map.
    Data = 5,
    /// A fault of the library. Please report it.
    Fault = 6,
}

/// A status other than OK, and its message.
#[derive(Debug)]
pub(crate) struct Failure {
    pub(crate) status: Status,
    pub(crate) message: String,
}

impl Failure {
    pub(crate) fn new(status: Status, message: impl Display) -> Self {
        Self { status, message: message.to_string() }
    }

    /// An argument that is out of range.
    #[cold]
    pub(crate) fn argument(message: impl Display) -> Self {
        Self::new(Status::Argument, message)
    }

    /// A pointer that is null.
    #[cold]
    pub(crate) fn null(name: &str) -> Self {
        Self::new(Status::Null, format_args!("expected a pointer for `{name}`, got null"))
    }
}

thread_local! {
    static LAST: RefCell<CString> = RefCell::default();
}

#[cold]
fn keep(failure: Failure) -> Status {
    let Failure { status, mut message } = failure;
    message.retain(|c| c != '\0');
    // A thread that ends keeps no message.
    let _kept = LAST.try_with(|last| *last.borrow_mut() = CString::new(message).unwrap_or_default());
    status
}

/// Runs the body of a function: a failure becomes its status and message, a panic a fault.
#[inline]
pub(crate) fn guard(work: impl FnOnce() -> Result<(), Failure>) -> Status {
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(Ok(())) => Status::Ok,
        Ok(Err(failure)) => keep(failure),
        Err(cause) => {
            let text = cause.downcast_ref::<String>().map(String::as_str);
            let text = text.or_else(|| cause.downcast_ref::<&str>().copied()).unwrap_or("unknown");
            keep(Failure::new(
                Status::Fault,
                format_args!("a fault of the library: {text}; please report it"),
            ))
        }
    }
}

/// Returns the message of the last function that failed on this thread; empty if none did.
///
/// The text is UTF-8 and valid until the next failure on this thread. Thread safety: any thread.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_last_error() -> *const c_char {
    LAST.try_with(|last| last.borrow().as_ptr()).unwrap_or(c"".as_ptr())
}

/// Returns the version of the library, such as "0.1.0". Compare it with `NEARMISS_VERSION`, which is that of
/// the header, before the first other call: structs may differ between versions. Thread safety: any thread.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}
