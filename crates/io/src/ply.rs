//! PLY, after Greg Turk, "The PLY Polygon File Format" (Stanford, 1994): ascii and binary in both byte
//! orders.
//!
//! Points come from the element `vertex`, and triangles from `face` (polygons, cut into fans) and
//! `tristrips`. Other elements are skipped. Bytes after the last element of a binary file are
//! ignored, as by other readers. Text after the last element of an ascii file is an error, because
//! a count that is too small would silently cut the cloud.

mod header;
mod source;

use crate::columns::{Holds, Row};
use crate::error::{Broken, Fault};
use crate::rows::{self, Layout, Rows};
use crate::scalar::Order;
use crate::sink::{Sink, corner};
use crate::text::Line;
use header::{Element, Encoding, Header, Part, Role};
use source::{Ascii, Binary, Source};

/// Parses a PLY file.
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

/// Returns the layout of the vertices, if the file has no other elements and its header is valid.
pub(crate) fn layout(head: &[u8]) -> Option<Layout> {
    let (header, lines) = header::parse(head).ok()?;
    let mut elements = header.elements.into_iter().filter(|e| !e.properties.is_empty() && e.count > 0);
    let vertex = elements.next().filter(|element| element.role == Role::Vertex)?;
    let holds = Holds::among(vertex.slots()).ok()?;
    if elements.next().is_some() {
        return None;
    }
    let (encoding, order) = match header.encoding {
        Encoding::Ascii => (rows::Encoding::of_text(&lines), Order::Little),
        Encoding::Binary(_) if vertex.properties.iter().any(|property| property.list.is_some()) => {
            return None;
        }
        Encoding::Binary(order) => {
            let stride = Binary::new(&[], 0, order).least_size(&vertex);
            (rows::Encoding::Binary { stride }, order)
        }
    };
    let (element, promised) = (vertex.name.clone(), Some((vertex.count, vertex.line)));
    let rows = Box::new(Vertices { element: vertex, order });
    Some(Layout { start: lines.offset(), encoding, element, promised, holds, rows })
}

/// The rows of a file with vertices only.
struct Vertices {
    element: Element,
    /// Byte order of binary numbers.
    order: Order,
}

impl Vertices {
    fn read<'a>(&self, source: &mut impl Source<'a>, row: &mut Row) -> Result<(), Fault> {
        let mut reader = Reader { row: *row, ..Reader::new(self.element.count) };
        let read = reader.read(&self.element, source);
        *row = reader.row;
        read
    }
}

impl Rows for Vertices {
    fn is_row(&self, line: &Line<'_>) -> bool {
        !line.text.trim_ascii().is_empty()
    }

    fn line(&self, line: Line<'_>, row: &mut Row) -> Result<(), Fault> {
        self.read(&mut Ascii::of_line(line), row)
    }

    fn record(&self, bytes: &[u8], row: &mut Row) {
        // Cannot fail: `bytes` holds the numbers of one vertex.
        let _ = self.read(&mut Binary::new(bytes, 0, self.order), row);
    }
}

/// Returns the number of vertices in the header, limited to those that fit into a file of this
/// length.
pub(crate) fn count(head: &[u8], length: u64) -> Option<u64> {
    let (header, lines) = header::parse(head).ok()?;
    let vertex = header.vertices().ok()?;
    let least = match header.encoding {
        Encoding::Ascii => Ascii::new(lines.clone()).least_size(vertex),
        Encoding::Binary(order) => Binary::new(&[], 0, order).least_size(vertex),
    };
    Some(vertex.count.min((length - lines.offset() as u64) / least as u64))
}

fn elements<'a>(header: &Header, source: &mut impl Source<'a>) -> Result<Sink, Broken> {
    let mut sink = Sink::default();
    let vertex = header.vertices()?;
    let holds = Holds::among(vertex.slots()).map_err(|fault| fault.on_line(vertex.line))?;
    let mut reader = Reader::new(vertex.count);
    // An element without properties takes no space, so its count cannot be checked.
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

/// The values of the element that is being read.
struct Reader {
    vertices: u64,
    row: Row,
    corners: Vec<f64>,
    strip: Vec<u32>,
}

impl Reader {
    fn new(vertices: u64) -> Self {
        Self { vertices, row: Row::default(), corners: Vec::new(), strip: Vec::new() }
    }

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

/// Converts a number of any PLY type to a vertex index. All PLY types are exact in double
/// precision.
fn index(value: f64) -> Result<i64, Fault> {
    if value.fract() != 0.0 {
        return Err(Fault::NotWhole { expected: "a vertex index", found: value.to_string().into() });
    }
    #[expect(clippy::cast_possible_truncation, reason = "saturates, and no vertex is that far out")]
    let index = value as i64;
    Ok(index)
}
