//! The header: the first 64 bytes of a container, with its layout, kind, version and length.
//!
//! The header has a checksum of itself, so its length and section count are verified before the
//! table is read. It also has a checksum of the section table, which follows it.

use bytemuck::{Pod, Zeroable};
use xxhash_rust::xxh3::xxh3_64;

use crate::error::ContainerFault;
use crate::sniff::Looks;

/// The layout number that this crate writes and reads. It defines the header, the table and the
/// padding.
///
/// The caller defines the content of the sections, with its own kind and version; see
/// [`File::expect`](crate::File::expect).
pub const LAYOUT: u32 = 1;

/// The magic number. The first byte is not ASCII, so no text file starts like this. The `\r\n`
/// reveals a transfer that translated line ends.
pub(crate) const MAGIC: [u8; 8] = *b"\x8Enmiss\r\n";

/// Alignment of sections in bytes: one cache line, enough for every SIMD load.
pub(crate) const ALIGN: usize = 64;

/// Length of the header in bytes.
pub(crate) const HEADER_LEN: usize = 64;

/// Length of a row of the table in bytes.
pub(crate) const ENTRY_LEN: usize = 40;

/// Number of header bytes that its checksum covers: all bytes before the checksum.
const SEALED: usize = HEADER_LEN - size_of::<u64>();

/// The header as stored in the file.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Header {
    magic: [u8; 8],
    layout: u32,
    pub(crate) kind: [u8; 4],
    pub(crate) version: u32,
    pub(crate) count: u32,
    /// Length of the whole file in bytes, a multiple of [`ALIGN`].
    pub(crate) length: u64,
    /// xxh3-64 of the section table.
    pub(crate) table_checksum: u64,
    reserved: [u8; 16],
    /// xxh3-64 of the 56 bytes before the checksum.
    checksum: u64,
}

const _: () = assert!(size_of::<Header>() == HEADER_LEN, "the header is 64 bytes on disk");

impl Header {
    /// Creates a header for a table of `count` sections, with its checksum.
    pub(crate) fn new(kind: [u8; 4], version: u32, count: u32, length: u64, table: &[u8]) -> Self {
        let mut header = Self {
            magic: MAGIC,
            layout: LAYOUT,
            kind,
            version,
            count,
            length,
            table_checksum: xxh3_64(table),
            reserved: [0; 16],
            checksum: 0,
        };
        header.checksum = header.seal();
        header
    }

    /// Reads and checks the header of a file of `found` bytes. `head` is the whole file, or at
    /// least its first 64 bytes.
    pub(crate) fn parse(head: &[u8], found: u64) -> Result<Self, ContainerFault> {
        let start = &head[..head.len().min(MAGIC.len())];
        if start.is_empty() {
            return Err(ContainerFault::Empty);
        }
        if !MAGIC.starts_with(start) {
            return Err(if start.iter().eq(MAGIC.iter().rev()) {
                ContainerFault::ByteOrder
            } else {
                ContainerFault::NotAContainer { looks: Looks::of(head) }
            });
        }
        let Some(bytes) = head.get(..HEADER_LEN) else {
            return Err(ContainerFault::Truncated { expected: HEADER_LEN as u64, found });
        };
        let header: Self = bytemuck::pod_read_unaligned(bytes);
        if header.layout == LAYOUT.swap_bytes() {
            return Err(ContainerFault::ByteOrder);
        }
        // The layout is checked before the checksum, because another layout may have the checksum
        // elsewhere.
        if header.layout != LAYOUT {
            return Err(ContainerFault::Layout { found: header.layout, supported: LAYOUT });
        }
        header.check(found)?;
        Ok(header)
    }

    /// Checks all fields except magic and layout.
    fn check(&self, found: u64) -> Result<(), ContainerFault> {
        let computed = self.seal();
        if computed != self.checksum {
            return Err(ContainerFault::HeaderChecksum { stored: self.checksum, computed });
        }
        if self.reserved != [0; 16] {
            return Err(ContainerFault::Padding { offset: std::mem::offset_of!(Self, reserved) as u64 });
        }
        if found < self.length {
            return Err(ContainerFault::Truncated { expected: self.length, found });
        }
        if found > self.length {
            return Err(ContainerFault::TrailingBytes { expected: self.length, found });
        }
        if !self.length.is_multiple_of(ALIGN as u64) {
            return Err(ContainerFault::RaggedLength { length: self.length });
        }
        if self.table_end() > self.length {
            return Err(ContainerFault::TableOutOfBounds {
                count: self.count,
                end: self.table_end(),
                length: self.length,
            });
        }
        Ok(())
    }

    /// Returns the offset of the end of the table. Cannot overflow, as the count is a `u32`.
    pub(crate) fn table_end(&self) -> u64 {
        HEADER_LEN as u64 + u64::from(self.count) * ENTRY_LEN as u64
    }

    fn seal(&self) -> u64 {
        xxh3_64(&bytemuck::bytes_of(self)[..SEALED])
    }
}

/// Rounds `offset` up to a multiple of [`ALIGN`].
pub(crate) fn align_up(offset: u64) -> u64 {
    offset.next_multiple_of(ALIGN as u64)
}
