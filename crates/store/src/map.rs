//! Mapping a file for reading.

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
