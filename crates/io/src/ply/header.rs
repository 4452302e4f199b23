//! The header of PLY: the elements, in file order, with their properties.

use crate::columns::{is_unique, slot};
use crate::error::{Broken, Fault};
use crate::scalar::{Order, Scalar};
use crate::text::{Lines, number, shown, whole, words};

pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    /// Number of the last line.
    line: u64,
}

#[derive(Clone, Copy)]
pub(super) enum Encoding {
    Ascii,
    Binary(Order),
}

pub(super) struct Element {
    pub(super) name: Box<str>,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
    pub(super) role: Role,
    /// Line that declares the element.
    pub(super) line: u64,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    Vertex,
    /// A polygon; some files have faces without corners.
    Face {
        corners: bool,
    },
    /// Triangle strips, separated by -1.
    Strips,
    Other,
}

pub(super) struct Property {
    pub(super) name: Box<str>,
    /// Type of the length, for a list.
    pub(super) list: Option<Scalar>,
    pub(super) scalar: Scalar,
    pub(super) part: Part,
}

/// The use of a property.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    Slot(usize),
    Corners,
    Nothing,
}

/// Parses the header. Returns it with an iterator over the lines after it.
pub(super) fn parse(bytes: &[u8]) -> Result<(Header, Lines<'_>), Broken> {
    let mut lines = Lines::new(bytes);
    let mut encoding = None;
    let mut elements = Vec::new();
    let first = lines.next().map(|line| line.text).unwrap_or_default();
    if first.trim_ascii() != b"ply" {
        if words(first).next().is_some_and(|word| number(word).is_some()) {
            return Err(Fault::NoHeader.on_line(1));
        }
        return Err(expected("`ply`", first).on_line(1));
    }
    loop {
        let Some(line) = lines.next() else {
            let keyword = "end_header";
            return Err(Fault::HeaderNeverEnds { keyword }.on_line(lines.number()));
        };
        let mut words = line.words();
        let mut next = || words.next().unwrap_or_default();
        match next() {
            b"end_header" => break,
            b"" | b"comment" | b"obj_info" => Ok(()),
            b"format" => format(next()).map(|e| encoding = Some(e)),
            b"element" => element(&mut elements, line.number, next(), next()),
            b"property" => property(elements.last_mut(), next),
            other => Err(expected("`element`, `property`, `comment` or `end_header`", other)),
        }
        .map_err(|fault| fault.on_line(line.number))?;
    }
    let line = lines.number();
    let what = "an encoding, such as `format ascii 1.0`,";
    let encoding = encoding.ok_or_else(|| Fault::Undeclared { what }.on_line(line))?;
    let header = Header { encoding, elements, line };
    Ok((header, lines))
}

impl Header {
    pub(super) fn vertices(&self) -> Result<&Element, Broken> {
        let what = "an element `vertex`";
        let undeclared = || Fault::Undeclared { what }.on_line(self.line);
        let vertex = self.elements.iter().find(|e| e.role == Role::Vertex);
        vertex.ok_or_else(undeclared)
    }
}

impl Element {
    /// Returns the slots of a row that the properties fill.
    pub(super) fn slots(&self) -> impl Iterator<Item = usize> {
        self.properties.iter().filter_map(|p| match p.part {
            Part::Slot(slot) => Some(slot),
            _ => None,
        })
    }
}

fn expected(expected: &'static str, found: &[u8]) -> Fault {
    let found = shown(found);
    Fault::Expected { expected, found }
}

fn format(word: &[u8]) -> Result<Encoding, Fault> {
    match word {
        b"ascii" => Ok(Encoding::Ascii),
        b"binary_little_endian" => Ok(Encoding::Binary(Order::Little)),
        b"binary_big_endian" => Ok(Encoding::Binary(Order::Big)),
        _ => Err(expected("`ascii`, `binary_little_endian` or `binary_big_endian`", word)),
    }
}

fn element(elements: &mut Vec<Element>, line: u64, name: &[u8], count: &[u8]) -> Result<(), Fault> {
    let role = match name {
        b"vertex" => Role::Vertex,
        b"face" => Role::Face { corners: false },
        b"tristrips" => Role::Strips,
        _ => Role::Other,
    };
    if role == Role::Vertex && elements.iter().any(|e| e.role == role) {
        return Err(Fault::Repeated { name: shown(name) });
    }
    elements.push(Element {
        name: shown(name),
        count: whole(count).ok_or_else(|| expected("the number of elements", count))?,
        properties: Vec::new(),
        role,
        line,
    });
    Ok(())
}

fn property<'a>(element: Option<&mut Element>, mut next: impl FnMut() -> &'a [u8]) -> Result<(), Fault> {
    let kind = next();
    let list = if kind == b"list" { Some(scalar(next())?) } else { None };
    let scalar = scalar(if list.is_some() { next() } else { kind })?;
    let name = next();
    let element = element.ok_or_else(|| expected("`element` before the first property", b"property"))?;
    let is_coordinate = element.role == Role::Vertex && slot(name).is_some_and(|slot| slot < 3);
    if list.is_some() && is_coordinate {
        return Err(expected("a number as coordinate, such as `property float x`", b"property list"));
    }
    let part = match (element.role, list, name) {
        (Role::Vertex, None, name) => slot(name)
            // Colours of other types have no agreed range.
            .filter(|&slot| !(6..9).contains(&slot) || scalar == Scalar::U8)
            .map_or(Part::Nothing, Part::Slot),
        (Role::Face { .. } | Role::Strips, Some(_), b"vertex_indices" | b"vertex_index") => Part::Corners,
        _ => Part::Nothing,
    };
    // At most a dozen properties pass the first test, so the search is cheap.
    let is_second = part != Part::Nothing && element.properties.iter().any(|p| p.part == part);
    let part = match part {
        Part::Slot(slot) if is_second && !is_unique(slot) => Part::Nothing,
        _ if is_second => return Err(Fault::Repeated { name: shown(name) }),
        part => part,
    };
    if let (Role::Face { corners }, Part::Corners) = (&mut element.role, part) {
        *corners = true;
    }
    element.properties.push(Property { name: shown(name), list, scalar, part });
    Ok(())
}

fn scalar(word: &[u8]) -> Result<Scalar, Fault> {
    Ok(match word {
        b"char" | b"int8" => Scalar::I8,
        b"uchar" | b"uint8" => Scalar::U8,
        b"short" | b"int16" => Scalar::I16,
        b"ushort" | b"uint16" => Scalar::U16,
        b"int" | b"int32" => Scalar::I32,
        b"uint" | b"uint32" => Scalar::U32,
        b"float" | b"float32" => Scalar::F32,
        b"double" | b"float64" => Scalar::F64,
        _ => {
            let types = "a type of property: char, uchar, short, ushort, int, uint, float, double, int8, uint8, \
                         int16, uint16, int32, uint32, float32 or float64";
            return Err(expected(types, word));
        }
    })
}
