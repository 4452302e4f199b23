//! A guard against panics of third-party decoders.

use std::panic::{AssertUnwindSafe, catch_unwind};

/// Calls `decode` and returns `None` if it panics. Then the data that it has changed must not be
/// used.
pub(crate) fn guarded<T>(decode: impl FnOnce() -> T) -> Option<T> {
    catch_unwind(AssertUnwindSafe(decode)).ok()
}
