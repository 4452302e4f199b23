//! Writable maps of files that belong to this process: memory backed by a file.

use std::fs;
use std::io;
use std::sync::{Arc, Weak};

/// A writable map of a file that belongs to this process.
#[derive(Debug)]
pub(crate) struct OwnMap(Arc<memmap2::MmapRaw>);

/// A weak handle to a map, which can return the map's memory to the system.
#[derive(Debug)]
pub(crate) struct Tenant(Weak<memmap2::MmapRaw>);

#[expect(unsafe_code, reason = "memory that is a file")]
impl OwnMap {
    /// Maps a whole file. The file must not be empty, and no other process may open it.
    pub(crate) fn new(file: &fs::File) -> io::Result<Self> {
        // SAFETY: as for `map`. The file is in a folder that this process has locked. Neither this
        // process nor any other that respects the lock changes the file, except through this map.
        let map = unsafe { memmap2::MmapMut::map_mut(file) }?;
        // With huge pages, scattered reads would load gigabytes between two checks of the warden.
        #[cfg(any(target_os = "linux", target_os = "android"))]
        let _asked = map.advise(memmap2::Advice::NoHugePage);
        Ok(Self(Arc::new(map.into())))
    }

    pub(crate) fn bytes(&self) -> &[u8] {
        // SAFETY: the map lives as long as `self` and is only written through `&mut self`.
        unsafe { std::slice::from_raw_parts(self.0.as_ptr(), self.0.len()) }
    }

    pub(crate) fn bytes_mut(&mut self) -> &mut [u8] {
        // SAFETY: as above, and `&mut self` is the only access to these bytes: a `Tenant` reads
        // none.
        unsafe { std::slice::from_raw_parts_mut(self.0.as_mut_ptr(), self.0.len()) }
    }

    pub(crate) fn tenant(&self) -> Tenant {
        Tenant(Arc::downgrade(&self.0))
    }
}

impl Tenant {
    /// Returns the memory to the system; the content stays in the file. Returns `false` if the map
    /// no longer exists.
    #[cfg_attr(unix, expect(unsafe_code, reason = "advice that could lose content of other maps"))]
    pub(crate) fn leave(&self) -> bool {
        let Some(map) = self.0.upgrade() else { return false };
        #[cfg(unix)]
        {
            // SAFETY: the map is shared with its file, so written bytes stay in the file and are
            // read from there again.
            let _asked = unsafe { map.unchecked_advise(memmap2::UncheckedAdvice::DontNeed) };
        }
        // The array may have been dropped in the meantime. Removing a large file is slow, and would
        // stop this thread from watching the memory.
        if let Some(last) = Arc::into_inner(map) {
            let _dropped = std::thread::Builder::new().spawn(move || drop(last));
            return false;
        }
        true
    }
}
