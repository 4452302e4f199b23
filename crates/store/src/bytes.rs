//! What may stand behind a file in memory: a map, aligned blocks, or bytes that the caller holds.

use std::fmt;
use std::fs;
use std::io::{self, Read};
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

#[cfg(feature = "mmap")]
use crate::own_map::OwnMap;

/// Bytes of a whole container, shared by the [`File`](crate::File) and every [`Array`](crate::Array) made
/// from it.
///
/// Made from a `Vec<u8>`, an `Arc<[u8]>` or a `&'static [u8]` without copying them. A clone costs a reference
/// count.
#[derive(Clone)]
pub struct Bytes(Backing);

#[derive(Clone)]
enum Backing {
    #[cfg(feature = "mmap")]
    Mapped(Arc<memmap2::Mmap>),
    #[cfg(feature = "mmap")]
    Own(Arc<OwnMap>),
    /// The last block may be longer than the file: `length` counts.
    Blocks {
        blocks: Arc<Vec<Block>>,
        length: usize,
    },
    Owned(Arc<Vec<u8>>),
    Shared(Arc<[u8]>),
    Static(&'static [u8]),
}

/// Storage with the alignment that sections have in the file.
#[repr(C, align(64))]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Block([u8; 64]);

impl Bytes {
    /// The bytes themselves.
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

    /// Reads at most `length` bytes into aligned memory; fewer where the file became shorter meanwhile.
    pub(crate) fn read(file: &mut fs::File, length: u64) -> io::Result<Self> {
        let length =
            usize::try_from(length).map_err(|_too_large| io::Error::from(io::ErrorKind::OutOfMemory))?;
        let mut blocks: Vec<Block> = bytemuck::try_zeroed_vec(length.div_ceil(size_of::<Block>()))
            .map_err(|()| io::Error::from(io::ErrorKind::OutOfMemory))?;
        let length = fill(file, &mut bytemuck::cast_slice_mut(&mut blocks)[..length])?;
        Ok(Self(Backing::Blocks { blocks: Arc::new(blocks), length }))
    }
}

/// Fills `buffer` as far as `file` reaches and says how far that was.
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
