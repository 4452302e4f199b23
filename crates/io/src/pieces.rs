//! Files of points larger than memory: row by row, a block at a time.
//!
//! What the whole-file readers know of a row is used here too; what they say of a broken file is said here in
//! the same words.

use std::fmt;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use nearmiss_geometry::TriangleMesh;

use crate::error::ReadError;
use crate::format::{Format, recognise};
use crate::read::{BYTE_ORDER_MARK, check_file, parse_as};
use crate::rows::{Blocks, Encoding, Layout};
use crate::{pcd, ply, xyz};

/// Bytes at the start in which the header must end; where it does not, the file is read whole.
const HEAD: usize = 1 << 16;

/// A mesh, or points that can be gone over a piece at a time.
#[derive(Debug)]
pub enum Pieces {
    /// What has faces, read whole.
    Mesh(TriangleMesh),
    /// What has none.
    Points(PointPieces),
}

/// The points of a file, all vertices in its order, broken ones and duplicates too.
pub struct PointPieces {
    path: PathBuf,
    source: Source,
}

enum Source {
    /// Formats that cannot be read in pieces.
    Whole(Vec<[f64; 3]>),
    Rows {
        file: File,
        layout: Layout,
        block: usize,
    },
}

/// Opens a file for going over its points, of which some `block` bytes are read at a time; meshes are read
/// whole.
///
/// PLY of vertices alone, PCD that is not compressed, and text are never in memory as a whole, only a block
/// (more if a row is longer) and its points, which take up to eight times as much. Others are read as by
/// [`read`](crate::read()).
///
/// # Errors
/// As [`read`](crate::read()), as far as the header tells. That there are too few points for a cloud is none.
pub fn read_in_pieces(
    path: impl AsRef<Path>,
    format: Option<Format>,
    block: usize,
) -> Result<Pieces, ReadError> {
    let path = path.as_ref();
    let failed = |cause| ReadError::Io { path: path.into(), cause };
    check_file(path)?;
    let mut file = File::open(path).map_err(failed)?;
    let length = file.metadata().map_err(failed)?.len();
    let mut head = Vec::new();
    (&mut file).take(HEAD as u64).read_to_end(&mut head).map_err(failed)?;
    let marked = head.starts_with(BYTE_ORDER_MARK);
    let mark = if marked { BYTE_ORDER_MARK.len() } else { 0 };
    if head.len() == mark {
        return Err(ReadError::Empty { path: path.into() });
    }
    let format = match format {
        Some(format) => format,
        None => recognise(&head[mark..], length - mark as u64, path)?,
    };
    let layout = match format {
        Format::Ply => ply::layout(&head[mark..]),
        Format::Pcd => pcd::layout(&head[mark..]),
        Format::Xyz => xyz::layout(&head[mark..]),
        Format::Obj => None,
    };
    let points = |source| Pieces::Points(PointPieces { path: path.into(), source });
    // A header that fills all of the head may go on after it.
    if let Some(mut layout) = layout.filter(|layout| mark + layout.start < head.len()) {
        layout.start += mark;
        layout.check_length(length).map_err(|broken| broken.of(path))?;
        return Ok(points(Source::Rows { file, layout, block: block.max(1) }));
    }
    file.seek(SeekFrom::Start(0)).map_err(failed)?;
    head.clear();
    file.read_to_end(&mut head).map_err(failed)?;
    let sink = parse_as(format, &head[mark..], path)?;
    drop(head);
    match sink.into_points() {
        Ok(whole) => Ok(points(Source::Whole(whole))),
        Err(mesh) => {
            let no_faces = || ReadError::NoFaces { path: path.into() };
            mesh.into_mesh(path)?.map(Pieces::Mesh).ok_or_else(no_faces)
        }
    }
}

impl PointPieces {
    /// Goes over all points from the first on, and hands out some at a time. Can be done again.
    ///
    /// # Errors
    /// When the file cannot be read, or a row is broken: which, and where. What came before it has been
    /// handed out.
    pub fn each(&self, mut take: impl FnMut(&[[f64; 3]])) -> Result<(), ReadError> {
        match &self.source {
            Source::Whole(points) => take(points),
            Source::Rows { file, layout, block } => {
                let mut blocks = Blocks::new(&self.path, file, *block);
                blocks.seek(layout.start)?;
                match layout.encoding {
                    Encoding::Binary { stride } => layout.records(&mut blocks, stride, take)?,
                    Encoding::Text { number, end } => layout.lines(&mut blocks, number, end, take)?,
                }
            }
        }
        Ok(())
    }
}

impl fmt::Debug for PointPieces {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("PointPieces").field("path", &self.path).finish_non_exhaustive()
    }
}
