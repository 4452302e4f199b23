//! Errors of opening and writing containers. Each message names the file, the fault, its place and
//! a remedy.

use std::error::Error;
use std::fmt;
use std::io;
use std::ops::RangeInclusive;
use std::path::PathBuf;

use crate::id::SectionId;
use crate::sniff::Looks;
use crate::words::{bytes, counted, plain};

/// Error of opening a container or of taking an array out of it.
#[derive(Debug)]
#[non_exhaustive]
pub struct OpenError {
    /// The file, or the name given to [`OpenError::with_path`]; `None` for bytes in memory.
    pub path: Option<PathBuf>,
    /// The fault.
    pub fault: ContainerFault,
}

impl OpenError {
    /// Names the source of bytes that were in memory, such as an entry of an archive.
    #[must_use]
    pub fn with_path(mut self, path: impl Into<PathBuf>) -> Self {
        self.path = Some(path.into());
        self
    }
}

impl fmt::Display for OpenError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.path {
            Some(path) => write!(f, "{}: {}", path.display(), self.fault),
            None => write!(f, "container in memory: {}", self.fault),
        }
    }
}

/// The message contains the fault's own message, so the source is the fault's source.
impl Error for OpenError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        self.fault.source()
    }
}

/// A fault of a container. Offsets are in bytes from the start of the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ContainerFault {
    /// The operating system reported an error: no such file, permission denied, or a failing disk.
    #[error("{}", io_words(source))]
    Io {
        /// The operating system's error.
        source: io::Error,
    },
    /// A folder, a device or a pipe.
    #[error("expected a file, got {}; name a file", not_a_file(*directory))]
    NotAFile {
        /// `true` for a folder.
        directory: bool,
    },
    /// A file of zero bytes.
    #[error(
        "expected a nearmiss container, got an empty file; copy it again or prepare it with `preprocess`"
    )]
    Empty,
    /// The magic number differs.
    #[error("expected a nearmiss container, got {looks}")]
    NotAContainer {
        /// The likely format of the file.
        looks: Looks,
    },
    /// The bytes of every number are reversed.
    #[error(
        "expected little-endian numbers, got those of a big-endian machine; prepare it again with `preprocess`"
    )]
    ByteOrder,
    /// Header and table have another layout.
    #[error(
        "expected container layout {supported}, got layout {found}; {}",
        if found > supported { "update the program" } else { "prepare it again with `preprocess`" }
    )]
    Layout {
        /// Layout of the file.
        found: u32,
        /// Layout of this crate, [`LAYOUT`](crate::LAYOUT).
        supported: u32,
    },
    /// The container has content of another kind.
    #[error("expected content `{}`, got `{}`; name another file", expected.escape_ascii(), found.escape_ascii())]
    Kind {
        /// Kind of the file.
        found: [u8; 4],
        /// Kind required by the caller.
        expected: [u8; 4],
    },
    /// The caller does not support this version of the content.
    #[error(
        "expected format {}, got version {found}; {}",
        versions(supported),
        if found > supported.end() { "update the program" } else { "prepare it again with `preprocess`" }
    )]
    Version {
        /// Version of the file.
        found: u32,
        /// Versions that the caller supports.
        supported: RangeInclusive<u32>,
    },
    /// The file is shorter than its header states, or than a header.
    #[error("expected {}, got {found} (cut short); copy it again or prepare it again", bytes(expected))]
    Truncated {
        /// Expected length in bytes.
        expected: u64,
        /// Length of the file in bytes.
        found: u64,
    },
    /// The file is longer than its header states.
    #[error("expected {} as in the header, got {found}; copy it again or prepare it again", bytes(expected))]
    TrailingBytes {
        /// Length in the header, in bytes.
        expected: u64,
        /// Length of the file in bytes.
        found: u64,
    },
    /// The length in the header is not a multiple of 64.
    #[error(
        "damaged header: expected a length that is a multiple of 64, got {}; prepare it again",
        bytes(length)
    )]
    RaggedLength {
        /// Length in the header, in bytes.
        length: u64,
    },
    /// The header does not match its checksum.
    #[error(
        "damaged header: expected checksum {stored:016x}, got {computed:016x} (bytes 0 to 64); copy it again or \
         prepare it again"
    )]
    HeaderChecksum {
        /// Checksum in the header.
        stored: u64,
        /// Checksum of the bytes read.
        computed: u64,
    },
    /// The section table does not match its checksum.
    #[error(
        "damaged section table: expected checksum {stored:016x}, got {computed:016x} (byte 64); copy it again or \
         prepare it again"
    )]
    TableChecksum {
        /// Checksum in the header.
        stored: u64,
        /// Checksum of the bytes read.
        computed: u64,
    },
    /// The section table extends beyond the end of the file.
    #[error(
        "damaged header: expected a table within {}, got {} up to byte {end}; prepare it again",
        bytes(length),
        counted(count, "section", "sections")
    )]
    TableOutOfBounds {
        /// Number of sections in the header.
        count: u32,
        /// End of their table.
        end: u64,
        /// Length of the file in bytes.
        length: u64,
    },
    /// Two sections have the same name.
    #[error("damaged section table: expected distinct sections, got {section} twice; prepare it again")]
    DuplicateSection {
        /// Name of both sections.
        section: SectionId,
    },
    /// A section extends beyond the end of the file.
    #[error(
        "damaged section table: expected section {section} within {}, got {} at byte {offset}; prepare it again",
        bytes(limit),
        bytes(length)
    )]
    OutOfBounds {
        /// Name of the section.
        section: SectionId,
        /// Offset of its first byte.
        offset: u64,
        /// Length in bytes.
        length: u64,
        /// Length of the file in bytes.
        limit: u64,
    },
    /// A section does not start at a multiple of 64.
    #[error(
        "damaged section table: expected section {section} at a multiple of 64, got byte {offset}; prepare it again"
    )]
    Misaligned {
        /// Name of the section.
        section: SectionId,
        /// Offset of its first byte.
        offset: u64,
    },
    /// A section starts inside another section, inside the table, or out of order.
    #[error(
        "damaged section table: expected section {section} at byte {taken} or later, got byte {offset}; prepare it \
         again"
    )]
    Overlapping {
        /// Name of the section.
        section: SectionId,
        /// Offset of its first byte.
        offset: u64,
        /// Offset of the first free byte.
        taken: u64,
    },
    /// Some bytes belong to no section.
    #[error(
        "damaged section table: expected a section at byte {offset}, got unused bytes up to byte {end}; prepare it \
         again"
    )]
    Unclaimed {
        /// Offset of the first such byte.
        offset: u64,
        /// Offset of the end of the last such byte.
        end: u64,
    },
    /// The element size is zero, or the length of the section is not a multiple of it.
    #[error(
        "damaged section table: expected whole elements of {} in section {section}, got {}; prepare it again",
        bytes(element_size),
        bytes(length)
    )]
    ElementSize {
        /// Name of the section.
        section: SectionId,
        /// Size of one element in bytes, as in the table.
        element_size: u32,
        /// Length of the section in bytes.
        length: u64,
    },
    /// A byte of padding is not zero.
    #[error(
        "damaged padding: expected zero, got another value (byte {offset}); copy it again or prepare it again"
    )]
    Padding {
        /// Offset of the byte.
        offset: u64,
    },
    /// A section does not match its checksum.
    #[error(
        "damaged section {section}: expected checksum {stored:016x}, got {computed:016x} (byte {offset}); copy it \
         again or prepare it again"
    )]
    Checksum {
        /// Name of the section.
        section: SectionId,
        /// Offset of its first byte.
        offset: u64,
        /// Checksum in the table.
        stored: u64,
        /// Checksum of the bytes read.
        computed: u64,
    },
    /// The container does not have the requested section.
    #[error("section {section} is missing; prepare it again with `preprocess`")]
    MissingSection {
        /// Name of the section.
        section: SectionId,
    },
    /// The elements of a section differ in size from the requested type.
    #[error(
        "expected elements of {} in section {section}, got {found} (byte {offset}); prepare it again with `preprocess`",
        bytes(expected)
    )]
    WrongElementSize {
        /// Name of the section.
        section: SectionId,
        /// Offset of its first byte.
        offset: u64,
        /// Size of the requested type in bytes.
        expected: u32,
        /// Size of a stored element in bytes.
        found: u32,
    },
    /// The metadata do not decode to the requested type.
    #[error("the metadata cannot be decoded (byte {offset}); prepare it again with `preprocess`")]
    Metadata {
        /// Offset of the metadata.
        offset: u64,
        /// The decoder's error.
        source: Box<dyn Error + Send + Sync>,
    },
    /// The metadata section continues after the metadata.
    #[error(
        "expected the metadata to end at byte {offset}, got {} more; prepare it again with `preprocess`",
        bytes(count)
    )]
    MetadataTrailing {
        /// Offset of the first byte left over.
        offset: u64,
        /// Number of bytes left over.
        count: usize,
    },
    /// The metadata section is too long.
    #[error("expected at most {limit} bytes of metadata, got {length} (byte {offset}); prepare it again")]
    MetadataTooLarge {
        /// Offset of the metadata.
        offset: u64,
        /// Length in bytes.
        length: u64,
        /// [`METADATA_LIMIT`](crate::METADATA_LIMIT).
        limit: usize,
    },
}

impl From<io::Error> for ContainerFault {
    fn from(source: io::Error) -> Self {
        Self::Io { source }
    }
}

fn io_words(source: &io::Error) -> String {
    match source.kind() {
        io::ErrorKind::NotFound => "no such file; check the path".to_owned(),
        io::ErrorKind::PermissionDenied => "permission denied; make the file readable".to_owned(),
        io::ErrorKind::OutOfMemory => {
            "the file exceeds the available memory; map it, or close other programs".to_owned()
        }
        _ => format!("cannot read the file ({}); check the disk and try again", plain(source)),
    }
}

fn not_a_file(directory: bool) -> &'static str {
    if directory { "a folder" } else { "a device or pipe" }
}

fn versions(supported: &RangeInclusive<u32>) -> String {
    if supported.start() == supported.end() {
        format!("version {}", supported.start())
    } else {
        format!("versions {} to {}", supported.start(), supported.end())
    }
}

/// Error of writing a container. A file that existed before is unchanged.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The operating system reported an error.
    #[error("{}cannot {step} ({}); {}", name(path.as_ref()), plain(source), step.remedy())]
    Io {
        /// The target; `None` for a stream.
        path: Option<PathBuf>,
        /// The step that failed.
        step: WriteStep,
        /// The operating system's error.
        source: io::Error,
    },
    /// The target is a folder or a device.
    #[error("{}: expected a file, got {}; name a file", path.display(), not_a_file(*directory))]
    NotAFile {
        /// The target.
        path: PathBuf,
        /// `true` for a folder.
        directory: bool,
    },
    /// Two sections have the same name, or the metadata were given twice. Nothing was added.
    #[error("expected distinct sections, got {section} twice; give each part its own number")]
    DuplicateSection {
        /// Name of both sections.
        section: SectionId,
    },
    /// The tag `META` is reserved for the metadata. Nothing was added.
    #[error("expected a tag other than `META`, got section {section}; choose another tag")]
    ReservedTag {
        /// The requested name.
        section: SectionId,
    },
    /// The metadata cannot be encoded.
    #[error(
        "the metadata cannot be encoded; use plain structs, numbers, strings and sequences of known length"
    )]
    Metadata {
        /// The encoder's error.
        source: Box<dyn Error + Send + Sync>,
    },
    /// The metadata are too long. Data that grow with the input belong in a section.
    #[error("expected at most {limit} bytes of metadata, got {length}; put bulk values in a section")]
    MetadataTooLarge {
        /// Encoded length in bytes.
        length: usize,
        /// [`METADATA_LIMIT`](crate::METADATA_LIMIT).
        limit: usize,
    },
    /// The number of sections exceeds `u32`.
    #[error("expected at most {} sections, got {count}; join some", u32::MAX)]
    TooManySections {
        /// Number of sections.
        count: usize,
    },
}

/// A step of replacing a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum WriteStep {
    /// Inspecting the target, following a link.
    Inspect,
    /// Creating the temporary file beside the target.
    Create,
    /// Writing the content.
    Write,
    /// Syncing the content to the disk.
    Sync,
    /// Renaming the temporary file to the target.
    Rename,
}

impl WriteStep {
    fn remedy(self) -> &'static str {
        match self {
            Self::Inspect => "check the path and its permissions",
            Self::Create => "check that the folder exists and is writable",
            Self::Write | Self::Sync => "check the space left on the disk and try again",
            Self::Rename => "close other programs that use the file",
        }
    }
}

/// A verb phrase that completes "cannot …".
impl fmt::Display for WriteStep {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Inspect => "inspect the target",
            Self::Create => "create a file beside the target",
            Self::Write => "write",
            Self::Sync => "sync the file to the disk",
            Self::Rename => "replace the target",
        })
    }
}

fn name(path: Option<&PathBuf>) -> String {
    path.map(|path| format!("{}: ", path.display())).unwrap_or_default()
}
