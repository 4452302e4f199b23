//! The first 64 bytes of a container: who wrote it, how long it is, where the table ends.
//!
//! The header carries a checksum of itself, so that its length and count can be believed before anything they
//! point at is read, and a checksum of the section table behind it.

use bytemuck::{Pod, Zeroable};
use xxhash_rust::xxh3::xxh3_64;

use crate::error::Fault;
use crate::sniff::Looks;

/// Layout number that this crate writes and reads: the meaning of the header, the table and the padding.
///
/// What the sections mean is the caller's; it has its own kind and version, see
/// [`File::expect`](crate::File::expect).
pub const LAYOUT: u32 = 1;

/// Not ASCII in the first byte, so no text file begins like this; `\r\n` shows a transfer that changed line
/// ends.
pub(crate) const MAGIC: [u8; 8] = *b"\x8Enmiss\r\n";

/// Sections begin at multiples of this many bytes: one cache line, and enough for every SIMD load.
pub(crate) const ALIGN: usize = 64;

/// The header's length in bytes, also its alignment unit.
pub(crate) const HEADER_LEN: usize = 64;

/// The length in bytes of a row of the table.
pub(crate) const ENTRY_LEN: usize = 40;

/// Bytes of the header that its own checksum covers: all before the checksum.
const SEALED: usize = HEADER_LEN - size_of::<u64>();

/// The header as it lies in the file.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Header {
    magic: [u8; 8],
    layout: u32,
    pub(crate) kind: [u8; 4],
    pub(crate) version: u32,
    pub(crate) count: u32,
    /// Bytes of the whole file, a multiple of [`ALIGN`].
    pub(crate) length: u64,
    /// xxh3-64 of the section table.
    pub(crate) table_checksum: u64,
    reserved: [u8; 16],
    /// xxh3-64 of the 56 bytes before it.
    checksum: u64,
}

const _: () = assert!(size_of::<Header>() == HEADER_LEN, "the header is 64 bytes on disk");

impl Header {
    /// A sealed header for a table of `count` sections.
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

    /// Reads and checks the header of a file of `found` bytes that begins with `head`: the whole file, or its
    /// first 64 bytes where it has as many.
    pub(crate) fn parse(head: &[u8], found: u64) -> Result<Self, Fault> {
        let start = &head[..head.len().min(MAGIC.len())];
        if start.is_empty() {
            return Err(Fault::Empty);
        }
        if !MAGIC.starts_with(start) {
            return Err(if start.iter().eq(MAGIC.iter().rev()) {
                Fault::ByteOrder
            } else {
                Fault::NotAContainer { looks: Looks::of(head) }
            });
        }
        let Some(bytes) = head.get(..HEADER_LEN) else {
            return Err(Fault::Truncated { expected: HEADER_LEN as u64, found });
        };
        let header: Self = bytemuck::pod_read_unaligned(bytes);
        if header.layout == LAYOUT.swap_bytes() {
            return Err(Fault::ByteOrder);
        }
        // The layout comes before the checksum: another layout may well keep its checksum elsewhere.
        if header.layout != LAYOUT {
            return Err(Fault::Layout { found: header.layout, supported: LAYOUT });
        }
        header.check(found)?;
        Ok(header)
    }

    /// Everything but magic and layout.
    fn check(&self, found: u64) -> Result<(), Fault> {
        let computed = self.seal();
        if computed != self.checksum {
            return Err(Fault::HeaderChecksum { stored: self.checksum, computed });
        }
        if self.reserved != [0; 16] {
            return Err(Fault::Padding { offset: std::mem::offset_of!(Self, reserved) as u64 });
        }
        if found < self.length {
            return Err(Fault::Truncated { expected: self.length, found });
        }
        if found > self.length {
            return Err(Fault::TrailingBytes { expected: self.length, found });
        }
        if !self.length.is_multiple_of(ALIGN as u64) {
            return Err(Fault::RaggedLength { length: self.length });
        }
        if self.table_end() > self.length {
            return Err(Fault::TableOutOfBounds {
                count: self.count,
                end: self.table_end(),
                length: self.length,
            });
        }
        Ok(())
    }

    /// Offset of the first byte behind the table; cannot overflow, as the count is a `u32`.
    pub(crate) fn table_end(&self) -> u64 {
        HEADER_LEN as u64 + u64::from(self.count) * ENTRY_LEN as u64
    }

    fn seal(&self) -> u64 {
        xxh3_64(&bytemuck::bytes_of(self)[..SEALED])
    }
}

/// The least multiple of [`ALIGN`] that is not below `offset`.
pub(crate) fn align_up(offset: u64) -> u64 {
    offset.next_multiple_of(ALIGN as u64)
}
