//! What can be wrong with a file, and where.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use nearmiss_geometry::CloudError;
use thiserror::Error;

use crate::text::said;

/// Why a file could not be read. The message names the file, what is wrong, where, and what would mend it.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The operating system refused.
    #[error("{}: {cause}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        cause: io::Error,
    },
    /// A directory, pipe or device.
    #[error("{}: not a regular file; name a file that holds points or a mesh", .path.display())]
    NotAFile {
        /// What was named.
        path: PathBuf,
    },
    /// No bytes at all.
    #[error("{}: the file is empty", .path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// Neither content nor name tell the format.
    #[error("{}: unknown format; known are ply, pcd, las, laz, e57, xyz (also csv and other text), npy, obj, stl, off and gltf; say which with `--format`", .path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// A format that is known but cannot be read.
    #[error("{}: this is {format}, which this version cannot read; {}", .path.display(), .format.remedy())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// What it is.
        format: Foreign,
    },
    /// The content breaks the rules of its format.
    #[error("{}: {place}: {fault}", .path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Where.
        place: Place,
        /// What is wrong there.
        fault: Fault,
    },
    /// A mesh was asked for, but the file has no faces.
    #[error("{}: the file has points but no faces; a mesh is needed here", .path.display())]
    NoFaces {
        /// The file.
        path: PathBuf,
    },
    /// Faces on vertices one of which has a NaN or infinite coordinate.
    #[error("{}: vertex {vertex} of a mesh has a coordinate that is not finite; repair it, or remove the faces to use the points alone", .path.display())]
    MeshNotFinite {
        /// The file.
        path: PathBuf,
        /// The first such vertex, counted from 0.
        vertex: usize,
    },
    /// The file is well-formed, but its points make no cloud.
    #[error("{}: {cause}", .path.display())]
    Cloud {
        /// The file.
        path: PathBuf,
        /// Why not.
        cause: CloudError,
    },
}

/// Formats that are recognised in order to say that they cannot be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Foreign {
    /// Compressed by gzip.
    Gzip,
    /// A zip archive.
    Zip,
    /// Text in 16-bit characters.
    Utf16,
}

impl Foreign {
    fn remedy(self) -> &'static str {
        match self {
            Self::Gzip | Self::Zip => "unpack it first",
            Self::Utf16 => "save it as UTF-8",
        }
    }
}

impl fmt::Display for Foreign {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Gzip => "a gzip file",
            Self::Zip => "a zip archive",
            Self::Utf16 => "text in UTF-16",
        })
    }
}

/// Where in a file something is wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// Position in the file.
    pub at: At,
    /// The element there, where the fault belongs to one.
    pub item: Option<Item>,
}

/// A position in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum At {
    /// Line of text, counted from 1.
    Line(u64),
    /// Offset in bytes, counted from 0.
    Byte(u64),
}

/// One of the things a file consists of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Item {
    /// What it is: `vertex`, `face`, `point`, or any other element that a PLY header declares.
    pub element: Box<str>,
    /// Which one, counted from 0.
    pub index: u64,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.at {
            At::Line(line) => write!(f, "line {line}")?,
            At::Byte(byte) => write!(f, "byte {byte}")?,
        }
        match &self.item {
            Some(item) => write!(f, ", {} {}", item.element, item.index),
            None => Ok(()),
        }
    }
}

/// What is wrong at a place of a file.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Fault {
    /// Something else stands where the format wants a certain thing.
    #[error("expected {expected}, found `{found}`")]
    Expected {
        /// What should be there.
        expected: &'static str,
        /// What is there, shortened.
        found: Box<str>,
    },
    /// Numbers where the header should be.
    #[error("numbers instead of a header; if its lines are points, read it with `--format xyz`")]
    NoHeader,
    /// The file ends within its header.
    #[error("the header never ends: no line `{keyword}`; the file is cut off or not what its start says")]
    HeaderNeverEnds {
        /// What would have ended it.
        keyword: &'static str,
    },
    /// The header lacks something that cannot be guessed.
    #[error("the header does not declare {what}")]
    Undeclared {
        /// What is missing.
        what: &'static str,
    },
    /// The header names the same thing twice.
    #[error("`{name}` is declared twice")]
    Repeated {
        /// What.
        name: Box<str>,
    },
    /// A header line of a PCD file that must have one entry for each field.
    #[error("{keyword} has {entries} entries for {fields} fields")]
    FieldEntries {
        /// The line.
        keyword: &'static str,
        /// How many entries it has.
        entries: usize,
        /// How many fields there are.
        fields: usize,
    },
    /// A field of a type that holds no coordinate.
    #[error(
        "field `{field}` has type {kind} and size {size}; readable are F 4, F 8, and I or U of size 1, 2, 4, 8"
    )]
    FieldType {
        /// The field.
        field: Box<str>,
        /// Its TYPE entry.
        kind: Box<str>,
        /// Its SIZE entry, in bytes.
        size: u64,
    },
    /// Width, height and number of points of a PCD file contradict each other.
    #[error("{points} points declared, but width {width} times height {height} is another number")]
    Grid {
        /// WIDTH.
        width: u64,
        /// HEIGHT.
        height: u64,
        /// POINTS.
        points: u64,
    },
    /// A value that must be a number is none.
    #[error("`{found}` in column `{column}` is not a number")]
    NotANumber {
        /// Name of the column.
        column: Box<str>,
        /// What stands there, shortened.
        found: Box<str>,
    },
    /// A length of a list, or an index, that is no whole number.
    #[error("`{found}` is not {expected}")]
    NotWhole {
        /// What it should be.
        expected: &'static str,
        /// What stands there, shortened.
        found: Box<str>,
    },
    /// A line of text has too few values.
    #[error("the line ends before column `{column}`")]
    ShortLine {
        /// The first column without a value.
        column: Box<str>,
    },
    /// A line of text has more values than columns are declared.
    #[error("the line has more values than the header declares columns")]
    LongLine,
    /// The header promises more elements than the file holds.
    #[error(
        "{promised} of `{element}` promised, but the file holds {present}; it is cut off, or this count is wrong"
    )]
    Promised {
        /// Name of the element.
        element: Box<str>,
        /// How many the header promises.
        promised: u64,
        /// How many complete ones there are.
        present: u64,
    },
    /// Text goes on after everything that the header promises.
    #[error("text after the last element; the header promises too few, or the file is damaged")]
    Surplus,
    /// A list says that it is longer than the rest of the file.
    #[error("a list of {values} values does not fit into the {left} bytes left")]
    ListPastEnd {
        /// Values in the list.
        values: u64,
        /// Bytes from here to the end of the file.
        left: u64,
    },
    /// The file ends within an element.
    #[error("the file ends here, within an element")]
    PastEnd,
    /// A face names a vertex that is not there.
    #[error("the face names vertex {vertex}, but there are {vertices}, counted from {first}")]
    NoSuchVertex {
        /// The vertex it names, as written.
        vertex: i64,
        /// How many vertices there are.
        vertices: u64,
        /// Number of the first vertex, by the rules of the format: 0 or 1.
        first: u8,
    },
    /// A face with fewer than three corners.
    #[error("the face has {corners} corners; at least 3 are needed")]
    FewCorners {
        /// How many it has.
        corners: usize,
    },
    /// The length of compressed data does not fit the points that the header declares.
    #[error("compressed data declare {declared} bytes unpacked, but the header's points take {needed}")]
    UnpackedSize {
        /// Length after decompression, as declared.
        declared: u64,
        /// Length that the header's fields and points take.
        needed: u64,
    },
    /// Compressed data that would take very much memory for their length.
    #[error(
        "{packed} compressed bytes are to give {points} points, far more than scans give; if that is right, save the \
         file with `DATA binary`"
    )]
    Expansion {
        /// Points that the header declares.
        points: u64,
        /// Bytes of the compressed data.
        packed: u64,
    },
    /// A foreign decoder refused the data.
    #[error("the data are damaged: {}", said(cause))]
    Decoder {
        /// What it said.
        cause: Box<str>,
    },
    /// A format that this build was made without.
    #[error("{what} cannot be read by this build; build nearmiss-io with the feature `{feature}`")]
    Feature {
        /// The format.
        what: &'static str,
        /// What it needs.
        feature: &'static str,
    },
    /// Compressed data that do not decompress to their declared length.
    #[error("the compressed data are corrupt")]
    Corrupt,
}

/// A fault and its place; the file's name is added where it is known.
#[derive(Debug)]
pub(crate) struct Broken {
    pub(crate) place: Place,
    pub(crate) fault: Fault,
}

impl Fault {
    /// The fault, on a line.
    pub(crate) fn on_line(self, line: u64) -> Broken {
        self.at(At::Line(line))
    }

    /// The fault, at a byte.
    pub(crate) fn at_byte(self, byte: usize) -> Broken {
        self.at(At::Byte(byte as u64))
    }

    /// The fault, at a position.
    pub(crate) fn at(self, at: At) -> Broken {
        Broken { place: Place { at, item: None }, fault: self }
    }
}

impl Broken {
    /// The same, saying to which element it belongs.
    pub(crate) fn within(mut self, element: &str, index: u64) -> Self {
        self.place.item = Some(Item { element: element.into(), index });
        self
    }

    /// As the fault of this file.
    pub(crate) fn of(self, path: &Path) -> ReadError {
        let Self { place, fault } = self;
        ReadError::Malformed { path: path.into(), place, fault }
    }
}
