//! From a file, or bytes in memory, to a model.

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
use crate::format::{Format, recognise};
#[cfg(feature = "gltf")]
use crate::gltf;
use crate::input::{Input, Stop};
use crate::points::Points;
use crate::selection::Selection;
use crate::sink::{Model, Sink};
use crate::{las, npy, obj, off, pcd, ply, stl, xyz};

/// Reads the points of a file, and its triangles where it has faces.
///
/// Without a `format` the content decides, then the name. The whole file is held in memory while it is read,
/// and what is allocated besides is bounded by the file's length, never by a count in its header: some tens
/// of bytes for each of its own, 128 for compressed ones beyond a first 128 MiB.
///
/// # Errors
/// Says which file, what is wrong and where; never panics, whatever the file holds.
pub fn read(path: impl AsRef<Path>, format: Option<Format>) -> Result<Model, ReadError> {
    let path = path.as_ref();
    load(path, format)?.into_model(path)
}

/// [`read`] for content that is already in memory; `name` is for messages, and its ending for the format.
///
/// # Errors
/// As [`read`], input and output apart.
pub fn read_bytes(bytes: &[u8], format: Option<Format>, name: impl AsRef<Path>) -> Result<Model, ReadError> {
    let name = name.as_ref();
    parse(bytes, format, name)?.into_model(name)
}

/// Reads only the triangles, which may have fewer than the eight vertices that a cloud needs.
///
/// # Errors
/// As [`read`], and when the file has no faces.
pub fn read_mesh(path: impl AsRef<Path>, format: Option<Format>) -> Result<TriangleMesh, ReadError> {
    let path = path.as_ref();
    let no_faces = || ReadError::NoFaces { path: path.into() };
    load(path, format)?.into_mesh(path)?.ok_or_else(no_faces)
}

/// [`read_mesh`] for content that is already in memory.
///
/// # Errors
/// As [`read_mesh`], input and output apart.
pub fn read_mesh_bytes(
    bytes: &[u8],
    format: Option<Format>,
    name: impl AsRef<Path>,
) -> Result<TriangleMesh, ReadError> {
    let name = name.as_ref();
    let no_faces = || ReadError::NoFaces { path: name.into() };
    parse(bytes, format, name)?.into_mesh(name)?.ok_or_else(no_faces)
}

/// The format of a file, by its first 64 KiB, then by its name.
///
/// # Errors
/// When the file cannot be read, is empty, or is of no format that can be read.
pub fn format_of(path: impl AsRef<Path>) -> Result<Format, ReadError> {
    let path = path.as_ref();
    check_file(path)?;
    let mut file = File::open(path).map_err(|cause| ReadError::Io { path: path.into(), cause })?;
    Start::of(&mut file, None, path).map(|start| start.format)
}

/// What some programs begin text with.
pub(crate) const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Checks that it is a file; asked first, because merely opening a pipe waits for its other end.
pub(crate) fn check_file(path: &Path) -> Result<(), ReadError> {
    match fs::metadata(path).map_err(|cause| ReadError::Io { path: path.into(), cause })?.is_file() {
        true => Ok(()),
        false => Err(ReadError::NotAFile { path: path.into() }),
    }
}

/// The content of a file.
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

/// The first bytes of a file, and what they say of it.
pub(crate) struct Start {
    /// 64 KiB, unless the file is shorter.
    pub(crate) head: Vec<u8>,
    /// Length of the byte order mark in it.
    pub(crate) mark: usize,
    /// Length of the file.
    pub(crate) length: u64,
    pub(crate) format: Format,
}

/// Bytes looked at to recognise a format; headers of files that are read in pieces end in them.
const HEAD: u64 = 1 << 16;

impl Start {
    /// Reads the start of a file and leaves it there.
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

/// Goes over the points of a format that is [streamed](Format::is_streamed), some `block` bytes at a time.
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

/// All points of a format that is streamed.
fn collect(format: Format, input: Input<'_>, path: &Path) -> Result<Sink, ReadError> {
    const BLOCK: usize = 1 << 20;
    let mut sink = Sink::default();
    stream(format, input, (BLOCK, &Selection::default()), path, &mut |points| {
        sink.append(points);
        ControlFlow::Continue(())
    })?;
    #[cfg(feature = "e57")]
    if format == Format::E57 {
        let scanners = e57::scanners(input).map_err(|stop| stop.of(path))?;
        sink = sink.with_scanners(scanners);
    }
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

/// Content of this format, without a byte order mark.
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
