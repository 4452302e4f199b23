//! The section table and its checks. Once they have passed, every read is a plain slice.
//!
//! The layout is canonical: sections follow in table order, each at the first multiple of 64 after
//! the previous one, and the file ends with the padding of the last. One pass over the table proves
//! that sections do not overlap and that every byte belongs to a section, its padding, the table or
//! the header.

use std::collections::BTreeMap;
use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use xxhash_rust::xxh3::xxh3_64;

use crate::error::ContainerFault;
use crate::header::{ALIGN, ENTRY_LEN, HEADER_LEN, Header, align_up};
use crate::id::SectionId;

/// A row of the section table. All values were checked when the file was opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Section {
    /// Name of the section.
    pub id: SectionId,
    /// Offset of the first byte from the start of the file; a multiple of 64.
    pub offset: u64,
    /// Length in bytes without padding; a multiple of the element size.
    pub length: u64,
    /// Size of one element in bytes, at least 1.
    pub element_size: u32,
    /// xxh3-64 (seed 0) of the section's bytes, as stored in the table.
    pub checksum: u64,
}

impl Section {
    /// Returns the number of elements.
    #[must_use]
    pub fn elements(&self) -> u64 {
        self.length / u64::from(self.element_size)
    }

    /// Returns the offset of the end of the section. Cannot overflow once [`Section::check`] has
    /// passed.
    pub(crate) fn end(&self) -> u64 {
        self.offset + self.length
    }

    /// Returns the range of the section's bytes in the file.
    pub(crate) fn range(&self) -> Range<usize> {
        span(self.offset, self.end())
    }

    /// Checks a row of the table. The file has `limit` bytes, and the section must start at
    /// `expected`.
    fn check(&self, expected: u64, limit: u64) -> Result<(), ContainerFault> {
        let Self { id: section, offset, length, element_size, .. } = *self;
        if element_size == 0 || !length.is_multiple_of(u64::from(element_size)) {
            return Err(ContainerFault::ElementSize { section, element_size, length });
        }
        if !offset.is_multiple_of(ALIGN as u64) {
            return Err(ContainerFault::Misaligned { section, offset });
        }
        if offset.checked_add(length).is_none_or(|end| end > limit) {
            return Err(ContainerFault::OutOfBounds { section, offset, length, limit });
        }
        if offset < expected {
            return Err(ContainerFault::Overlapping { section, offset, taken: expected });
        }
        if offset > expected {
            return Err(ContainerFault::Unclaimed { offset: expected, end: offset });
        }
        Ok(())
    }
}

/// A row of the table as stored in the file.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Entry {
    tag: [u8; 4],
    part: u32,
    offset: u64,
    length: u64,
    element_size: u32,
    reserved: u32,
    checksum: u64,
}

const _: () = assert!(size_of::<Entry>() == ENTRY_LEN, "a table row is 40 bytes on disk");

impl From<Section> for Entry {
    fn from(section: Section) -> Self {
        let Section { id: SectionId { tag, part }, offset, length, element_size, checksum } = section;
        Self { tag, part, offset, length, element_size, reserved: 0, checksum }
    }
}

impl From<Entry> for Section {
    fn from(entry: Entry) -> Self {
        let Entry { tag, part, offset, length, element_size, reserved: _, checksum } = entry;
        Self { id: SectionId { tag, part }, offset, length, element_size, checksum }
    }
}

/// The checked section table of a file.
#[derive(Debug)]
pub(crate) struct Table {
    /// In file order.
    pub(crate) sections: Vec<Section>,
    positions: BTreeMap<SectionId, usize>,
    /// Offset of the end of the table.
    end: u64,
}

impl Table {
    /// Reads the table from `bytes`, the whole file. `header` must have been checked against their
    /// length.
    ///
    /// Reads no byte after the table. Takes O(n log n) time for n sections.
    pub(crate) fn parse(header: &Header, bytes: &[u8]) -> Result<Self, ContainerFault> {
        let limit = header.length;
        let end = header.table_end();
        let rows = &bytes[span(HEADER_LEN as u64, end)];
        let computed = xxh3_64(rows);
        if computed != header.table_checksum {
            return Err(ContainerFault::TableChecksum { stored: header.table_checksum, computed });
        }

        let mut table = Self { sections: Vec::new(), positions: BTreeMap::new(), end };
        let mut expected = align_up(end);
        for (position, row) in rows.chunks_exact(size_of::<Entry>()).enumerate() {
            let entry: Entry = bytemuck::pod_read_unaligned(row);
            if entry.reserved != 0 {
                let row = HEADER_LEN + position * size_of::<Entry>();
                return Err(ContainerFault::Padding {
                    offset: (row + std::mem::offset_of!(Entry, reserved)) as u64,
                });
            }
            let section = Section::from(entry);
            section.check(expected, limit)?;
            expected = align_up(section.end());
            if table.positions.insert(section.id, position).is_some() {
                return Err(ContainerFault::DuplicateSection { section: section.id });
            }
            table.sections.push(section);
        }
        if expected != limit {
            return Err(ContainerFault::Unclaimed { offset: expected, end: limit });
        }
        Ok(table)
    }

    pub(crate) fn find(&self, id: SectionId) -> Option<&Section> {
        self.positions.get(&id).map(|&position| &self.sections[position])
    }

    /// Checks the checksum of every section, and zeros in the padding. Reads the whole file once.
    pub(crate) fn verify(&self, bytes: &[u8]) -> Result<(), ContainerFault> {
        check_padding(bytes, self.end)?;
        for section in &self.sections {
            let computed = xxh3_64(&bytes[section.range()]);
            if computed != section.checksum {
                let (section, offset, stored) = (section.id, section.offset, section.checksum);
                return Err(ContainerFault::Checksum { section, offset, stored, computed });
            }
            check_padding(bytes, section.end())?;
        }
        Ok(())
    }
}

/// Checks for zeros from `offset` up to the next multiple of 64.
fn check_padding(bytes: &[u8], offset: u64) -> Result<(), ContainerFault> {
    let padding = &bytes[span(offset, align_up(offset))];
    match padding.iter().zip(offset..).find(|&(&byte, _)| byte != 0) {
        Some((_, offset)) => Err(ContainerFault::Padding { offset }),
        None => Ok(()),
    }
}

/// Converts offsets to a range of a slice.
///
/// Both were checked against the length of the slice, a `usize`, so the conversion is exact.
#[expect(
    clippy::cast_possible_truncation,
    reason = "both ends are at most the length of a slice, checked at open"
)]
fn span(start: u64, end: u64) -> Range<usize> {
    debug_assert!(usize::try_from(end).is_ok(), "offset {end} was checked against a slice");
    start as usize..end as usize
}

/// Returns the size of `T` in bytes, as stored in the table.
///
/// Does not compile for zero-sized types, nor for types whose alignment exceeds the 64 bytes of
/// sections.
#[expect(clippy::cast_possible_truncation, reason = "asserted in the line above, when compiled")]
pub(crate) const fn element_size<T>() -> u32 {
    const {
        assert!(size_of::<T>() > 0 && size_of::<T>() <= u32::MAX as usize, "elements have a size, a u32");
        assert!(align_of::<T>() <= ALIGN, "sections are aligned to 64 bytes, not more");
        size_of::<T>() as u32
    }
}
