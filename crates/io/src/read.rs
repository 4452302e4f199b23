//! From a file, or bytes in memory, to a model.

use std::fs;
use std::path::Path;

use nearmiss_geometry::TriangleMesh;

use crate::error::ReadError;
use crate::format::{Format, recognise};
use crate::sink::{Model, Sink};
use crate::{obj, pcd, ply, xyz};

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
    read_bytes(&load(path)?, format, path)
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
    read_mesh_bytes(&load(path)?, format, path)
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

/// What some programs begin text with.
pub(crate) const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Checks that it is a file; asked first, because merely opening a pipe waits for its other end.
pub(crate) fn check_file(path: &Path) -> Result<(), ReadError> {
    match fs::metadata(path).map_err(|cause| ReadError::Io { path: path.into(), cause })?.is_file() {
        true => Ok(()),
        false => Err(ReadError::NotAFile { path: path.into() }),
    }
}

fn load(path: &Path) -> Result<Vec<u8>, ReadError> {
    check_file(path)?;
    fs::read(path).map_err(|cause| ReadError::Io { path: path.into(), cause })
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
        Format::Ply => ply::parse(bytes),
        Format::Pcd => pcd::parse(bytes),
        Format::Xyz => xyz::parse(bytes),
        Format::Obj => obj::parse(bytes),
    };
    parsed.map_err(|broken| broken.of(name))
}
