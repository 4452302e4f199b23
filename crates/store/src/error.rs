//! What can go wrong, as values: which file, what is wrong, where, and what would mend it.

use std::error::Error;
use std::fmt;
use std::io;
use std::ops::RangeInclusive;
use std::path::PathBuf;

use crate::id::SectionId;
use crate::sniff::Looks;

/// A container could not be opened, or does not hold what was asked of it.
#[derive(Debug)]
#[non_exhaustive]
pub struct OpenError {
    /// The file, or whatever name [`OpenError::with_path`] gave; `None` for bytes in memory.
    pub path: Option<PathBuf>,
    /// What is wrong with it.
    pub fault: Fault,
}

impl OpenError {
    /// Names the source of bytes that were in memory, say an entry of an archive.
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

/// The fault's words are already in the message, so the chain goes on behind it.
impl Error for OpenError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        self.fault.source()
    }
}

/// What is wrong with a container. Offsets are bytes from its start.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Fault {
    /// The operating system refused: no such file, no permission, or a failing disk.
    #[error("{}", io_words(source))]
    Io {
        /// Its answer.
        source: io::Error,
    },
    /// A folder, a device or a pipe.
    #[error("is {}, not a file; name a file", if *directory { "a folder" } else { "a device or pipe" })]
    NotAFile {
        /// Whether it is a folder.
        directory: bool,
    },
    /// No bytes at all.
    #[error("is empty; copy it again or prepare it with `preprocess`")]
    Empty,
    /// The first bytes are not those of a container.
    #[error("is not a prepared container, it {looks}")]
    NotAContainer {
        /// What they look like instead.
        looks: Looks,
    },
    /// Written with the bytes of every number reversed.
    #[error("was written on a big-endian machine; prepare it again on this one with `preprocess`")]
    ByteOrder,
    /// Header and table of another layout.
    #[error(
        "has container layout {found}, this program reads layout {supported}; {}",
        if found > supported { "update the program" } else { "prepare it again with `preprocess`" }
    )]
    Layout {
        /// The file's.
        found: u32,
        /// This crate's, [`LAYOUT`](crate::LAYOUT).
        supported: u32,
    },
    /// A container, but not of what was asked for.
    #[error("holds `{}`, expected `{}`; name another file", found.escape_ascii(), expected.escape_ascii())]
    Kind {
        /// The file's.
        found: [u8; 4],
        /// The one asked for.
        expected: [u8; 4],
    },
    /// Content of a version that the caller does not read.
    #[error(
        "has format version {found}, this program reads {}; {}",
        versions(supported),
        if found > supported.end() { "update the program" } else { "prepare it again with `preprocess`" }
    )]
    Version {
        /// The file's.
        found: u32,
        /// Those the caller reads.
        supported: RangeInclusive<u32>,
    },
    /// Shorter than its header says, or than a header.
    #[error("is cut short: {found} of {expected} bytes are there; copy it again or prepare it again")]
    Truncated {
        /// Bytes that ought to be there.
        expected: u64,
        /// Bytes that are.
        found: u64,
    },
    /// Longer than its header says.
    #[error("has {found} bytes where its header says {expected}; copy it again or prepare it again")]
    TrailingBytes {
        /// Bytes that ought to be there.
        expected: u64,
        /// Bytes that are.
        found: u64,
    },
    /// The header states a length that no writer makes.
    #[error("is damaged: its header states {length} bytes, not a multiple of 64; prepare it again")]
    RaggedLength {
        /// As stated.
        length: u64,
    },
    /// The first 64 bytes do not match their checksum.
    #[error(
        "is damaged: bytes 0 to 64, the header, do not match their checksum; copy it again or prepare it again"
    )]
    HeaderChecksum {
        /// As stated in the header.
        stored: u64,
        /// Of the bytes found.
        computed: u64,
    },
    /// The section table does not match its checksum.
    #[error(
        "is damaged: the section table at byte 64 does not match its checksum; copy it again or prepare it again"
    )]
    TableChecksum {
        /// As stated in the header.
        stored: u64,
        /// Of the bytes found.
        computed: u64,
    },
    /// More sections than the file has room to list.
    #[error("is damaged: a table of {count} sections would end at byte {end} of {length}; prepare it again")]
    TableOutOfBounds {
        /// Sections as stated in the header.
        count: u32,
        /// Where their table would end.
        end: u64,
        /// Where the file ends.
        length: u64,
    },
    /// Two sections with one name.
    #[error("is damaged: section {section} is listed twice; prepare it again")]
    DuplicateSection {
        /// Their name.
        section: SectionId,
    },
    /// The table points outside the file.
    #[error(
        "is damaged: section {section} of {length} bytes at byte {offset} leaves the file of {limit} bytes; \
         prepare it again"
    )]
    OutOfBounds {
        /// Which.
        section: SectionId,
        /// Its first byte.
        offset: u64,
        /// Its bytes.
        length: u64,
        /// Bytes of the file.
        limit: u64,
    },
    /// A section does not begin at a multiple of 64.
    #[error("is damaged: section {section} at byte {offset} is not aligned to 64 bytes; prepare it again")]
    Misaligned {
        /// Which.
        section: SectionId,
        /// Its first byte.
        offset: u64,
    },
    /// A section begins inside another, inside the table, or out of order.
    #[error(
        "is damaged: section {section} at byte {offset} overlaps what ends at byte {taken}; prepare it again"
    )]
    Overlapping {
        /// Which.
        section: SectionId,
        /// Its first byte.
        offset: u64,
        /// First byte that was free.
        taken: u64,
    },
    /// Bytes that belong to no section.
    #[error("is damaged: bytes {offset} to {end} belong to no section; prepare it again")]
    Unclaimed {
        /// The first.
        offset: u64,
        /// The one behind the last.
        end: u64,
    },
    /// Elements without a size, or a section that ends inside one.
    #[error(
        "is damaged: section {section} of {length} bytes cannot hold elements of {element_size}; prepare it again"
    )]
    ElementSize {
        /// Which.
        section: SectionId,
        /// Bytes of one element as stated.
        element_size: u32,
        /// Bytes of the section.
        length: u64,
    },
    /// A byte that is always zero is not.
    #[error("is damaged: byte {offset} is padding and ought to be zero; copy it again or prepare it again")]
    Padding {
        /// Where.
        offset: u64,
    },
    /// A section does not match its checksum.
    #[error(
        "is damaged: section {section} at byte {offset} does not match its checksum; copy it again or prepare it again"
    )]
    Checksum {
        /// Which.
        section: SectionId,
        /// Its first byte.
        offset: u64,
        /// As stated in the table.
        stored: u64,
        /// Of the bytes found.
        computed: u64,
    },
    /// A section that was asked for is not there.
    #[error("has no section {section}; prepare it again with `preprocess`")]
    MissingSection {
        /// Which.
        section: SectionId,
    },
    /// A section holds elements of another size than those asked for.
    #[error(
        "holds elements of {found} bytes in section {section} at byte {offset}, expected {expected}; prepare it again \
         with `preprocess`"
    )]
    WrongElementSize {
        /// Which.
        section: SectionId,
        /// Its first byte.
        offset: u64,
        /// Bytes of the element asked for.
        expected: u32,
        /// Bytes of an element as stored.
        found: u32,
    },
    /// The metadata are not what was asked for.
    #[error("has metadata at byte {offset} that cannot be decoded; prepare it again with `preprocess`")]
    Metadata {
        /// Where they begin.
        offset: u64,
        /// What the decoder says.
        source: Box<dyn Error + Send + Sync>,
    },
    /// The metadata are followed by more bytes in their section.
    #[error(
        "has {count} bytes too many at byte {offset}, behind the metadata; prepare it again with `preprocess`"
    )]
    MetadataTrailing {
        /// First byte left over.
        offset: u64,
        /// How many.
        count: usize,
    },
    /// The metadata section is longer than any that is written.
    #[error("has {length} bytes of metadata at byte {offset}, at most {limit} are allowed; prepare it again")]
    MetadataTooLarge {
        /// Where they begin.
        offset: u64,
        /// Bytes.
        length: u64,
        /// [`METADATA_LIMIT`](crate::METADATA_LIMIT).
        limit: usize,
    },
}

impl From<io::Error> for Fault {
    fn from(source: io::Error) -> Self {
        Self::Io { source }
    }
}

fn io_words(source: &io::Error) -> String {
    match source.kind() {
        io::ErrorKind::NotFound => "no such file; check the path".to_owned(),
        io::ErrorKind::PermissionDenied => "may not be read; change its permissions".to_owned(),
        io::ErrorKind::OutOfMemory => {
            "does not fit in memory; map it instead, or close other programs".to_owned()
        }
        kind => format!("cannot be read ({kind}); check the disk and try again"),
    }
}

fn versions(supported: &RangeInclusive<u32>) -> String {
    if supported.start() == supported.end() {
        format!("version {}", supported.start())
    } else {
        format!("versions {} to {}", supported.start(), supported.end())
    }
}

/// A container could not be written. The file that was there before, if any, is as it was.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The operating system refused.
    #[error("{}cannot {step} ({}); {}", name(path.as_ref()), source.kind(), step.remedy())]
    Io {
        /// The file to be written; `None` where the caller gave a stream.
        path: Option<PathBuf>,
        /// What was being done.
        step: WriteStep,
        /// Its answer.
        source: io::Error,
    },
    /// The target is a folder or a device.
    #[error("{}: is {}, not a file; name a file", path.display(), if *directory { "a folder" } else { "a device or pipe" })]
    NotAFile {
        /// The target.
        path: PathBuf,
        /// Whether it is a folder.
        directory: bool,
    },
    /// Two sections with one name, or metadata given twice; nothing was added.
    #[error("section {section} was added twice; give each part its own number")]
    DuplicateSection {
        /// Their name.
        section: SectionId,
    },
    /// The tag `META` belongs to the metadata; nothing was added.
    #[error("section {section} would bear the tag of the metadata; choose another tag")]
    ReservedTag {
        /// The name asked for.
        section: SectionId,
    },
    /// The metadata cannot be represented.
    #[error(
        "the metadata cannot be encoded; use plain structs, numbers, strings and sequences of known length"
    )]
    Metadata {
        /// What the encoder says.
        source: Box<dyn Error + Send + Sync>,
    },
    /// The metadata are too long; what grows with the data belongs in a section.
    #[error("the metadata take {length} bytes, at most {limit} are allowed; put bulk values in a section")]
    MetadataTooLarge {
        /// Bytes encoded.
        length: usize,
        /// [`METADATA_LIMIT`](crate::METADATA_LIMIT).
        limit: usize,
    },
    /// More sections than the header can count.
    #[error("{count} sections are more than the {} a container can list; join some", u32::MAX)]
    TooManySections {
        /// How many were added.
        count: usize,
    },
}

/// What a writer was doing when it failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum WriteStep {
    /// Looking at the target, following a link.
    Inspect,
    /// Making the temporary file beside the target.
    Create,
    /// Writing bytes.
    Write,
    /// Waiting until they are on the disk.
    Sync,
    /// Putting the finished file in the target's place.
    Rename,
}

impl WriteStep {
    fn remedy(self) -> &'static str {
        match self {
            Self::Inspect => "check the path and its permissions",
            Self::Create => "check that the folder exists and may be written to",
            Self::Write | Self::Sync => "check the space left and try again",
            Self::Rename => "check that no other program holds the file",
        }
    }
}

/// Completes "cannot …".
impl fmt::Display for WriteStep {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Inspect => "look at the target",
            Self::Create => "create a file beside the target",
            Self::Write => "write",
            Self::Sync => "bring the bytes to the disk",
            Self::Rename => "put the finished file in place",
        })
    }
}

fn name(path: Option<&PathBuf>) -> String {
    path.map(|path| format!("{}: ", path.display())).unwrap_or_default()
}
