//! An allocator that counts: how often, how much is live, and the most that was.
//!
//! A program or test that wants the figures declares
//! `#[global_allocator] static ALLOCATOR: Counting = Counting::new();`.

#![expect(unsafe_code, reason = "a global allocator cannot be written without")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// The system's allocator with counters. Counts are of the whole process.
#[derive(Debug, Default)]
pub struct Counting {
    calls: AtomicUsize,
    live: AtomicUsize,
    peak: AtomicUsize,
}

impl Counting {
    /// With all counters at zero.
    #[must_use]
    pub const fn new() -> Self {
        Self { calls: AtomicUsize::new(0), live: AtomicUsize::new(0), peak: AtomicUsize::new(0) }
    }

    /// Calls so far that asked for memory.
    #[must_use]
    pub fn calls(&self) -> usize {
        self.calls.load(Relaxed)
    }

    /// Bytes asked for and not given back.
    #[must_use]
    pub fn live(&self) -> usize {
        self.live.load(Relaxed)
    }

    /// The most bytes that were live since [`Counting::restart`].
    #[must_use]
    pub fn peak(&self) -> usize {
        self.peak.load(Relaxed)
    }

    /// Forgets the peak: it is now what is live.
    pub fn restart(&self) {
        self.peak.store(self.live(), Relaxed);
    }

    fn grow(&self, bytes: usize) {
        self.calls.fetch_add(1, Relaxed);
        let live = self.live.fetch_add(bytes, Relaxed) + bytes;
        self.peak.fetch_max(live, Relaxed);
    }

    fn shrink(&self, bytes: usize) {
        self.live.fetch_sub(bytes, Relaxed);
    }
}

// SAFETY: every call is handed to `System` unchanged, whose contract is the trait's; counters are atomics and
// allocate nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        self.grow(layout.size());
        // SAFETY: the caller keeps the contract of `alloc`, which is the same for `System`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        self.grow(layout.size());
        // SAFETY: as in `alloc`.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        self.shrink(layout.size());
        // SAFETY: `memory` came from `System` with this layout, for all of ours does.
        unsafe { System.dealloc(memory, layout) }
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // While it moves both blocks may be live; the system may also grow in place, which is not counted
        // twice.
        self.grow(size);
        self.shrink(layout.size());
        // SAFETY: as in `dealloc`; `size` is the caller's, who keeps the contract of `realloc`.
        unsafe { System.realloc(memory, layout, size) }
    }
}
