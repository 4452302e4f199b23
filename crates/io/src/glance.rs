//! A quick estimate of the number of points in a file, and of their bounds.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use nearmiss_geometry::Aabb;

use crate::columns::Row;
use crate::format::Format;
use crate::read::{BYTE_ORDER_MARK, check_file};
use crate::recognise::recognise;
use crate::rows::{Encoding, Layout};
use crate::text::Lines;
use crate::{las, npy, obj, off, pcd, ply, stl, xyz};

/// Number of bytes read at the start of the file.
const HEAD: u64 = 1 << 16;

/// Number of pieces read from the rest of the file.
const PIECES: u64 = 64;

/// Length of a piece in bytes.
const PIECE: u64 = 1 << 12;

/// An estimate of the contents of a file. Nothing is checked.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Glance {
    /// Approximate number of points, including invalid points and duplicates.
    pub points: u64,
    /// Length of the file in bytes.
    pub bytes: u64,
    /// Bounds of a sample of some thousands of points, or the bounds in the header of LAS. Always
    /// `None` for E57, OBJ, STL, OFF, glTF, compressed PCD, and PLY with faces.
    pub bounds: Option<Aabb>,
}

/// Estimates the contents of a file from its header and some pieces, a third of a mebibyte in all.
///
/// Returns `None` if the file cannot be read or has an unknown format. A count in the header is
/// limited to the number of points that fit into the file.
#[must_use]
pub fn glance(path: impl AsRef<Path>, format: Option<Format>) -> Option<Glance> {
    let path = path.as_ref();
    check_file(path).ok()?;
    let mut file = File::open(path).ok()?;
    let bytes = file.metadata().ok()?.len();
    let mut head = Vec::new();
    (&mut file).take(HEAD).read_to_end(&mut head).ok()?;
    let mark = if head.starts_with(BYTE_ORDER_MARK) { BYTE_ORDER_MARK.len() } else { 0 };
    let (content, length) = (&head[mark..], bytes - mark as u64);
    let format = match format {
        Some(format) => format,
        None => recognise(content, length, path).ok()?,
    };
    let layout = match format {
        Format::Ply => ply::layout(content),
        Format::Pcd => pcd::layout(content),
        Format::Xyz => xyz::layout(content),
        Format::Npy => npy::layout(content).ok(),
        Format::Obj | Format::Las | Format::E57 | Format::Stl | Format::Off | Format::Gltf => None,
    };
    if format == Format::Las {
        let (points, bounds) = las::glance(content)?;
        return Some(Glance { points, bytes, bounds });
    }
    let points = match format {
        Format::Ply => ply::count(content, length)?,
        Format::Pcd => pcd::count(content, length)?,
        Format::Xyz => lines(content, length, layout.as_ref()?)?,
        Format::Obj => {
            let mut pieces = Pieces { file: &mut file, start: 0, end: bytes };
            let mut share = obj::Share::default();
            pieces.each(|piece| share.add(piece));
            share.vertices(length)
        }
        Format::Npy => layout.as_ref()?.promised?.0.min(length),
        Format::Stl => stl::count(content, length),
        Format::Off => off::count(content, length)?,
        Format::E57 => count_of_e57(&file)?,
        // Assumes that half of the file is positions in single precision.
        Format::Gltf => length / 24,
        Format::Las => return None,
    };
    let bounds = layout.and_then(|layout| {
        let start = (mark + layout.start) as u64;
        let mut pieces = Pieces { file: &mut file, start, end: bytes };
        bounds(&layout, &mut pieces)
    });
    Some(Glance { points, bytes, bounds })
}

#[cfg(feature = "e57")]
fn count_of_e57(file: &File) -> Option<u64> {
    crate::e57::count(crate::input::Input::File(file))
}

#[cfg(not(feature = "e57"))]
fn count_of_e57(_: &File) -> Option<u64> {
    None
}

/// Estimates the number of rows of a text of this length from the mean row length of its head.
fn lines(head: &[u8], length: u64, layout: &Layout) -> Option<u64> {
    if let Some((promised, _)) = layout.promised {
        return Some(promised.min(length / 2));
    }
    let rows = head.get(layout.start..)?;
    let count = Lines::new(rows).count() as u64;
    let (rows_length, all) = (rows.len() as u64, length - layout.start as u64);
    // 128 bits cannot overflow.
    let points = u128::from(all) * u128::from(count) / u128::from(rows_length.max(1));
    u64::try_from(points).ok()
}

fn bounds(layout: &Layout, pieces: &mut Pieces<'_>) -> Option<Aabb> {
    let mut found: Vec<[f64; 3]> = Vec::new();
    let mut row = Row::default();
    let start = pieces.start;
    pieces.each_at(|at, piece| match layout.encoding {
        Encoding::Binary { stride } => {
            let off = usize::try_from((at - start) % stride as u64).unwrap_or(0);
            let skipped = if off == 0 { 0 } else { stride - off };
            let records = piece.get(skipped..).unwrap_or_default().chunks_exact(stride);
            for record in records {
                layout.rows.record(record, &mut row);
                found.push([row[0], row[1], row[2]]);
            }
        }
        Encoding::Text { end, .. } => {
            let whole = Lines::going_on(piece, 0, end);
            // The first line may lack its start, and the last line its end.
            let mut rows: Vec<_> = whole.skip(1).filter(|line| layout.rows.is_row(line)).collect();
            rows.pop();
            for line in rows {
                if layout.rows.line(line, &mut row).is_ok() {
                    found.push([row[0], row[1], row[2]]);
                }
            }
        }
    });
    let finite: Vec<[f64; 3]> = found.into_iter().filter(|p| p.iter().all(|x| x.is_finite())).collect();
    (!finite.is_empty()).then(|| Aabb::of(finite))
}

/// Pieces that are spread evenly over a part of a file.
struct Pieces<'a> {
    file: &'a mut File,
    start: u64,
    end: u64,
}

impl Pieces<'_> {
    fn each(&mut self, mut take: impl FnMut(&[u8])) {
        self.each_at(|_, piece| take(piece));
    }

    /// Passes the offset and the bytes of each piece to `take`. Pieces that cannot be read are
    /// skipped.
    fn each_at(&mut self, mut take: impl FnMut(u64, &[u8])) {
        let room = self.end.saturating_sub(self.start);
        let count = room.div_ceil(PIECE).min(PIECES);
        let mut bytes = Vec::new();
        for i in 0..count {
            let at = self.start + room.saturating_sub(PIECE) / (count - 1).max(1) * i;
            bytes.clear();
            let read = self
                .file
                .seek(SeekFrom::Start(at))
                .and_then(|_| Read::by_ref(self.file).take(PIECE).read_to_end(&mut bytes));
            if read.is_ok() {
                take(at, &bytes);
            }
        }
    }
}
