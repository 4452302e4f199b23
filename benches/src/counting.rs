//! An allocator that counts its calls, the live bytes and their peak.
//!
//! A program or test that needs the counts declares
//! `#[global_allocator] static ALLOCATOR: Counting = Counting::new();`.

#![expect(unsafe_code, reason = "a global allocator cannot be written without")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// The system's allocator with counters. The counts cover the whole process.
#[derive(Debug, Default)]
pub struct Counting {
    calls: AtomicUsize,
    live: AtomicUsize,
    peak: AtomicUsize,
}

impl Counting {
    /// An allocator with all counters at zero.
    #[must_use]
    pub const fn new() -> Self {
        Self { calls: AtomicUsize::new(0), live: AtomicUsize::new(0), peak: AtomicUsize::new(0) }
    }

    /// Allocations so far.
    #[must_use]
    pub fn calls(&self) -> usize {
        self.calls.load(Relaxed)
    }

    /// Bytes allocated and not freed.
    #[must_use]
    pub fn live(&self) -> usize {
        self.live.load(Relaxed)
    }

    /// The most live bytes since [`Counting::restart`].
    #[must_use]
    pub fn peak(&self) -> usize {
        self.peak.load(Relaxed)
    }

    /// Resets the peak to the live bytes.
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

// SAFETY: every call is forwarded to `System` unchanged, whose contract is the trait's; counters
// are atomics and allocate nothing.
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
        // SAFETY: `memory` came from `System` with this layout, as all memory of this allocator
        // does.
        unsafe { System.dealloc(memory, layout) }
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // While the block moves, both may be live. A block that the system grows in place is not
        // counted twice.
        self.grow(size);
        self.shrink(layout.size());
        // SAFETY: as in `dealloc`; the caller keeps the contract of `realloc` for `size`.
        unsafe { System.realloc(memory, layout, size) }
    }
}
