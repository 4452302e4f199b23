//! Writing a container: sections are borrowed, hashed, and written where they lie.

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

/// Collects the sections of a container, then writes it.
///
/// The bytes are a function of what was added, in which order, and nothing else: no time, no name, no
/// machine. Sections are borrowed until then and never copied; writing reads them twice, once for the
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
    /// Begins a container of content `kind` in `version` of that content's format; see
    /// [`File::expect`](crate::File::expect) for the other end.
    #[must_use]
    pub fn new(kind: [u8; 4], version: u32) -> Self {
        Self { kind, version, sections: Vec::new(), ids: BTreeSet::new() }
    }

    /// Adds a section. Sections lie in the file in the order in which they are added.
    ///
    /// `T` has a size and an alignment of at most 64 bytes, or it does not compile. An empty slice is a
    /// section too.
    ///
    /// # Errors
    /// [`WriteError::DuplicateSection`] if `(tag, part)` was used, [`WriteError::ReservedTag`] for `META`.
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

    /// Sets the metadata: one serde value of at most [`METADATA_LIMIT`](crate::METADATA_LIMIT) bytes encoded.
    /// It comes first in the file, whenever it is set, so that it shares a page with the table.
    ///
    /// Field names are not stored, so what serde can only read back by name (`flatten`, `untagged`,
    /// `skip_serializing_if`) is out.
    ///
    /// # Errors
    /// [`WriteError::DuplicateSection`] if it was set before, [`WriteError::Metadata`] if the value cannot be
    /// encoded, [`WriteError::MetadataTooLarge`].
    pub fn metadata(&mut self, value: &impl Serialize) -> Result<&mut Self, WriteError> {
        let bytes = Cow::Owned(metadata::encode(value)?);
        self.claim(SectionId::META)?;
        self.sections.insert(0, Pending { id: SectionId::META, element_size: 1, bytes });
        Ok(self)
    }

    /// Length in bytes of what [`Writer::write_to`] would write now.
    #[must_use]
    pub fn byte_len(&self) -> u64 {
        self.sections.iter().fold(self.table_end(), |end, section| align_up(end + section.bytes.len() as u64))
    }

    /// Writes the container, flushes, and returns the number of bytes written, a multiple of 64.
    ///
    /// # Errors
    /// [`WriteError::Io`] without a path if `out` fails; what it has got by then is no valid container.
    pub fn write_to(&self, mut out: impl Write) -> Result<u64, WriteError> {
        let (header, table) = self.plan()?;
        self.write_all(&mut out, &header, &table).map_err(|source| WriteError::Io {
            path: None,
            step: WriteStep::Write,
            source,
        })?;
        Ok(header.length)
    }

    /// Writes the container to `path`, replacing a file that is there in one step, and returns its length in
    /// bytes.
    ///
    /// It is written to `NAME.tmp-` and twelve random letters and digits in the same folder, synced, and
    /// renamed; on Unix the folder is synced too, as far as its file system can. Whatever goes wrong, a file
    /// that was there before is whole, and so is the new one once it bears the name. A link is followed and
    /// stays a link; a folder or device is refused; permissions of a replaced file are kept, ownership is
    /// not. Programs that have the old file mapped keep the old bytes (Windows refuses to replace it
    /// instead).
    ///
    /// A writer that fails removes its temporary file; one that was killed cannot. The next save of the same
    /// name removes what such writers left: files with just that pattern on which no living process holds the
    /// lock that every writer takes. Where the file system knows no locks, none is removed.
    ///
    /// # Errors
    /// [`WriteError::NotAFile`], or [`WriteError::Io`] with the step that failed.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<u64, WriteError> {
        let (header, table) = self.plan()?;
        atomic::replace(path.as_ref(), |file| self.write_all(&mut BufWriter::new(file), &header, &table))?;
        Ok(header.length)
    }

    fn claim(&mut self, id: SectionId) -> Result<(), WriteError> {
        if self.ids.insert(id) { Ok(()) } else { Err(WriteError::DuplicateSection { section: id }) }
    }

    /// Where the first section begins.
    fn table_end(&self) -> u64 {
        align_up((HEADER_LEN + self.sections.len() * size_of::<Entry>()) as u64)
    }

    /// Lays the sections out and hashes them.
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

/// Writes `bytes`, which begin at a multiple of 64, and zeros up to the next.
fn write_padded(out: &mut impl Write, bytes: &[u8]) -> io::Result<()> {
    const ZEROS: [u8; ALIGN] = [0; ALIGN];
    out.write_all(bytes)?;
    out.write_all(&ZEROS[..bytes.len().next_multiple_of(ALIGN) - bytes.len()])
}

/// Without the bytes: there may be gigabytes.
impl fmt::Debug for Pending<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({} bytes)", self.id, self.bytes.len())
    }
}
