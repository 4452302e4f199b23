//! The section table: what lies where, and the checks that let every later read be a plain slice.
//!
//! The layout is canonical: sections stand in table order, each at the first multiple of 64 behind the one
//! before, and the file ends with the padding of the last. So no byte of a file is without an owner, two
//! sections never overlap, and one pass over the table proves both.

use std::collections::BTreeMap;
use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use xxhash_rust::xxh3::xxh3_64;

use crate::error::Fault;
use crate::header::{ALIGN, ENTRY_LEN, HEADER_LEN, Header, align_up};
use crate::id::SectionId;

/// Where a section lies; every value was checked against the file when it was opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Section {
    /// Its name.
    pub id: SectionId,
    /// First byte, counted from the start of the file; a multiple of 64.
    pub offset: u64,
    /// Bytes, a multiple of the element size; padding is not counted.
    pub length: u64,
    /// Bytes of one element, at least 1.
    pub element_size: u32,
    /// xxh3-64 (seed 0) of the section's bytes, as the file states it.
    pub checksum: u64,
}

impl Section {
    /// Number of elements.
    #[must_use]
    pub fn elements(&self) -> u64 {
        self.length / u64::from(self.element_size)
    }

    /// First byte behind the section. Cannot overflow once [`Section::check`] has passed.
    pub(crate) fn end(&self) -> u64 {
        self.offset + self.length
    }

    /// The section's bytes as a range of the file's bytes.
    pub(crate) fn range(&self) -> Range<usize> {
        span(self.offset, self.end())
    }

    /// Checks a table row of a file of `limit` bytes whose next free offset is `expected`.
    fn check(&self, expected: u64, limit: u64) -> Result<(), Fault> {
        let Self { id: section, offset, length, element_size, .. } = *self;
        if element_size == 0 || !length.is_multiple_of(u64::from(element_size)) {
            return Err(Fault::ElementSize { section, element_size, length });
        }
        if !offset.is_multiple_of(ALIGN as u64) {
            return Err(Fault::Misaligned { section, offset });
        }
        if offset.checked_add(length).is_none_or(|end| end > limit) {
            return Err(Fault::OutOfBounds { section, offset, length, limit });
        }
        if offset < expected {
            return Err(Fault::Overlapping { section, offset, taken: expected });
        }
        if offset > expected {
            return Err(Fault::Unclaimed { offset: expected, end: offset });
        }
        Ok(())
    }
}

/// A row of the table as it lies in the file.
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

/// All sections of a file, checked.
#[derive(Debug)]
pub(crate) struct Table {
    /// In file order.
    pub(crate) sections: Vec<Section>,
    positions: BTreeMap<SectionId, usize>,
    /// First byte behind the table itself.
    end: u64,
}

impl Table {
    /// Reads the table of `bytes`, the whole file, whose header was checked against their number.
    ///
    /// Touches the table and nothing behind it; costs O(n log n) for n sections.
    pub(crate) fn parse(header: &Header, bytes: &[u8]) -> Result<Self, Fault> {
        let limit = header.length;
        let end = header.table_end();
        let rows = &bytes[span(HEADER_LEN as u64, end)];
        let computed = xxh3_64(rows);
        if computed != header.table_checksum {
            return Err(Fault::TableChecksum { stored: header.table_checksum, computed });
        }

        let mut table = Self { sections: Vec::new(), positions: BTreeMap::new(), end };
        let mut expected = align_up(end);
        for (position, row) in rows.chunks_exact(size_of::<Entry>()).enumerate() {
            let entry: Entry = bytemuck::pod_read_unaligned(row);
            if entry.reserved != 0 {
                let row = HEADER_LEN + position * size_of::<Entry>();
                return Err(Fault::Padding { offset: (row + std::mem::offset_of!(Entry, reserved)) as u64 });
            }
            let section = Section::from(entry);
            section.check(expected, limit)?;
            expected = align_up(section.end());
            if table.positions.insert(section.id, position).is_some() {
                return Err(Fault::DuplicateSection { section: section.id });
            }
            table.sections.push(section);
        }
        if expected != limit {
            return Err(Fault::Unclaimed { offset: expected, end: limit });
        }
        Ok(table)
    }

    pub(crate) fn find(&self, id: SectionId) -> Option<&Section> {
        self.positions.get(&id).map(|&position| &self.sections[position])
    }

    /// Compares every section with its checksum, and requires zeros between them. Reads the whole file once.
    pub(crate) fn verify(&self, bytes: &[u8]) -> Result<(), Fault> {
        check_padding(bytes, self.end)?;
        for section in &self.sections {
            let computed = xxh3_64(&bytes[section.range()]);
            if computed != section.checksum {
                let (section, offset, stored) = (section.id, section.offset, section.checksum);
                return Err(Fault::Checksum { section, offset, stored, computed });
            }
            check_padding(bytes, section.end())?;
        }
        Ok(())
    }
}

/// Requires zeros from `offset` up to the next multiple of 64.
fn check_padding(bytes: &[u8], offset: u64) -> Result<(), Fault> {
    let padding = &bytes[span(offset, align_up(offset))];
    match padding.iter().zip(offset..).find(|&(&byte, _)| byte != 0) {
        Some((_, offset)) => Err(Fault::Padding { offset }),
        None => Ok(()),
    }
}

/// A range of a file that is in memory.
///
/// The bounds were checked against the number of bytes held, which is a `usize`, so the conversion loses
/// nothing.
#[expect(
    clippy::cast_possible_truncation,
    reason = "both ends are at most the length of a slice, checked at open"
)]
fn span(start: u64, end: u64) -> Range<usize> {
    debug_assert!(usize::try_from(end).is_ok(), "offset {end} was checked against a slice");
    start as usize..end as usize
}

/// Bytes of one `T` as the table states them.
///
/// Refused when compiled: types without a size, and types that ask for more than the 64 bytes of alignment
/// that sections have.
#[expect(clippy::cast_possible_truncation, reason = "asserted in the line above, when compiled")]
pub(crate) const fn element_size<T>() -> u32 {
    const {
        assert!(size_of::<T>() > 0 && size_of::<T>() <= u32::MAX as usize, "elements have a size, a u32");
        assert!(align_of::<T>() <= ALIGN, "sections are aligned to 64 bytes, not more");
        size_of::<T>() as u32
    }
}
