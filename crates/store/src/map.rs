//! The unsafe calls of this crate: mapping files.

use std::fs;
use std::io;

use crate::bytes::Bytes;

/// Maps a whole file for reading. The file must not be empty.
#[cfg(feature = "mmap")]
#[expect(unsafe_code, reason = "a map is only as steady as its file, which no signature can promise")]
pub(crate) fn map(file: &fs::File) -> io::Result<Bytes> {
    // SAFETY: the map is read-only and lives behind an `Arc` as long as any slice of it. What remains is that
    // nobody changes or shortens the file while it is mapped. This crate never does: it writes a new file and
    // renames it, so the mapped one stays as it is until it is let go. For other programs `File::open` says
    // so, and points to `File::read`. Every value taken from the bytes is plain old data, so no bit pattern
    // is invalid.
    let map = unsafe { memmap2::Mmap::map(file) }?;
    Ok(Bytes::mapped(map))
}

/// Without the feature `mmap` there is nothing to try; the caller reads instead.
#[cfg(not(feature = "mmap"))]
pub(crate) fn map(_file: &fs::File) -> io::Result<Bytes> {
    Err(io::ErrorKind::Unsupported.into())
}

/// A file of one's own, mapped for reading and writing.
#[cfg(feature = "mmap")]
#[derive(Debug)]
pub(crate) struct OwnMap(std::sync::Arc<memmap2::MmapRaw>);

/// The same map, for whoever gives its memory back to the system now and then.
#[cfg(feature = "mmap")]
#[derive(Debug)]
pub(crate) struct Tenant(std::sync::Weak<memmap2::MmapRaw>);

#[cfg(feature = "mmap")]
#[expect(unsafe_code, reason = "memory that is a file")]
impl OwnMap {
    /// Maps a whole file that is not empty, and that nobody else opens.
    pub(crate) fn new(file: &fs::File) -> io::Result<Self> {
        // SAFETY: as for `map`: the file was made by this process in a folder that it holds the lock of, and
        // neither it nor anybody who keeps to the lock changes the file but through this map.
        let map = unsafe { memmap2::MmapMut::map_mut(file) }?;
        Ok(Self(std::sync::Arc::new(map.into())))
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
        Tenant(std::sync::Arc::downgrade(&self.0))
    }
}

#[cfg(feature = "mmap")]
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
        drop(map);
        true
    }
}
