//! Mapping a file for reading.

use std::fs;
use std::io;

use crate::bytes::Bytes;

/// Maps a whole file for reading. The file must not be empty.
#[cfg(feature = "mmap")]
#[expect(unsafe_code, reason = "a map is only as steady as its file, which no signature can promise")]
pub(crate) fn map(file: &fs::File) -> io::Result<Bytes> {
    // SAFETY: the map is read-only, and an `Arc` keeps it alive as long as any slice of it. The
    // file must not be changed or shortened while it is mapped. This crate never does so: it writes
    // a new file and renames it, so the mapped file stays unchanged. For other programs,
    // `File::open` documents the requirement and points to `File::read`. All values are plain old
    // data, so no bit pattern is invalid.
    let map = unsafe { memmap2::Mmap::map(file) }?;
    Ok(Bytes::mapped(map))
}

/// Fails, as there are no maps without the feature `mmap`. The caller reads the file instead.
#[cfg(not(feature = "mmap"))]
pub(crate) fn map(_file: &fs::File) -> io::Result<Bytes> {
    Err(io::ErrorKind::Unsupported.into())
}
