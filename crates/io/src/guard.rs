//! Decoders of other people, whose panics must not be ours.

use std::panic::{AssertUnwindSafe, catch_unwind};

/// What `decode` returns, or `None` if it panics. Nothing that it has changed may be used then.
pub(crate) fn guarded<T>(decode: impl FnOnce() -> T) -> Option<T> {
    catch_unwind(AssertUnwindSafe(decode)).ok()
}
