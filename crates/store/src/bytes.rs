//! `Bytes`: the bytes of a container, mapped, read into aligned blocks, or given by the caller.

use std::fmt;
use std::fs;
use std::io::{self, Read};
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

#[cfg(feature = "mmap")]
use crate::own_map::OwnMap;

/// The bytes of a whole container, shared by the [`File`](crate::File) and its
/// [`Array`](crate::Array)s.
///
/// Conversion from a `Vec<u8>`, an `Arc<[u8]>` or a `&'static [u8]` copies nothing. Cloning
/// increments a reference count.
#[derive(Clone)]
pub struct Bytes(Backing);

#[derive(Clone)]
enum Backing {
    #[cfg(feature = "mmap")]
    Mapped(Arc<memmap2::Mmap>),
    #[cfg(feature = "mmap")]
    Own(Arc<OwnMap>),
    /// Aligned blocks. The last block may extend beyond the file, which has `length` bytes.
    Blocks {
        blocks: Arc<Vec<Block>>,
        length: usize,
    },
    Owned(Arc<Vec<u8>>),
    Shared(Arc<[u8]>),
    Static(&'static [u8]),
}

/// Storage with the alignment of sections in the file.
#[repr(C, align(64))]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Block([u8; 64]);

impl Bytes {
    /// Returns the bytes as a slice.
    #[must_use]
    pub fn as_slice(&self) -> &[u8] {
        match &self.0 {
            #[cfg(feature = "mmap")]
            Backing::Mapped(map) => map,
            #[cfg(feature = "mmap")]
            Backing::Own(map) => map.bytes(),
            Backing::Blocks { blocks, length } => &bytemuck::cast_slice(blocks)[..*length],
            Backing::Owned(bytes) => bytes,
            Backing::Shared(bytes) => bytes,
            Backing::Static(bytes) => bytes,
        }
    }

    #[cfg(feature = "mmap")]
    pub(crate) fn mapped(map: memmap2::Mmap) -> Self {
        Self(Backing::Mapped(Arc::new(map)))
    }

    #[cfg(feature = "mmap")]
    pub(crate) fn own(map: OwnMap) -> Self {
        Self(Backing::Own(Arc::new(map)))
    }

    /// Reads `length` bytes into aligned memory, or fewer if the file has become shorter.
    pub(crate) fn read(file: &mut fs::File, length: u64) -> io::Result<Self> {
        let length =
            usize::try_from(length).map_err(|_too_large| io::Error::from(io::ErrorKind::OutOfMemory))?;
        let mut blocks: Vec<Block> = bytemuck::try_zeroed_vec(length.div_ceil(size_of::<Block>()))
            .map_err(|()| io::Error::from(io::ErrorKind::OutOfMemory))?;
        let length = fill(file, &mut bytemuck::cast_slice_mut(&mut blocks)[..length])?;
        Ok(Self(Backing::Blocks { blocks: Arc::new(blocks), length }))
    }
}

/// Reads from `file` until `buffer` is full or the file ends. Returns the number of bytes read.
pub(crate) fn fill(file: &mut fs::File, buffer: &mut [u8]) -> io::Result<usize> {
    let mut filled = 0;
    while filled < buffer.len() {
        match file.read(&mut buffer[filled..]) {
            Ok(0) => break,
            Ok(count) => filled += count,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(filled)
}

impl From<Vec<u8>> for Bytes {
    fn from(bytes: Vec<u8>) -> Self {
        Self(Backing::Owned(Arc::new(bytes)))
    }
}

impl From<Arc<[u8]>> for Bytes {
    fn from(bytes: Arc<[u8]>) -> Self {
        Self(Backing::Shared(bytes))
    }
}

impl From<&'static [u8]> for Bytes {
    fn from(bytes: &'static [u8]) -> Self {
        Self(Backing::Static(bytes))
    }
}

impl fmt::Debug for Bytes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let backing = match &self.0 {
            #[cfg(feature = "mmap")]
            Backing::Mapped(_) => "mapped",
            Backing::Blocks { .. } => "read",
            Backing::Owned(_) | Backing::Shared(_) => "given",
            #[cfg(feature = "mmap")]
            Backing::Own(_) => "own map",
            Backing::Static(_) => "static",
        };
        f.debug_struct("Bytes").field("backing", &backing).field("length", &self.as_slice().len()).finish()
    }
}
