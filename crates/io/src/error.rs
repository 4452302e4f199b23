//! Errors of reading a file: the fault, its place, and a remedy.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use nearmiss_geometry::CloudError;
use thiserror::Error;

use crate::format::Format;
use crate::text::{bytes, counted, io_words, said};

/// Error of reading a file. The message names the file, the fault, its place and a remedy.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The operating system reported an error.
    #[error("{}: {}", .path.display(), io_words(cause))]
    Io {
        /// The file.
        path: PathBuf,
        /// The operating system's error.
        cause: io::Error,
    },
    /// A folder, pipe or device.
    #[error(
        "{}: expected a regular file, got a folder, pipe or device; name a file with points or a mesh",
        .path.display()
    )]
    NotAFile {
        /// The path.
        path: PathBuf,
    },
    /// A file of zero bytes.
    #[error("{}: expected points or a mesh, got an empty file; export it again", .path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// Neither the content nor the name identifies the format.
    #[error(
        "{}: expected {}, got an unknown format; if it is one of these, name it with `preprocess --format`",
        .path.display(), Format::list()
    )]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// A known format that cannot be read.
    #[error("{}: expected points or a mesh, got {format}; {}", .path.display(), .format.remedy())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// The format.
        format: Foreign,
    },
    /// The content violates its format.
    #[error("{}: {place}: {fault}", .path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Place of the fault.
        place: Place,
        /// The fault.
        fault: Fault,
    },
    /// The caller requires a mesh, but the file has no faces.
    #[error("{}: expected a mesh, got points without faces; name a file with faces", .path.display())]
    NoFaces {
        /// The file.
        path: PathBuf,
    },
    /// The file has faces, and a vertex with a NaN or infinite coordinate.
    #[error(
        "{}: expected finite coordinates in a mesh, got NaN or infinity (vertex {vertex}); repair it, or remove the \
         faces to use the points alone",
        .path.display()
    )]
    MeshNotFinite {
        /// The file.
        path: PathBuf,
        /// Index of the first such vertex, counted from 0.
        vertex: usize,
    },
    /// The file is well-formed, but its points are not a valid cloud.
    #[error("{}: {cause}", .path.display())]
    Cloud {
        /// The file.
        path: PathBuf,
        /// The cloud's error.
        cause: CloudError,
    },
}

/// A format that is recognised, but cannot be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Foreign {
    /// A file compressed by gzip.
    Gzip,
    /// A zip archive.
    Zip,
    /// Text in UTF-16.
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

/// The place of a fault in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// Position in the file.
    pub at: At,
    /// The element at this position, if the fault belongs to one.
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

/// An element of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Item {
    /// Kind of the element: `vertex`, `face`, `point`, or any other element of a PLY header.
    pub element: Box<str>,
    /// Index of the element, counted from 0.
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

/// A violation of a file format.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Fault {
    /// A word or value other than the format requires.
    #[error("expected {expected}, got `{found}`")]
    Expected {
        /// Required content.
        expected: &'static str,
        /// Content of the file, shortened.
        found: Box<str>,
    },
    /// Numbers in place of the header.
    #[error("expected a header, got numbers; if the lines are points, read the file with `--format xyz`")]
    NoHeader,
    /// The file ends within its header.
    #[error("expected `{keyword}` at the end of the header, got the end of the file; export the file again")]
    HeaderNeverEnds {
        /// Keyword of the last line of the header.
        keyword: &'static str,
    },
    /// A required declaration is missing in the header.
    #[error("expected {what} in the header, got none")]
    Undeclared {
        /// The missing declaration.
        what: &'static str,
    },
    /// The header declares the same name twice.
    #[error("expected one `{name}`, got two; remove one of them")]
    Repeated {
        /// The name.
        name: Box<str>,
    },
    /// A header line of a PCD file whose number of entries differs from the number of fields.
    #[error(
        "expected {} in {keyword}, one for each field, got {entries}",
        counted(fields, "entry", "entries")
    )]
    FieldEntries {
        /// Keyword of the line.
        keyword: &'static str,
        /// Number of entries.
        entries: usize,
        /// Number of fields.
        fields: usize,
    },
    /// A PCD field of an unsupported type.
    #[error(
        "expected type F of 4 or 8 bytes, or I or U of 1, 2, 4 or 8 bytes, for field `{field}`, got {kind} of {}",
        bytes(size)
    )]
    FieldType {
        /// Name of the field.
        field: Box<str>,
        /// TYPE of the field.
        kind: Box<str>,
        /// SIZE of the field, in bytes.
        size: u64,
    },
    /// WIDTH × HEIGHT of a PCD file differs from POINTS.
    #[error("expected POINTS to equal WIDTH × HEIGHT, {width} × {height}, got {points}")]
    Grid {
        /// WIDTH.
        width: u64,
        /// HEIGHT.
        height: u64,
        /// POINTS.
        points: u64,
    },
    /// A word that is not a number.
    #[error("expected a number in column `{column}`, got `{found}`")]
    NotANumber {
        /// Name of the column.
        column: Box<str>,
        /// The word, shortened.
        found: Box<str>,
    },
    /// A list length or an index that is not a whole number.
    #[error("expected {expected} (a whole number), got `{found}`")]
    NotWhole {
        /// Meaning of the number.
        expected: &'static str,
        /// The word, shortened.
        found: Box<str>,
    },
    /// A line of text has fewer values than columns.
    #[error("expected a value in column `{column}`, got the end of the line")]
    ShortLine {
        /// The first column without a value.
        column: Box<str>,
    },
    /// A line of text has more values than columns.
    #[error("expected one value for each column of the header, got more")]
    LongLine,
    /// The header declares more elements than the file contains.
    #[error(
        "expected {}, got {present}; the file is cut off, or this count is wrong",
        counted(promised, &format!("`{element}` element"), &format!("`{element}` elements"))
    )]
    Promised {
        /// Name of the element.
        element: Box<str>,
        /// Number of elements in the header.
        promised: u64,
        /// Number of complete elements in the file.
        present: u64,
    },
    /// Text continues after the last element of the header.
    #[error(
        "expected the end of the file after the last element, got more text; correct the count in the header"
    )]
    Surplus,
    /// A list is longer than the rest of the file.
    #[error(
        "expected a list that fits into the {} left, got {}",
        bytes(left),
        counted(values, "value", "values")
    )]
    ListPastEnd {
        /// Number of values in the list.
        values: u64,
        /// Bytes up to the end of the file.
        left: u64,
    },
    /// The file ends within an element.
    #[error("expected the rest of an element, got the end of the file")]
    PastEnd,
    /// A face refers to a missing vertex.
    #[error("{}, got {vertex}", vertex_range(*vertex, *vertices, *first))]
    NoSuchVertex {
        /// Index of the vertex, as written.
        vertex: i64,
        /// Number of vertices.
        vertices: u64,
        /// Index of the first vertex in this format: 0 or 1.
        first: u8,
    },
    /// A face with fewer than three corners.
    #[error("expected at least 3 corners of the face, got {corners}")]
    FewCorners {
        /// Number of corners.
        corners: usize,
    },
    /// The declared length of compressed data does not match the points of the header.
    #[error("expected {} of unpacked data for the points of the header, got {declared}", bytes(needed))]
    UnpackedSize {
        /// Declared length after decompression, in bytes.
        declared: u64,
        /// Length of the fields and points of the header, in bytes.
        needed: u64,
    },
    /// Compressed data that would take very much memory for their length.
    #[error(
        "expected the compressed points of a scan, got {} from {}, an implausible ratio; if it is right, save the \
         file with `DATA binary`",
        counted(points, "point", "points"),
        bytes(packed)
    )]
    Expansion {
        /// Number of points in the header.
        points: u64,
        /// Length of the compressed data in bytes.
        packed: u64,
    },
    /// A third-party decoder rejected the data.
    #[error("cannot decode the data: {}", said(cause))]
    Decoder {
        /// The decoder's message.
        cause: Box<str>,
    },
    /// A format whose feature is disabled in this build.
    #[error("this build cannot read {what}; enable the feature `{feature}` of nearmiss-io")]
    Feature {
        /// The format.
        what: &'static str,
        /// The feature that the format requires.
        feature: &'static str,
    },
    /// Compressed data that do not decompress to their declared length.
    #[error("cannot decompress the data; export the file again")]
    Corrupt,
}

/// Describes the valid indices of vertices. In OBJ, where the first is 1, negative indices count
/// from the end.
fn vertex_range(vertex: i64, vertices: u64, first: u8) -> String {
    match (vertices, first) {
        (0, _) => "expected vertices before the face".to_owned(),
        (_, 1) if vertex < 0 => format!("expected a vertex index from -{vertices} to -1"),
        _ => format!("expected a vertex index from {first} to {}", vertices - 1 + u64::from(first)),
    }
}

/// A fault and its place, without the name of the file.
#[derive(Debug)]
pub(crate) struct Broken {
    pub(crate) place: Place,
    pub(crate) fault: Fault,
}

impl Fault {
    /// Places the fault on a line.
    pub(crate) fn on_line(self, line: u64) -> Broken {
        self.at(At::Line(line))
    }

    /// Places the fault at a byte.
    pub(crate) fn at_byte(self, byte: usize) -> Broken {
        self.at(At::Byte(byte as u64))
    }

    /// Places the fault at a position.
    pub(crate) fn at(self, at: At) -> Broken {
        Broken { place: Place { at, item: None }, fault: self }
    }
}

impl Broken {
    /// Adds the element that the fault belongs to.
    pub(crate) fn within(mut self, element: &str, index: u64) -> Self {
        self.place.item = Some(Item { element: element.into(), index });
        self
    }

    /// Adds the name of the file.
    pub(crate) fn of(self, path: &Path) -> ReadError {
        let Self { place, fault } = self;
        ReadError::Malformed { path: path.into(), place, fault }
    }
}
