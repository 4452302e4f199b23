//! Opening a container and taking arrays out of it.

use std::fmt;
use std::fs;
use std::io::Seek;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use bytemuck::Pod;
use serde::de::DeserializeOwned;

use crate::array::Array;
use crate::bytes::{Bytes, fill};
use crate::error::{Fault, OpenError};
use crate::header::{HEADER_LEN, Header};
use crate::id::SectionId;
use crate::section::{Section, Table, element_size};
use crate::{map, metadata};

/// How much of a file is checked when it is opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Check {
    /// Everything: structure, the checksum of every section, zeros in the padding. Reads the whole file once.
    #[default]
    Full,
    /// Header and table with their checksums; bounds, alignment, order and element sizes of the sections.
    /// Their contents are neither read nor compared: for files one has written oneself. Some microseconds,
    /// whatever the size.
    Structure,
}

/// An opened container: a table of sections over bytes that are mapped, read or given.
///
/// A clone costs reference counts. Arrays keep the bytes alive; the `File` may be dropped before them.
#[derive(Clone)]
pub struct File {
    bytes: Bytes,
    header: Header,
    table: Arc<Table>,
    path: Option<Arc<Path>>,
}

impl File {
    /// Opens the file at `path` by mapping it, or by reading it where there is no map: without the feature
    /// `mmap`, and on file systems that refuse.
    ///
    /// **While a map is in use the file must not be changed in place or shortened.** Touching a page that is
    /// no longer there ends the process (`SIGBUS`), and changed bytes show through arrays that were checked.
    /// Replacing the file by [`Writer::save`](crate::Writer::save), or by any rename, is harmless on Unix;
    /// Windows refuses it while mapped. Where others may write to the file, use [`File::read`].
    ///
    /// Costs some microseconds with [`Check::Structure`], one pass over the file with [`Check::Full`].
    ///
    /// # Errors
    /// [`OpenError`] if it is not a file, cannot be opened, or fails the checks asked for.
    pub fn open(path: impl AsRef<Path>, check: Check) -> Result<Self, OpenError> {
        Self::from_path(path.as_ref(), check, |file, length| {
            map::map(file).or_else(|_| Bytes::read(file, length)).map_err(Fault::from)
        })
    }

    /// Reads the file at `path` into memory aligned to 64 bytes: what happens to the file later does not
    /// matter.
    ///
    /// Costs the file's length in memory. A file whose header is wrong is refused before that is allocated.
    ///
    /// # Errors
    /// [`OpenError`] if it is not a file, cannot be read, does not fit in memory, or fails the checks asked
    /// for.
    pub fn read(path: impl AsRef<Path>, check: Check) -> Result<Self, OpenError> {
        Self::from_path(path.as_ref(), check, |file, length| Bytes::read(file, length).map_err(Fault::from))
    }

    /// Takes a container that is in memory, say an asset from an archive, without copying it.
    ///
    /// The bytes may have any alignment. Allocators align to 16 bytes or so, enough for elements made of
    /// numbers, which are then used in place; an array whose elements need more is copied by [`File::array`].
    ///
    /// # Errors
    /// [`OpenError`] without a path if the bytes fail the checks asked for; [`OpenError::with_path`] can name
    /// them.
    pub fn from_bytes(bytes: impl Into<Bytes>, check: Check) -> Result<Self, OpenError> {
        Self::assemble(bytes.into(), None, check).map_err(|fault| OpenError { path: None, fault })
    }

    fn from_path(
        path: &Path,
        check: Check,
        load: impl FnOnce(&mut fs::File, u64) -> Result<Bytes, Fault>,
    ) -> Result<Self, OpenError> {
        let attempt = || {
            // Before opening: to open a pipe would wait for its other end.
            let kind = fs::metadata(path)?;
            if !kind.is_file() {
                return Err(Fault::NotAFile { directory: kind.is_dir() });
            }
            let mut file = fs::File::open(path)?;
            let length = file.metadata()?.len();
            let mut head = [0; HEADER_LEN];
            let filled = fill(&mut file, &mut head)?;
            Header::parse(&head[..filled], length)?;
            file.rewind()?;
            let bytes = load(&mut file, length)?;
            Self::assemble(bytes, Some(Arc::from(path)), check)
        };
        attempt().map_err(|fault| OpenError { path: Some(path.to_owned()), fault })
    }

    fn assemble(bytes: Bytes, path: Option<Arc<Path>>, check: Check) -> Result<Self, Fault> {
        let whole = bytes.as_slice();
        let header = Header::parse(whole, whole.len() as u64)?;
        let table = Table::parse(&header, whole)?;
        if check == Check::Full {
            table.verify(whole)?;
        }
        Ok(Self { bytes, header, table: Arc::new(table), path })
    }

    /// Compares every section with its checksum and requires zeros in the padding: what [`Check::Full`] does
    /// beyond [`Check::Structure`]. Reads the whole file once.
    ///
    /// # Errors
    /// [`Fault::Checksum`] names the first section that differs, [`Fault::Padding`] the first byte.
    pub fn verify(&self) -> Result<(), OpenError> {
        self.table.verify(self.bytes.as_slice()).map_err(|fault| self.error(fault))
    }

    /// Requires content of one kind, in a version that the caller reads.
    ///
    /// # Errors
    /// [`Fault::Kind`] or [`Fault::Version`].
    pub fn expect(&self, kind: [u8; 4], versions: RangeInclusive<u32>) -> Result<(), OpenError> {
        if self.kind() != kind {
            return Err(self.error(Fault::Kind { found: self.kind(), expected: kind }));
        }
        if !versions.contains(&self.version()) {
            return Err(self.error(Fault::Version { found: self.version(), supported: versions }));
        }
        Ok(())
    }

    /// The elements of a section, in place: no copy, unless the container was given with an alignment that
    /// does not suit `T` (never for files that were opened or read).
    ///
    /// Only the size of an element is stored; that the section holds `T`s follows from kind and version. `T`
    /// has a size and an alignment of at most 64 bytes, or it does not compile.
    ///
    /// # Errors
    /// [`Fault::MissingSection`], or [`Fault::WrongElementSize`] if the elements have another size than `T`.
    pub fn array<T: Pod>(&self, tag: [u8; 4], part: u32) -> Result<Array<T>, OpenError> {
        let section = self.find(SectionId { tag, part })?;
        let (expected, found) = (element_size::<T>(), section.element_size);
        if found != expected {
            let (section, offset) = (section.id, section.offset);
            return Err(self.error(Fault::WrongElementSize { section, offset, expected, found }));
        }
        Ok(Array::in_place(self.bytes.clone(), section.range()))
    }

    /// The metadata, decoded.
    ///
    /// The type must be the one that was written, field by field: the encoding names none. At most
    /// [`METADATA_LIMIT`](crate::METADATA_LIMIT) bytes are decoded, all of which must be used.
    ///
    /// # Errors
    /// [`Fault::MissingSection`] if none were written, [`Fault::Metadata`], [`Fault::MetadataTrailing`] or
    /// [`Fault::MetadataTooLarge`] if they are not an `M`.
    pub fn metadata<M: DeserializeOwned>(&self) -> Result<M, OpenError> {
        let section = self.find(SectionId::META)?;
        let bytes = &self.bytes.as_slice()[section.range()];
        metadata::decode(bytes, section.offset).map_err(|fault| self.error(fault))
    }

    /// Whether there is such a section.
    #[must_use]
    pub fn has(&self, tag: [u8; 4], part: u32) -> bool {
        self.table.find(SectionId { tag, part }).is_some()
    }

    /// All sections in file order, the metadata first.
    #[must_use]
    pub fn sections(&self) -> &[Section] {
        &self.table.sections
    }

    /// What the content is, as given to [`Writer::new`](crate::Writer::new).
    #[must_use]
    pub fn kind(&self) -> [u8; 4] {
        self.header.kind
    }

    /// The version of the content's format, as given to [`Writer::new`](crate::Writer::new).
    #[must_use]
    pub fn version(&self) -> u32 {
        self.header.version
    }

    /// Length of the whole container in bytes, a multiple of 64.
    #[must_use]
    pub fn byte_len(&self) -> u64 {
        self.header.length
    }

    /// The path it was opened from; `None` for bytes in memory.
    #[must_use]
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    fn find(&self, id: SectionId) -> Result<&Section, OpenError> {
        self.table.find(id).ok_or_else(|| self.error(Fault::MissingSection { section: id }))
    }

    fn error(&self, fault: Fault) -> OpenError {
        OpenError { path: self.path().map(PathBuf::from), fault }
    }
}

/// Without the table, which may be long; [`File::sections`] has it.
impl fmt::Debug for File {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("File")
            .field("path", &self.path)
            .field("kind", &format_args!("`{}`", self.kind().escape_ascii()))
            .field("version", &self.version())
            .field("sections", &self.sections().len())
            .field("bytes", &self.bytes)
            .finish()
    }
}
