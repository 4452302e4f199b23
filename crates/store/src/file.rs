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
use crate::error::{ContainerFault, OpenError};
use crate::header::{HEADER_LEN, Header};
use crate::id::SectionId;
use crate::section::{Section, Table, element_size};
use crate::{map, metadata};

/// The checks made when a file is opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Check {
    /// All checks: the structure, the checksum of every section, and zeros in the padding. Reads
    /// the whole file once.
    #[default]
    Full,
    /// Header and table with their checksums, and bounds, alignment, order and element sizes of the
    /// sections. The contents of sections are not read. For trusted files. Takes some microseconds
    /// for any file size.
    Structure,
}

/// An opened container: a table of sections, and the bytes, which are mapped, read or given.
///
/// Cloning increments reference counts. Arrays keep the bytes alive, so the `File` may be dropped
/// first.
#[derive(Clone)]
pub struct File {
    bytes: Bytes,
    header: Header,
    table: Arc<Table>,
    path: Option<Arc<Path>>,
}

impl File {
    /// Opens the file at `path` by mapping it. Without the feature `mmap`, and on file systems that
    /// cannot map, it is read instead.
    ///
    /// **The file must not be changed in place or shortened while a map is in use.** Access to a
    /// page beyond the new end kills the process (`SIGBUS`), and changed bytes appear in arrays
    /// after their checks. Replacing the file by [`Writer::save`](crate::Writer::save), or by any
    /// rename, is safe on Unix. Windows does not allow it while the file is mapped. If other
    /// programs may write to the file, use [`File::read`].
    ///
    /// Takes some microseconds with [`Check::Structure`], and one pass over the file with
    /// [`Check::Full`].
    ///
    /// # Errors
    /// Returns [`OpenError`] if `path` is not a file, cannot be opened, or fails a check.
    pub fn open(path: impl AsRef<Path>, check: Check) -> Result<Self, OpenError> {
        Self::from_path(path.as_ref(), check, |file, length| {
            map::map(file).or_else(|_| Bytes::read(file, length)).map_err(ContainerFault::from)
        })
    }

    /// Reads the file at `path` into memory aligned to 64 bytes. Later changes to the file have no
    /// effect.
    ///
    /// Allocates as many bytes as the file has, after the header has passed its checks.
    ///
    /// # Errors
    /// Returns [`OpenError`] if `path` is not a file, cannot be read, exceeds the memory, or fails
    /// a check.
    pub fn read(path: impl AsRef<Path>, check: Check) -> Result<Self, OpenError> {
        Self::from_path(path.as_ref(), check, |file, length| {
            Bytes::read(file, length).map_err(ContainerFault::from)
        })
    }

    /// Opens a container in memory, such as an asset from an archive, without copying it.
    ///
    /// The bytes may have any alignment. Allocators usually align to 16 bytes, which suffices to
    /// use numbers in place. [`File::array`] copies an array whose elements need a greater
    /// alignment.
    ///
    /// # Errors
    /// Returns [`OpenError`] without a path if the bytes fail a check. [`OpenError::with_path`]
    /// adds a name.
    pub fn from_bytes(bytes: impl Into<Bytes>, check: Check) -> Result<Self, OpenError> {
        Self::assemble(bytes.into(), None, check).map_err(|fault| OpenError { path: None, fault })
    }

    fn from_path(
        path: &Path,
        check: Check,
        load: impl FnOnce(&mut fs::File, u64) -> Result<Bytes, ContainerFault>,
    ) -> Result<Self, OpenError> {
        let attempt = || {
            // Checked before opening, since opening a pipe blocks until its other end is opened.
            let kind = fs::metadata(path)?;
            if !kind.is_file() {
                return Err(ContainerFault::NotAFile { directory: kind.is_dir() });
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

    fn assemble(bytes: Bytes, path: Option<Arc<Path>>, check: Check) -> Result<Self, ContainerFault> {
        let whole = bytes.as_slice();
        let header = Header::parse(whole, whole.len() as u64)?;
        let table = Table::parse(&header, whole)?;
        if check == Check::Full {
            table.verify(whole)?;
        }
        Ok(Self { bytes, header, table: Arc::new(table), path })
    }

    /// Verifies the checksum of every section and zeros in the padding: the checks of
    /// [`Check::Full`] that [`Check::Structure`] leaves out. Reads the whole file once.
    ///
    /// # Errors
    /// Returns [`ContainerFault::Checksum`] for the first section that differs, or
    /// [`ContainerFault::Padding`] for the first byte.
    pub fn verify(&self) -> Result<(), OpenError> {
        self.table.verify(self.bytes.as_slice()).map_err(|fault| self.error(fault))
    }

    /// Checks the kind and the version of the content.
    ///
    /// # Errors
    /// Returns [`ContainerFault::Kind`] or [`ContainerFault::Version`].
    pub fn expect(&self, kind: [u8; 4], versions: RangeInclusive<u32>) -> Result<(), OpenError> {
        if self.kind() != kind {
            return Err(self.error(ContainerFault::Kind { found: self.kind(), expected: kind }));
        }
        if !versions.contains(&self.version()) {
            return Err(self.error(ContainerFault::Version { found: self.version(), supported: versions }));
        }
        Ok(())
    }

    /// Returns the elements of a section, in place. They are copied only if the container was given
    /// in memory with an alignment that does not suit `T`.
    ///
    /// The file stores the size of an element, but not its type: kind and version imply the type.
    /// `T` must not be zero-sized, and its alignment must be at most 64 bytes; otherwise the call
    /// does not compile.
    ///
    /// # Errors
    /// Returns [`ContainerFault::MissingSection`], or [`ContainerFault::WrongElementSize`] if the
    /// elements differ in size from `T`.
    pub fn array<T: Pod>(&self, tag: [u8; 4], part: u32) -> Result<Array<T>, OpenError> {
        let section = self.find(SectionId { tag, part })?;
        let (expected, found) = (element_size::<T>(), section.element_size);
        if found != expected {
            let (section, offset) = (section.id, section.offset);
            return Err(self.error(ContainerFault::WrongElementSize { section, offset, expected, found }));
        }
        Ok(Array::in_place(self.bytes.clone(), section.range()))
    }

    /// Decodes the metadata.
    ///
    /// `M` must have the same fields, in the same order, as the written type, because the encoding
    /// stores no field names. The metadata have at most [`METADATA_LIMIT`](crate::METADATA_LIMIT)
    /// bytes, and the value must use all of them.
    ///
    /// # Errors
    /// Returns [`ContainerFault::MissingSection`] if there are no metadata. Returns
    /// [`ContainerFault::Metadata`], [`ContainerFault::MetadataTrailing`] or
    /// [`ContainerFault::MetadataTooLarge`] if they do not decode to an `M`.
    pub fn metadata<M: DeserializeOwned>(&self) -> Result<M, OpenError> {
        let section = self.find(SectionId::META)?;
        let bytes = &self.bytes.as_slice()[section.range()];
        metadata::decode(bytes, section.offset).map_err(|fault| self.error(fault))
    }

    /// Returns `true` if the container has this section.
    #[must_use]
    pub fn has(&self, tag: [u8; 4], part: u32) -> bool {
        self.table.find(SectionId { tag, part }).is_some()
    }

    /// Returns all sections in file order, metadata first.
    #[must_use]
    pub fn sections(&self) -> &[Section] {
        &self.table.sections
    }

    /// Returns the kind of the content, as given to [`Writer::new`](crate::Writer::new).
    #[must_use]
    pub fn kind(&self) -> [u8; 4] {
        self.header.kind
    }

    /// Returns the version of the content's format, as given to
    /// [`Writer::new`](crate::Writer::new).
    #[must_use]
    pub fn version(&self) -> u32 {
        self.header.version
    }

    /// Returns the length of the whole container in bytes, a multiple of 64.
    #[must_use]
    pub fn byte_len(&self) -> u64 {
        self.header.length
    }

    /// Returns the path of the file; `None` for bytes in memory.
    #[must_use]
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    fn find(&self, id: SectionId) -> Result<&Section, OpenError> {
        self.table.find(id).ok_or_else(|| self.error(ContainerFault::MissingSection { section: id }))
    }

    fn error(&self, fault: ContainerFault) -> OpenError {
        OpenError { path: self.path().map(PathBuf::from), fault }
    }
}

/// Shows all but the table, which may be long; see [`File::sections`].
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
