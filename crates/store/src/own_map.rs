//! Mapping a file of one's own for writing: memory that is a file.

use std::fs;
use std::io;
use std::sync::{Arc, Weak};

/// A file of one's own, mapped for reading and writing.
#[derive(Debug)]
pub(crate) struct OwnMap(Arc<memmap2::MmapRaw>);

/// The same map, for whoever gives its memory back to the system now and then.
#[derive(Debug)]
pub(crate) struct Tenant(Weak<memmap2::MmapRaw>);

#[expect(unsafe_code, reason = "memory that is a file")]
impl OwnMap {
    /// Maps a whole file that is not empty, and that nobody else opens.
    pub(crate) fn new(file: &fs::File) -> io::Result<Self> {
        // SAFETY: as for `map`: the file was made by this process in a folder that it holds the lock of, and
        // neither it nor anybody who keeps to the lock changes the file but through this map.
        let map = unsafe { memmap2::MmapMut::map_mut(file) }?;
        // By huge pages, scattered reads would bring in gigabytes between two looks of the warden.
        #[cfg(any(target_os = "linux", target_os = "android"))]
        let _asked = map.advise(memmap2::Advice::NoHugePage);
        Ok(Self(Arc::new(map.into())))
    }

    pub(crate) fn bytes(&self) -> &[u8] {
        // SAFETY: the map lives as long as `self`, and is written through `&mut self` alone.
        unsafe { std::slice::from_raw_parts(self.0.as_ptr(), self.0.len()) }
    }

    pub(crate) fn bytes_mut(&mut self) -> &mut [u8] {
        // SAFETY: as above, and `&mut self` is the only way to these bytes: a `Tenant` reads none.
        unsafe { std::slice::from_raw_parts_mut(self.0.as_mut_ptr(), self.0.len()) }
    }

    pub(crate) fn tenant(&self) -> Tenant {
        Tenant(Arc::downgrade(&self.0))
    }
}

impl Tenant {
    /// Lets the system take the memory back; the content stays in the file. Returns `false` if the map is
    /// gone.
    #[cfg_attr(unix, expect(unsafe_code, reason = "advice that could lose content of other maps"))]
    pub(crate) fn leave(&self) -> bool {
        let Some(map) = self.0.upgrade() else { return false };
        #[cfg(unix)]
        {
            // SAFETY: the map is shared with its file, so what was written stays there, and is read from
            // there again.
            let _asked = unsafe { map.unchecked_advise(memmap2::UncheckedAdvice::DontNeed) };
        }
        // The room may have been dropped meanwhile. Removing a large file takes a while; on this thread, the
        // memory would not be watched until then.
        if let Some(last) = Arc::into_inner(map) {
            let _dropped = std::thread::Builder::new().spawn(move || drop(last));
            return false;
        }
        true
    }
}
