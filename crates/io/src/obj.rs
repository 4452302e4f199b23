//! Wavefront OBJ: the lines `v`, with or without colours, and `f`. All other lines are ignored.
//!
//! Negative indices of a face count back from the last vertex. Faces may refer to later vertices. A
//! vertex of four values has a weight, which is ignored. A vertex of six values has red, green and
//! blue in 0..=1. A line that ends in a backslash continues on the next line.

use crate::columns::{Holds, Row};
use crate::error::{Broken, Fault};
use crate::sink::{Sink, corner};
use crate::text::{Line, Lines, number, shown, whole, words};

/// Parses an OBJ file.
pub(crate) fn parse(bytes: &[u8]) -> Result<Sink, Broken> {
    let (mut total, mut coloured) = (0_u64, 0_u64);
    each_line(bytes, |text, _| {
        let mut values = words(text);
        if values.next() == Some(b"v") {
            total += 1;
            coloured += u64::from(values.count() == 6);
        }
        Ok(())
    })?;
    let holds = Holds { normals: false, colours: coloured == total, ..Holds::default() };
    let mut reader = Reader {
        total,
        vertices: 0,
        faces: 0,
        corners: Vec::new(),
        // Each vertex is a line, so `total` is bounded by the length of the file.
        sink: Sink::new(holds, usize::try_from(total).unwrap_or(0)),
    };
    each_line(bytes, |text, number| reader.line(text, number))?;
    Ok(reader.sink)
}

/// An estimate of the number of vertices per byte, from some pieces of a file.
#[derive(Debug, Default)]
pub(crate) struct Share {
    bytes: u64,
    vertices: u64,
}

impl Share {
    /// Adds a piece, which may start and end within a line.
    pub(crate) fn add(&mut self, piece: &[u8]) {
        self.bytes += piece.len() as u64;
        let lines = piece.split(|byte| *byte == b'\n').skip(1);
        self.vertices += lines.filter(|line| words(line).next() == Some(b"v")).count() as u64;
    }

    /// Estimates the number of vertices in a file of this length.
    pub(crate) fn vertices(&self, length: u64) -> u64 {
        let vertices = u128::from(self.vertices) * u128::from(length) / u128::from(self.bytes.max(1));
        u64::try_from(vertices).unwrap_or(u64::MAX)
    }
}

/// Passes every line and its number to `each`, with continued lines joined.
fn each_line(bytes: &[u8], mut each: impl FnMut(&[u8], u64) -> Result<(), Broken>) -> Result<(), Broken> {
    let mut lines = Lines::new(bytes);
    let mut joined = Vec::new();
    while let Some(Line { number, text }) = lines.next() {
        // Only vertices and faces: a comment may end in a backslash, for example with a path.
        let goes_on = matches!(text.trim_ascii_start(), [b'v' | b'f', .., b'\\']);
        if goes_on {
            joined.clear();
            let mut part = text;
            while let Some(start) = part.strip_suffix(b"\\") {
                joined.extend_from_slice(start);
                joined.push(b' ');
                part = lines.next().map(|line| line.text).unwrap_or_default();
            }
            joined.extend_from_slice(part);
        }
        each(if goes_on { &joined } else { text }, number)?;
    }
    Ok(())
}

struct Reader {
    /// Number of vertices in the whole file.
    total: u64,
    /// Number of vertices so far.
    vertices: u64,
    faces: u64,
    corners: Vec<u32>,
    sink: Sink,
}

impl Reader {
    fn line(&mut self, text: &[u8], number: u64) -> Result<(), Broken> {
        let mut values = words(text);
        match values.next() {
            Some(b"v") => {
                let vertex = self.vertex(values);
                vertex.map_err(|fault| fault.on_line(number).within("vertex", self.vertices))?;
                self.vertices += 1;
            }
            Some(b"f") => {
                let face = self.face(values);
                face.map_err(|fault| fault.on_line(number).within("face", self.faces))?;
                self.faces += 1;
            }
            _ => {}
        }
        Ok(())
    }

    fn vertex<'a>(&mut self, mut values: impl Iterator<Item = &'a [u8]>) -> Result<(), Fault> {
        let mut row = Row::default();
        for (slot, column) in ["x", "y", "z"].into_iter().enumerate() {
            let value = values.next().ok_or_else(|| Fault::ShortLine { column: column.into() })?;
            row[slot] = number(value)
                .ok_or_else(|| Fault::NotANumber { column: column.into(), found: shown(value) })?;
        }
        for (channel, value) in row[6..].iter_mut().zip(values) {
            *channel = number(value).unwrap_or_default() * 255.0;
        }
        self.sink.row(&row);
        Ok(())
    }

    fn face<'a>(&mut self, values: impl Iterator<Item = &'a [u8]>) -> Result<(), Fault> {
        self.corners.clear();
        for value in values {
            let index = value.split(|&b| b == b'/').next().unwrap_or_default();
            let index: i64 = whole(index)
                .ok_or_else(|| Fault::NotWhole { expected: "a vertex index", found: shown(value) })?;
            let vertex = if index < 0 {
                // No file has 2^63 vertices.
                let from_first = i64::try_from(self.vertices).unwrap_or_default() + index;
                let missing = Fault::NoSuchVertex { vertex: index, vertices: self.vertices, first: 1 };
                corner(from_first, self.vertices, 0).map_err(|_not_as_written| missing)
            } else {
                corner(index, self.total, 1)
            };
            self.corners.push(vertex?);
        }
        self.sink.polygon(&self.corners)
    }
}
