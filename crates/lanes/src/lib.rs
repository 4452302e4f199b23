#![doc = include_str!("../README.md")]

pub mod lane;
pub mod order;
pub mod parallel;
pub mod vector;
pub mod wide;

/// Converts an index to the 32 bits it is stored in. Nothing that is indexed has 2³² or more items.
#[inline(always)]
#[must_use]
#[expect(clippy::cast_possible_truncation, reason = "there are fewer than 2^32")]
pub const fn id32(i: usize) -> u32 {
    i as u32
}

/// Asks the processor to load a value into its caches, without waiting for it. Elsewhere than on x86-64 it
/// does nothing.
#[inline(always)]
#[expect(unsafe_code, reason = "the standard library has no safe function for it")]
pub fn prefetch<T>(value: &T) {
    /// The bytes of a cache line.
    const LINE: usize = 64;
    #[cfg(target_arch = "x86_64")]
    for line in 0..size_of::<T>().div_ceil(LINE) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let place = std::ptr::from_ref(value).cast::<i8>().wrapping_add(line * LINE);
        // SAFETY: a prefetch neither changes memory nor faults, whatever the address.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(place) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = value;
}
