//! STL, binary and text: triangles given by the positions of their corners. Equal corners become
//! one vertex.

use crate::error::{Broken, Fault};
use crate::scalar::{Order, Scalar};
use crate::sink::Sink;
use crate::text::{Lines, number, shown};

/// Length of the header of a binary file in bytes: a comment, and the number of triangles.
const HEADER: usize = 84;

/// Length of a triangle in bytes: a normal, three corners, and two arbitrary bytes.
const TRIANGLE: usize = 50;

/// Returns `true` if this is the start of a binary file. The format has no magic number, but the
/// length of the file follows from the number of triangles.
pub(crate) fn is_binary(head: &[u8], length: u64) -> bool {
    promised(head).is_some_and(|count| HEADER as u64 + TRIANGLE as u64 * count == length)
}

/// Returns `true` if this is the start of a text file.
pub(crate) fn is_text(head: &[u8]) -> bool {
    let start = head[..head.len().min(1024)].trim_ascii_start();
    start.starts_with(b"solid") && start.windows(5).any(|word| word == b"facet")
}

/// Returns the number of triangles that a binary file declares.
fn promised(head: &[u8]) -> Option<u64> {
    let count = head.get(HEADER - 4..HEADER).and_then(<[u8]>::first_chunk)?;
    Some(u32::from_le_bytes(*count).into())
}

/// Estimates the number of corners in a file of this length.
pub(crate) fn count(head: &[u8], length: u64) -> u64 {
    // A triangle takes some 250 bytes of text.
    if is_text(head) { length / 250 * 3 } else { length.saturating_sub(HEADER as u64) / TRIANGLE as u64 * 3 }
}

/// Parses an STL file.
pub(crate) fn parse(bytes: &[u8]) -> Result<Sink, Broken> {
    let corners = if is_text(bytes) { text(bytes)? } else { binary(bytes)? };
    Ok(Sink::of_corners(&corners))
}

fn binary(bytes: &[u8]) -> Result<Vec<[f64; 3]>, Broken> {
    let Some(promised) = promised(bytes) else { return Err(Fault::PastEnd.at_byte(bytes.len())) };
    let present = ((bytes.len() - HEADER) / TRIANGLE) as u64;
    if promised > present {
        return Err(Fault::Promised { element: "face".into(), promised, present }.at_byte(HEADER - 4));
    }
    let mut corners = Vec::new();
    let triangles = usize::try_from(promised).unwrap_or(usize::MAX);
    for triangle in bytes[HEADER..].chunks_exact(TRIANGLE).take(triangles) {
        // The corners follow the normal.
        for corner in triangle[12..48].chunks_exact(12) {
            let coordinate = |k: usize| Scalar::F32.read(&corner[4 * k..], Order::Little);
            corners.push([0, 1, 2].map(|k| coordinate(k).unwrap_or(f64::NAN)));
        }
    }
    Ok(corners)
}

fn text(bytes: &[u8]) -> Result<Vec<[f64; 3]>, Broken> {
    let (mut corners, mut of_face) = (Vec::new(), 0_usize);
    let mut faces = 0;
    let is = |word: &[u8], keyword: &str| word.eq_ignore_ascii_case(keyword.as_bytes());
    let complete = |of_face: usize, line: u64, face: u64| match of_face {
        3 => Ok(()),
        found => {
            let expected = "three `vertex` lines in each facet";
            let fault = Fault::Expected { expected, found: found.to_string().into() };
            Err(fault.on_line(line).within("face", face))
        }
    };
    let mut lines = Lines::new(bytes);
    for line in lines.by_ref() {
        let mut words = line.words();
        match words.next() {
            Some(word) if is(word, "vertex") => {
                let mut corner = [0.0; 3];
                for (value, column) in corner.iter_mut().zip(["x", "y", "z"]) {
                    let broken = |fault: Fault| fault.on_line(line.number).within("face", faces);
                    let word =
                        words.next().ok_or_else(|| broken(Fault::ShortLine { column: column.into() }))?;
                    *value = number(word).ok_or_else(|| {
                        broken(Fault::NotANumber { column: column.into(), found: shown(word) })
                    })?;
                }
                corners.push(corner);
                of_face += 1;
            }
            Some(word) if is(word, "endfacet") => {
                complete(of_face, line.number, faces)?;
                of_face = 0;
                faces += 1;
            }
            _ => (),
        }
    }
    // The file ends within a facet.
    if of_face > 0 {
        complete(of_face, lines.number(), faces)?;
    }
    Ok(corners)
}
