//! Reading of files larger than the memory, in blocks.
//!
//! The parsers of rows are those of the whole-file readers, so both report the same errors.

use std::fmt;
use std::fs::File;
use std::io::Read;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use nearmiss_geometry::{Aabb, TriangleMesh};

use crate::error::ReadError;
use crate::format::Format;
use crate::input::Input;
use crate::out::ScaleOffset;
use crate::points::Points;
use crate::read::{Start, check_file, parse_as, stream, with_scanners};
use crate::rows::{Blocks, Encoding, Layout};
use crate::selection::Selection;
use crate::sink::{Model, Sink};
use crate::{las, npy, pcd, ply, xyz};

/// A mesh, or points that can be read in pieces.
#[derive(Debug)]
pub enum Pieces {
    /// A file with faces, read as a whole.
    Mesh {
        /// The vertices with their attributes.
        vertices: Points,
        /// The triangles over the same vertices.
        mesh: TriangleMesh,
    },
    /// A file without faces.
    Points(PointPieces),
}

/// The points of a file in file order, including invalid points and duplicates.
pub struct PointPieces {
    path: PathBuf,
    source: Source,
}

enum Source {
    /// The points of a format that cannot be read in pieces.
    Whole(Points),
    Stream {
        file: File,
        format: Format,
        block: usize,
        selection: Selection,
    },
    Rows {
        file: File,
        layout: Layout,
        block: usize,
    },
}

/// Opens a file whose points are read in blocks of about `block` bytes. Meshes are read as a whole.
///
/// PLY without faces, uncompressed PCD, LAS, LAZ, E57, NPY and text are never in memory as a whole.
/// The memory holds a block, or one row if that is longer, and its points, which take up to eight
/// times as much. All other files are read as by [`read`](crate::read()).
///
/// # Errors
/// Fails like [`read`](crate::read()) for errors in the header. A file with too few points for a
/// cloud is not an error.
pub fn read_in_pieces(
    path: impl AsRef<Path>,
    format: Option<Format>,
    block: usize,
) -> Result<Pieces, ReadError> {
    let path = path.as_ref();
    let rest = match Opened::new(path, format, block)? {
        Opened::Points(points) => return Ok(Pieces::Points(points)),
        Opened::Rest(rest) => rest,
    };
    match rest.parse(path)?.into_points() {
        Ok(whole) => Ok(Pieces::Points(PointPieces { path: path.into(), source: Source::Whole(whole) })),
        Err(sink) => {
            let vertices = sink.points().clone();
            let no_faces = || ReadError::NoFaces { path: path.into() };
            sink.into_mesh(path)?.map(|mesh| Pieces::Mesh { vertices, mesh }).ok_or_else(no_faces)
        }
    }
}

/// Like [`read`](crate::read()), and passes the numbers of points that were read to `told`, block
/// by block. Files that cannot be read in pieces are not reported.
///
/// # Errors
/// Fails like [`read`](crate::read()).
pub fn read_watched(
    path: impl AsRef<Path>,
    format: Option<Format>,
    told: &mut dyn FnMut(usize),
) -> Result<Model, ReadError> {
    const BLOCK: usize = 1 << 20;
    let path = path.as_ref();
    let pieces = match Opened::new(path, format, BLOCK)? {
        Opened::Points(pieces) => pieces,
        Opened::Rest(rest) => return rest.parse(path)?.into_model(path),
    };
    let mut sink = Sink::default();
    pieces.each(|points| {
        sink.append(points);
        told(points.len());
    })?;
    match &pieces.source {
        Source::Stream { file, format, .. } => with_scanners(sink, *format, Input::File(file), path)?,
        Source::Rows { .. } | Source::Whole(_) => sink,
    }
    .into_model(path)
}

/// A file whose header was read.
enum Opened {
    /// A file that can be read in pieces.
    Points(PointPieces),
    /// Any other file.
    Rest(Rest),
}

/// A file that is read as a whole.
struct Rest {
    file: File,
    /// The bytes that were read so far.
    head: Vec<u8>,
    /// Length of the byte order mark in bytes.
    mark: usize,
    format: Format,
}

impl Rest {
    fn parse(mut self, path: &Path) -> Result<Sink, ReadError> {
        let failed = |cause| ReadError::Io { path: path.into(), cause };
        self.file.read_to_end(&mut self.head).map_err(failed)?;
        parse_as(self.format, &self.head[self.mark..], path)
    }
}

impl Opened {
    fn new(path: &Path, format: Option<Format>, block: usize) -> Result<Self, ReadError> {
        let failed = |cause| ReadError::Io { path: path.into(), cause };
        check_file(path)?;
        let mut file = File::open(path).map_err(failed)?;
        let Start { head, mark, length, format } = Start::of(&mut file, format, path)?;
        let block = block.max(1);
        let points = |source| Self::Points(PointPieces { path: path.into(), source });
        if format.is_streamed() {
            return Ok(points(Source::Stream { file, format, block, selection: Selection::default() }));
        }
        let layout = match format {
            Format::Ply => ply::layout(&head[mark..]),
            Format::Pcd => pcd::layout(&head[mark..]),
            Format::Xyz => xyz::layout(&head[mark..]),
            Format::Npy => npy::layout(&head[mark..]).ok(),
            Format::Obj | Format::Las | Format::E57 | Format::Stl | Format::Off | Format::Gltf => None,
        };
        // A header that fills the whole head may continue behind it.
        if let Some(mut layout) = layout.filter(|layout| mark + layout.start < head.len()) {
            layout.start += mark;
            layout.check_length(length).map_err(|broken| broken.of(path))?;
            return Ok(points(Source::Rows { file, layout, block }));
        }
        Ok(Self::Rest(Rest { file, head, mark, format }))
    }
}

impl PointPieces {
    /// Restricts COPC to the nodes that meet `bounds`, so most points outside `bounds` are left
    /// out. Has no effect on other formats.
    #[must_use]
    pub fn near(mut self, bounds: Aabb) -> Self {
        if let Source::Stream { selection, .. } = &mut self.source {
            selection.bounds = Some(bounds);
        }
        self
    }

    /// Returns `true` if the file has levels of detail, like COPC.
    #[must_use]
    pub fn has_levels(&self) -> bool {
        matches!(&self.source, Source::Stream { file, format: Format::Las, .. }
            if las::has_levels(Input::File(file)))
    }

    /// Restricts the points to the coarser levels of detail, down to the level whose points are
    /// about `spacing` apart. Has no effect on files without levels.
    #[must_use]
    pub fn at_resolution(mut self, spacing: f64) -> Self {
        if let Source::Stream { selection, .. } = &mut self.source {
            selection.spacing = Some(spacing);
        }
        self
    }

    /// Returns the scale and offset of the coordinates of a LAS file.
    #[must_use]
    pub fn lattice(&self) -> Option<ScaleOffset> {
        match &self.source {
            Source::Stream { file, format: Format::Las, .. } => las::lattice(Input::File(file)),
            _ => None,
        }
    }

    /// Passes all points to `take`, in blocks, starting at the first point. Can be called
    /// repeatedly.
    ///
    /// # Errors
    /// Fails if the file cannot be read or a row is invalid; the error names the row. Earlier
    /// blocks have been passed to `take`.
    pub fn each(&self, mut take: impl FnMut(&Points)) -> Result<(), ReadError> {
        self.each_until(&mut |points| {
            take(points);
            ControlFlow::Continue(())
        })
    }

    /// Like [`Self::each`], but stops at the first error of `take`.
    ///
    /// # Errors
    /// Fails like [`Self::each`], or with the error of `take`.
    pub fn try_each<E: From<ReadError>>(
        &self,
        mut take: impl FnMut(&Points) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut failed = None;
        self.each_until(&mut |points| match take(points) {
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                failed = Some(error);
                ControlFlow::Break(())
            }
        })?;
        failed.map_or(Ok(()), Err)
    }

    fn each_until(&self, take: &mut dyn FnMut(&Points) -> ControlFlow<()>) -> Result<(), ReadError> {
        match &self.source {
            Source::Whole(points) => {
                let _ = take(points);
                Ok(())
            }
            Source::Stream { file, format, block, selection } => {
                stream(*format, Input::File(file), (*block, selection), &self.path, take)
            }
            Source::Rows { file, layout, block } => {
                let mut blocks = Blocks::new(&self.path, file, *block);
                blocks.seek(layout.start)?;
                match layout.encoding {
                    Encoding::Binary { stride } => layout.records(&mut blocks, stride, take),
                    Encoding::Text { number, end } => layout.lines(&mut blocks, number, end, take),
                }
            }
        }
    }
}

impl fmt::Debug for PointPieces {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("PointPieces").field("path", &self.path).finish_non_exhaustive()
    }
}
