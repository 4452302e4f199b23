#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

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
