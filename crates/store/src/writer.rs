//! `Writer`: writes a container from borrowed sections.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::fmt;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use bytemuck::Pod;
use serde::Serialize;
use xxhash_rust::xxh3::xxh3_64;

use crate::atomic;
use crate::error::{WriteError, WriteStep};
use crate::header::{ALIGN, HEADER_LEN, Header, align_up};
use crate::id::SectionId;
use crate::metadata;
use crate::section::{Entry, Section, element_size};

/// A builder that collects the sections of a container, then writes it.
///
/// The output depends only on the added sections and their order, not on time, file name or
/// machine. Sections are borrowed and never copied. Writing reads them twice, once for the
/// checksums.
#[derive(Debug)]
pub struct Writer<'a> {
    kind: [u8; 4],
    version: u32,
    sections: Vec<Pending<'a>>,
    ids: BTreeSet<SectionId>,
}

struct Pending<'a> {
    id: SectionId,
    element_size: u32,
    bytes: Cow<'a, [u8]>,
}

impl<'a> Writer<'a> {
    /// Creates a writer for content of this kind, in this version of its format.
    /// [`File::expect`](crate::File::expect) checks both.
    #[must_use]
    pub fn new(kind: [u8; 4], version: u32) -> Self {
        Self { kind, version, sections: Vec::new(), ids: BTreeSet::new() }
    }

    /// Adds a section. The file has the sections in the order in which they are added.
    ///
    /// `T` must not be zero-sized, and its alignment must be at most 64 bytes; otherwise the call
    /// does not compile. A section may be empty.
    ///
    /// # Errors
    /// Returns [`WriteError::DuplicateSection`] if `(tag, part)` was used before, and
    /// [`WriteError::ReservedTag`] for `META`.
    pub fn section<T: Pod>(
        &mut self,
        tag: [u8; 4],
        part: u32,
        elements: &'a [T],
    ) -> Result<&mut Self, WriteError> {
        let id = SectionId { tag, part };
        if tag == SectionId::META.tag {
            return Err(WriteError::ReservedTag { section: id });
        }
        self.claim(id)?;
        let bytes = Cow::Borrowed(bytemuck::cast_slice(elements));
        self.sections.push(Pending { id, element_size: element_size::<T>(), bytes });
        Ok(self)
    }

    /// Sets the metadata: one serde value of at most [`METADATA_LIMIT`](crate::METADATA_LIMIT)
    /// bytes when encoded. The metadata are always the first section, so that they share a page
    /// with the table.
    ///
    /// Field names are not stored, so the serde attributes `flatten`, `untagged` and
    /// `skip_serializing_if`, which need them, are not supported.
    ///
    /// # Errors
    /// Returns [`WriteError::DuplicateSection`] if the metadata were set before,
    /// [`WriteError::Metadata`] if the value cannot be encoded, and
    /// [`WriteError::MetadataTooLarge`] if it is too long.
    pub fn metadata(&mut self, value: &impl Serialize) -> Result<&mut Self, WriteError> {
        let bytes = Cow::Owned(metadata::encode(value)?);
        self.claim(SectionId::META)?;
        self.sections.insert(0, Pending { id: SectionId::META, element_size: 1, bytes });
        Ok(self)
    }

    /// Returns the number of bytes that [`Writer::write_to`] would write.
    #[must_use]
    pub fn byte_len(&self) -> u64 {
        self.sections.iter().fold(self.table_end(), |end, section| align_up(end + section.bytes.len() as u64))
    }

    /// Writes the container, flushes, and returns the number of bytes written, a multiple of 64.
    ///
    /// # Errors
    /// Returns [`WriteError::Io`] without a path if `out` fails. The bytes written until then are
    /// not a valid container.
    pub fn write_to(&self, mut out: impl Write) -> Result<u64, WriteError> {
        let (header, table) = self.plan()?;
        self.write_all(&mut out, &header, &table).map_err(|source| WriteError::Io {
            path: None,
            step: WriteStep::Write,
            source,
        })?;
        Ok(header.length)
    }

    /// Writes the container to `path`, atomically replacing an existing file, and returns its
    /// length in bytes.
    ///
    /// The container is written to a temporary file in the same folder, synced, and renamed. The
    /// temporary name is `NAME.tmp-` with twelve random letters and digits. On Unix the folder is
    /// synced too, if its file system supports that. After any failure, `path` is either the
    /// complete old file or the complete new one. A link is followed and stays a link. A folder or
    /// device is rejected. A replaced file keeps its permissions, but not its owner. Programs that
    /// have mapped the old file keep the old bytes; on Windows, a mapped file cannot be replaced.
    ///
    /// A writer that fails removes its temporary file. A killed writer leaves it, and the next save
    /// of the same name removes it: every writer locks its temporary file, and unlocked files of
    /// that pattern are removed. On file systems without locks, none is removed.
    ///
    /// # Errors
    /// Returns [`WriteError::NotAFile`], or [`WriteError::Io`] with the step that failed.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<u64, WriteError> {
        let (header, table) = self.plan()?;
        atomic::replace(path.as_ref(), |file| self.write_all(&mut BufWriter::new(file), &header, &table))?;
        Ok(header.length)
    }

    fn claim(&mut self, id: SectionId) -> Result<(), WriteError> {
        if self.ids.insert(id) { Ok(()) } else { Err(WriteError::DuplicateSection { section: id }) }
    }

    /// Returns the offset of the first section.
    fn table_end(&self) -> u64 {
        align_up((HEADER_LEN + self.sections.len() * size_of::<Entry>()) as u64)
    }

    /// Computes the layout and the checksums.
    fn plan(&self) -> Result<(Header, Vec<Entry>), WriteError> {
        let count = self.sections.len();
        let count = u32::try_from(count).map_err(|_too_large| WriteError::TooManySections { count })?;
        let mut offset = self.table_end();
        let mut table = Vec::with_capacity(self.sections.len());
        for Pending { id, element_size, bytes } in &self.sections {
            let (length, checksum) = (bytes.len() as u64, xxh3_64(bytes));
            table.push(Section { id: *id, offset, length, element_size: *element_size, checksum }.into());
            offset = align_up(offset + length);
        }
        let header = Header::new(self.kind, self.version, count, offset, bytemuck::cast_slice(&table));
        Ok((header, table))
    }

    fn write_all(&self, out: &mut impl Write, header: &Header, table: &[Entry]) -> io::Result<()> {
        out.write_all(bytemuck::bytes_of(header))?;
        write_padded(out, bytemuck::cast_slice(table))?;
        for section in &self.sections {
            write_padded(out, &section.bytes)?;
        }
        out.flush()
    }
}

/// Writes `bytes` and pads them with zeros to a multiple of 64.
fn write_padded(out: &mut impl Write, bytes: &[u8]) -> io::Result<()> {
    const ZEROS: [u8; ALIGN] = [0; ALIGN];
    out.write_all(bytes)?;
    out.write_all(&ZEROS[..bytes.len().next_multiple_of(ALIGN) - bytes.len()])
}

/// Shows all but the bytes: there may be gigabytes.
impl fmt::Debug for Pending<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({} bytes)", self.id, self.bytes.len())
    }
}
