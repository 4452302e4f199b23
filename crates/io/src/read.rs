//! Reading of whole files, from disk or memory.

use std::fs::{self, File};
use std::io::Read;
use std::ops::ControlFlow;
use std::path::Path;

use nearmiss_geometry::TriangleMesh;

#[cfg(feature = "e57")]
use crate::e57;
#[cfg(not(all(feature = "e57", feature = "gltf")))]
use crate::error::Fault;
use crate::error::ReadError;
use crate::format::Format;
#[cfg(feature = "gltf")]
use crate::gltf;
use crate::input::{Input, Stop};
use crate::points::Points;
use crate::recognise::recognise;
use crate::selection::Selection;
use crate::sink::{Model, Sink};
use crate::{las, npy, obj, off, pcd, ply, stl, xyz};

/// Reads the points of a file, and its triangles if it has faces.
///
/// Without a `format`, the format is recognised by the content, then by the name. LAS, LAZ and E57
/// are read in blocks; other files are in memory as a whole while they are read. Further
/// allocations are bounded by the length of the file, not by counts in its header. They are some
/// tens of bytes for each byte of the file. Compressed data may take 128 bytes for each byte, plus
/// 128 MiB.
///
/// # Errors
/// Fails if the file cannot be read or is invalid. The error names the file, the fault and its
/// place. Never panics, whatever the content.
pub fn read(path: impl AsRef<Path>, format: Option<Format>) -> Result<Model, ReadError> {
    let path = path.as_ref();
    load(path, format)?.into_model(path)
}

/// Like [`read`], for content in memory. `name` is used in messages, and to recognise the format.
///
/// # Errors
/// Fails like [`read`], except for I/O errors.
pub fn read_bytes(bytes: &[u8], format: Option<Format>, name: impl AsRef<Path>) -> Result<Model, ReadError> {
    let name = name.as_ref();
    parse(bytes, format, name)?.into_model(name)
}

/// Reads only the triangles of a file. Unlike a cloud, a mesh may have fewer than eight vertices.
///
/// # Errors
/// Fails like [`read`], or if the file has no faces.
pub fn read_mesh(path: impl AsRef<Path>, format: Option<Format>) -> Result<TriangleMesh, ReadError> {
    let path = path.as_ref();
    let no_faces = || ReadError::NoFaces { path: path.into() };
    load(path, format)?.into_mesh(path)?.ok_or_else(no_faces)
}

/// Like [`read_mesh`], for content in memory.
///
/// # Errors
/// Fails like [`read_mesh`], except for I/O errors.
pub fn read_mesh_bytes(
    bytes: &[u8],
    format: Option<Format>,
    name: impl AsRef<Path>,
) -> Result<TriangleMesh, ReadError> {
    let name = name.as_ref();
    let no_faces = || ReadError::NoFaces { path: name.into() };
    parse(bytes, format, name)?.into_mesh(name)?.ok_or_else(no_faces)
}

/// Recognises the format of a file by its first 64 KiB, then by its name.
///
/// # Errors
/// Fails if the file cannot be read, is empty, or has an unsupported format.
pub fn format_of(path: impl AsRef<Path>) -> Result<Format, ReadError> {
    let path = path.as_ref();
    check_file(path)?;
    let mut file = File::open(path).map_err(|cause| ReadError::Io { path: path.into(), cause })?;
    Start::of(&mut file, None, path).map(|start| start.format)
}

/// The byte order mark of UTF-8, which some programs write at the start of text.
pub(crate) const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Checks that `path` is a regular file. Done before opening, since opening a pipe blocks until its
/// other end is opened.
pub(crate) fn check_file(path: &Path) -> Result<(), ReadError> {
    match fs::metadata(path).map_err(|cause| ReadError::Io { path: path.into(), cause })?.is_file() {
        true => Ok(()),
        false => Err(ReadError::NotAFile { path: path.into() }),
    }
}

/// Reads and parses a file.
fn load(path: &Path, format: Option<Format>) -> Result<Sink, ReadError> {
    check_file(path)?;
    let failed = |cause| ReadError::Io { path: path.into(), cause };
    let mut file = File::open(path).map_err(failed)?;
    let start = Start::of(&mut file, format, path)?;
    if start.format.is_streamed() {
        return collect(start.format, Input::File(&file), path);
    }
    let mut bytes = start.head;
    file.read_to_end(&mut bytes).map_err(failed)?;
    parse_as(start.format, &bytes[start.mark..], path)
}

/// The start of a file, and its format.
pub(crate) struct Start {
    /// The first 64 KiB, or the whole file if it is shorter.
    pub(crate) head: Vec<u8>,
    /// Length of the byte order mark in bytes.
    pub(crate) mark: usize,
    /// Length of the file in bytes.
    pub(crate) length: u64,
    pub(crate) format: Format,
}

/// Number of bytes read to recognise the format. Files with longer headers are not read in pieces.
const HEAD: u64 = 1 << 16;

impl Start {
    /// Reads the start of a file, and leaves the file positioned after it.
    pub(crate) fn of(file: &mut File, format: Option<Format>, path: &Path) -> Result<Self, ReadError> {
        let failed = |cause| ReadError::Io { path: path.into(), cause };
        let length = file.metadata().map_err(failed)?.len();
        let mut head = Vec::new();
        file.take(HEAD).read_to_end(&mut head).map_err(failed)?;
        let mark = if head.starts_with(BYTE_ORDER_MARK) { BYTE_ORDER_MARK.len() } else { 0 };
        if head.len() == mark {
            return Err(ReadError::Empty { path: path.into() });
        }
        let format = match format {
            Some(format) => format,
            None => recognise(&head[mark..], length - mark as u64, path)?,
        };
        Ok(Self { head, mark, length, format })
    }
}

/// Passes the points of a [streamed](Format::is_streamed) format to `take`, about `block` bytes at
/// a time.
pub(crate) fn stream(
    format: Format,
    input: Input<'_>,
    (block, selection): (usize, &Selection),
    path: &Path,
    take: &mut dyn FnMut(&Points) -> ControlFlow<()>,
) -> Result<(), ReadError> {
    let done = match format {
        Format::Las => las::each(input, block, selection, take),
        #[cfg(feature = "e57")]
        Format::E57 => e57::each(input, block, take),
        #[cfg(not(feature = "e57"))]
        Format::E57 => Err(Fault::Feature { what: "E57", feature: "e57" }.at_byte(0).into()),
        _ => Ok(()),
    };
    done.map_err(|stop: Stop| stop.of(path))
}

/// Reads all points of a streamed format.
fn collect(format: Format, input: Input<'_>, path: &Path) -> Result<Sink, ReadError> {
    const BLOCK: usize = 1 << 20;
    let mut sink = Sink::default();
    stream(format, input, (BLOCK, &Selection::default()), path, &mut |points| {
        sink.append(points);
        ControlFlow::Continue(())
    })?;
    with_scanners(sink, format, input, path)
}

/// Adds the positions of the scanners, which only E57 has.
pub(crate) fn with_scanners(
    sink: Sink,
    format: Format,
    input: Input<'_>,
    path: &Path,
) -> Result<Sink, ReadError> {
    #[cfg(feature = "e57")]
    if format == Format::E57 {
        let scanners = e57::scanners(input).map_err(|stop| stop.of(path))?;
        return Ok(sink.with_scanners(scanners));
    }
    #[cfg(not(feature = "e57"))]
    let _none = (format, input, path);
    Ok(sink)
}

fn parse(bytes: &[u8], format: Option<Format>, name: &Path) -> Result<Sink, ReadError> {
    let bytes = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
    if bytes.is_empty() {
        return Err(ReadError::Empty { path: name.into() });
    }
    let format = match format {
        Some(format) => format,
        None => recognise(bytes, bytes.len() as u64, name)?,
    };
    parse_as(format, bytes, name)
}

/// Parses content of this format. The byte order mark must have been removed.
pub(crate) fn parse_as(format: Format, bytes: &[u8], name: &Path) -> Result<Sink, ReadError> {
    let parsed = match format {
        Format::Las | Format::E57 => return collect(format, Input::Memory(bytes), name),
        Format::Npy => npy::layout(bytes).and_then(|layout| layout.whole(bytes)),
        Format::Stl => stl::parse(bytes),
        Format::Off => off::parse(bytes),
        #[cfg(feature = "gltf")]
        Format::Gltf => gltf::parse(bytes, name),
        #[cfg(not(feature = "gltf"))]
        Format::Gltf => Err(Fault::Feature { what: "glTF", feature: "gltf" }.at_byte(0)),
        Format::Ply => ply::parse(bytes),
        Format::Pcd => pcd::parse(bytes),
        Format::Xyz => xyz::parse(bytes),
        Format::Obj => obj::parse(bytes),
    };
    parsed.map_err(|broken| broken.of(name))
}
