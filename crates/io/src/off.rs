//! OFF, the Object File Format of Geomview, text only: vertices with normals or colours, and
//! polygons.

use crate::columns::{Holds, Row};
use crate::error::{Broken, Fault};
use crate::sink::{Sink, corner};
use crate::text::{Line, Lines, number, shown, whole};

/// Returns `true` if this first word of a file is that of OFF.
pub(crate) fn is_header(word: &[u8]) -> bool {
    matches!(word, b"OFF" | b"COFF" | b"NOFF" | b"CNOFF" | b"STOFF" | b"STCNOFF" | b"STNOFF" | b"STCOFF")
}

/// Returns the number of vertices in the header, limited to those that fit into a file of this
/// length.
pub(crate) fn count(head: &[u8], length: u64) -> Option<u64> {
    Some(Header::parse(&mut Lines::new(head)).ok()?.vertices.min(length / 6))
}

struct Header {
    has_colours: bool,
    has_normals: bool,
    vertices: u64,
    faces: u64,
    /// Line of the counts.
    line: u64,
}

impl Header {
    fn parse(lines: &mut Lines<'_>) -> Result<Self, Broken> {
        let missing = || Fault::Undeclared { what: "numbers of vertices and faces" };
        let first = filled(lines).ok_or_else(|| missing().on_line(1))?;
        let mut words = first.words();
        let name = words.next().unwrap_or_default();
        if !is_header(name) || first.words().any(|word| word == b"BINARY") {
            let expected = "three-dimensional OFF as text";
            return Err(Fault::Expected { expected, found: shown(first.text) }.on_line(first.number));
        }
        // The counts may be on the same line.
        let mut line = first;
        let mut counts: Vec<&[u8]> = words.collect();
        if counts.is_empty() {
            line = filled(lines).ok_or_else(|| missing().on_line(first.number))?;
            counts = line.words().collect();
        }
        let count = |i: usize| {
            let word = counts.get(i).copied().unwrap_or_default();
            let expected = ["the number of vertices", "the number of faces"][i];
            let wrong = || Fault::NotWhole { expected, found: shown(word) };
            whole::<u64>(word).ok_or_else(|| wrong().on_line(line.number))
        };
        Ok(Self {
            has_colours: name.contains(&b'C'),
            has_normals: name.contains(&b'N'),
            vertices: count(0)?,
            faces: count(1)?,
            line: line.number,
        })
    }
}

/// Returns the next line with values, without its comment.
fn filled<'a>(lines: &mut Lines<'a>) -> Option<Line<'a>> {
    let line = lines.find(|line| {
        let text = line.text.trim_ascii_start();
        !text.is_empty() && !text.starts_with(b"#")
    })?;
    let text = line.text.split(|byte| *byte == b'#').next().unwrap_or_default();
    Some(Line { text, ..line })
}

/// Parses an OFF file.
pub(crate) fn parse(bytes: &[u8]) -> Result<Sink, Broken> {
    let mut lines = Lines::new(bytes);
    let header = Header::parse(&mut lines)?;
    let Header { has_colours, has_normals, vertices, faces, line: declared } = header;
    let holds = Holds { normals: has_normals, colours: has_colours, ..Holds::default() };
    let promised = |element: &str, promised, present| {
        Fault::Promised { element: element.into(), promised, present }.on_line(declared)
    };
    // A vertex takes at least six bytes.
    let fit = (lines.left() / 6) as u64;
    let mut sink = Sink::new(holds, usize::try_from(vertices.min(fit)).unwrap_or_default());
    for index in 0..vertices {
        let line = filled(&mut lines).ok_or_else(|| promised("vertex", vertices, index))?;
        let row = vertex(line, holds).map_err(|fault| fault.on_line(line.number).within("vertex", index))?;
        sink.row(&row);
    }
    let mut corners = Vec::new();
    for index in 0..faces {
        let line = filled(&mut lines).ok_or_else(|| promised("face", faces, index))?;
        face(line, vertices, &mut corners)
            .and_then(|()| sink.polygon(&corners))
            .map_err(|fault| fault.on_line(line.number).within("face", index))?;
    }
    Ok(sink)
}

/// Parses coordinates, then a normal and a colour if the header declares them. Colours of whole
/// numbers are in 0..=255, those with decimal points in 0..=1.
fn vertex(line: Line<'_>, holds: Holds) -> Result<Row, Fault> {
    const NAMES: [&str; 9] = ["x", "y", "z", "nx", "ny", "nz", "red", "green", "blue"];
    let mut row: Row = [0.0; 11];
    let mut words = line.words();
    let mut are_shares = false;
    let parts = [(0..3, true), (3..6, holds.normals), (6..9, holds.colours)];
    for slot in parts.into_iter().filter(|part| part.1).flat_map(|part| part.0) {
        let column = || NAMES[slot].into();
        let word = words.next().ok_or_else(|| Fault::ShortLine { column: column() })?;
        row[slot] = number(word).ok_or_else(|| Fault::NotANumber { column: column(), found: shown(word) })?;
        are_shares |= slot >= 6 && word.contains(&b'.');
    }
    if are_shares {
        row[6..9].iter_mut().for_each(|channel| *channel *= 255.0);
    }
    Ok(row)
}

/// Parses the number of corners of a face, then their vertices. A colour after them is ignored.
fn face(line: Line<'_>, vertices: u64, corners: &mut Vec<u32>) -> Result<(), Fault> {
    let mut words = line.words();
    let expected = |expected, word: &[u8]| Fault::NotWhole { expected, found: shown(word) };
    let word = words.next().unwrap_or_default();
    let count: usize = whole(word).ok_or_else(|| expected("the number of corners of a face", word))?;
    corners.clear();
    for _ in 0..count {
        let word = words.next().ok_or(Fault::PastEnd)?;
        let index: i64 = whole(word).ok_or_else(|| expected("a vertex index", word))?;
        corners.push(corner(index, vertices, 0)?);
    }
    Ok(())
}
