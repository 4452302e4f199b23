//! PLY, after Greg Turk, "The PLY Polygon File Format" (Stanford, 1994): ascii and binary in both byte orders.
//!
//! Points come from the element `vertex`, triangles from `face` (polygons, as fans) and `tristrips`; whatever
//! else the header declares is stepped over. Bytes after the last element of a binary file are ignored as by
//! other readers; text after the last element of an ascii file is refused, because a count that is too small
//! would silently cut the cloud.

mod header;
mod source;

use crate::columns::{Holds, Row};
use crate::error::{Broken, Fault};
use crate::sink::{Sink, corner};
use header::{Element, Encoding, Header, Part, Role};
use source::{Ascii, Binary, Source};

/// The content of a PLY file.
pub(crate) fn parse(bytes: &[u8]) -> Result<Sink, Broken> {
    let (header, lines) = header::parse(bytes)?;
    match header.encoding {
        Encoding::Ascii => {
            let mut source = Ascii::new(lines);
            let sink = elements(&header, &mut source)?;
            source.finish()?;
            Ok(sink)
        }
        Encoding::Binary(order) => elements(&header, &mut Binary::new(bytes, lines.offset(), order)),
    }
}

fn elements<'a>(header: &Header, source: &mut impl Source<'a>) -> Result<Sink, Broken> {
    let mut sink = Sink::default();
    let vertex = header.vertices()?;
    let holds = Holds::among(vertex.slots()).map_err(|fault| fault.on_line(vertex.line))?;
    let mut reader =
        Reader { vertices: vertex.count, row: Row::default(), corners: Vec::new(), strip: Vec::new() };
    // An element without properties takes no space, so its count says nothing.
    for element in header.elements.iter().filter(|e| !e.properties.is_empty()) {
        if element.role == Role::Vertex {
            let fit = source.left() / source.least_size(element);
            let promised = usize::try_from(element.count).unwrap_or(usize::MAX);
            sink = sink.with_rows(holds, fit.min(promised));
        }
        for index in 0..element.count {
            if !source.start_row(element) {
                let promised = Fault::Promised {
                    element: element.name.clone(),
                    promised: element.count,
                    present: index,
                };
                return Err(promised.on_line(element.line));
            }
            reader
                .read(element, source)
                .and_then(|()| reader.pour(element.role, &mut sink))
                .map_err(|fault| fault.at(source.at()).within(&element.name, index))?;
        }
    }
    Ok(sink)
}

/// What is kept of the element that is being read.
struct Reader {
    vertices: u64,
    row: Row,
    corners: Vec<f64>,
    strip: Vec<u32>,
}

impl Reader {
    fn read<'a>(&mut self, element: &Element, source: &mut impl Source<'a>) -> Result<(), Fault> {
        self.corners.clear();
        for property in &element.properties {
            match (property.list, property.part) {
                (None, Part::Slot(slot)) => self.row[slot] = source.number(property, property.scalar)?,
                (None, _) => source.skip(property, 1)?,
                (Some(length), part) => {
                    let values = source.length(property, length)?;
                    if part == Part::Corners {
                        for _ in 0..values {
                            self.corners.push(source.number(property, property.scalar)?);
                        }
                    } else {
                        source.skip(property, values)?;
                    }
                }
            }
        }
        source.finish_row()
    }

    fn pour(&mut self, role: Role, sink: &mut Sink) -> Result<(), Fault> {
        match role {
            Role::Vertex => sink.row(&self.row),
            Role::Face { corners: true } => {
                self.strip.clear();
                for &c in &self.corners {
                    self.strip.push(corner(index(c)?, self.vertices, 0)?);
                }
                sink.polygon(&self.strip)?;
            }
            Role::Strips => {
                self.strip.clear();
                for &c in &self.corners {
                    match index(c)? {
                        -1 => {
                            sink.strip(&self.strip);
                            self.strip.clear();
                        }
                        i => self.strip.push(corner(i, self.vertices, 0)?),
                    }
                }
                sink.strip(&self.strip);
            }
            Role::Face { corners: false } | Role::Other => {}
        }
        Ok(())
    }
}

/// A vertex index from a number of any type; the types of PLY all fit into double precision.
fn index(value: f64) -> Result<i64, Fault> {
    if value.fract() != 0.0 {
        return Err(Fault::NotWhole { expected: "the index of a vertex", found: value.to_string().into() });
    }
    #[expect(clippy::cast_possible_truncation, reason = "saturates, and no vertex is that far out")]
    let index = value as i64;
    Ok(index)
}
