//! The header of PCD: the fields of a point, the number of points, and their encoding.

use std::ops::Range;

use crate::columns::{Holds, is_unique, slot};
use crate::error::{Broken, Fault};
use crate::scalar::Scalar;
use crate::text::{Line, Lines, number, shown, whole};

pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) fields: Vec<Field>,
    pub(super) points: u64,
    pub(super) holds: Holds,
    /// Length of a point in binary files, in bytes; never 0.
    pub(super) stride: usize,
    /// Line that declares the number of points.
    pub(super) line: u64,
}

#[derive(Clone, Copy)]
pub(super) enum Encoding {
    Ascii,
    Binary,
    Compressed,
}

pub(super) struct Field {
    pub(super) name: Box<str>,
    /// Size of one value in bytes.
    pub(super) size: usize,
    /// Number of values per point.
    pub(super) count: usize,
    /// Offset from the start of a point, in bytes.
    pub(super) offset: usize,
    pub(super) part: Part,
}

/// The use of a field.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    Slot(usize, Scalar),
    /// A colour in the lower 24 of 32 bits.
    Packed(Scalar),
    Nothing,
}

impl Part {
    /// Returns the slots of a row that the field fills.
    fn slots(self) -> Range<usize> {
        match self {
            Self::Slot(slot, _) => slot..slot + 1,
            Self::Packed(_) => 6..9,
            Self::Nothing => 0..0,
        }
    }
}

/// The lines of the header read so far.
#[derive(Default)]
struct Declared<'a> {
    fields: Option<Line<'a>>,
    size: Option<Line<'a>>,
    kind: Option<Line<'a>>,
    count: Option<Line<'a>>,
    width: Option<(u64, u64)>,
    height: Option<(u64, u64)>,
    points: Option<(u64, u64)>,
}

/// Parses the header. Returns it with an iterator over the lines after it.
pub(super) fn parse(bytes: &[u8]) -> Result<(Header, Lines<'_>), Broken> {
    let mut lines = Lines::new(bytes);
    let mut declared = Declared::default();
    loop {
        let Some(line) = lines.next() else {
            let keyword = "DATA";
            return Err(Fault::HeaderNeverEnds { keyword }.on_line(lines.number()));
        };
        let mut words = line.words();
        let counted = |word: Option<&[u8]>| {
            let word = word.unwrap_or_default();
            let count = whole(word).ok_or_else(|| expected("a count", word).on_line(line.number))?;
            Ok(Some((count, line.number)))
        };
        match words.next().unwrap_or_default() {
            b"" | b"VERSION" | b"VIEWPOINT" => {}
            comment if comment.starts_with(b"#") => {}
            b"FIELDS" | b"COLUMNS" => declared.fields = Some(line),
            b"SIZE" => declared.size = Some(line),
            b"TYPE" => declared.kind = Some(line),
            b"COUNT" => declared.count = Some(line),
            b"WIDTH" => declared.width = counted(words.next())?,
            b"HEIGHT" => declared.height = counted(words.next())?,
            b"POINTS" => declared.points = counted(words.next())?,
            b"DATA" => {
                let encoding = encoding(words.next().unwrap_or_default());
                let encoding = encoding.map_err(|fault| fault.on_line(line.number))?;
                return Ok((declared.header(encoding, line.number)?, lines));
            }
            other if declared.is_empty() && number(other).is_some() => {
                return Err(Fault::NoHeader.on_line(line.number));
            }
            other => {
                let header = "a line of a PCD header, such as `FIELDS x y z` or `DATA ascii`";
                return Err(expected(header, other).on_line(line.number));
            }
        }
    }
}

fn expected(expected: &'static str, found: &[u8]) -> Fault {
    let found = shown(found);
    Fault::Expected { expected, found }
}

fn encoding(word: &[u8]) -> Result<Encoding, Fault> {
    match word {
        b"ascii" => Ok(Encoding::Ascii),
        b"binary" => Ok(Encoding::Binary),
        b"binary_compressed" => Ok(Encoding::Compressed),
        _ => Err(expected("`ascii`, `binary` or `binary_compressed`", word)),
    }
}

impl Declared<'_> {
    fn is_empty(&self) -> bool {
        self.fields.is_none() && self.size.is_none() && self.points.is_none()
    }

    fn header(&self, encoding: Encoding, last: u64) -> Result<Header, Broken> {
        let undeclared = |what| Fault::Undeclared { what }.on_line(last);
        let names = self.fields.ok_or_else(|| undeclared("fields, such as `FIELDS x y z`,"))?;
        let sizes = self.size.ok_or_else(|| undeclared("sizes, such as `SIZE 4 4 4`,"))?;
        let kinds = self.kind.ok_or_else(|| undeclared("types, such as `TYPE F F F`,"))?;
        let (points, line) = self.points(last)?;
        let fields = fields(names, sizes, kinds, self.count)?;
        let slots = fields.iter().flat_map(|field| field.part.slots());
        let holds = Holds::among(slots).map_err(|fault| fault.on_line(names.number))?;
        // Cannot overflow, as `fields` has checked the sum, and is not 0, as coordinates have a
        // size.
        let stride = fields.last().map_or(1, |f| f.offset + f.size * f.count);
        Ok(Header { encoding, fields, points, holds, stride, line })
    }

    /// Returns the number of points and the line that declares it.
    fn points(&self, last: u64) -> Result<(u64, u64), Broken> {
        let height = self.height.map_or(1, |(height, _)| height);
        match (self.width, self.points) {
            (None, Some(points)) => Ok(points),
            (Some((width, line)), points) => {
                let (points, line) = points.unwrap_or((width.saturating_mul(height), line));
                if width.checked_mul(height) == Some(points) {
                    return Ok((points, line));
                }
                let grid = Fault::Grid { width, height, points };
                Err(grid.on_line(line))
            }
            (None, None) => {
                let what = "the number of points, `POINTS`,";
                Err(Fault::Undeclared { what }.on_line(last))
            }
        }
    }
}

/// Combines the four lines, entry by entry.
fn fields(
    names: Line<'_>,
    sizes: Line<'_>,
    kinds: Line<'_>,
    counts: Option<Line<'_>>,
) -> Result<Vec<Field>, Broken> {
    let entries = |line: Line<'_>| line.words().count() - 1;
    let number = entries(names);
    for (keyword, line) in [("SIZE", Some(sizes)), ("TYPE", Some(kinds)), ("COUNT", counts)] {
        if let Some(line) = line.filter(|&line| entries(line) != number) {
            let wrong = Fault::FieldEntries { keyword, entries: entries(line), fields: number };
            return Err(wrong.on_line(line.number));
        }
    }
    let count_or_one =
        counts.into_iter().flat_map(|line| line.words().skip(1)).map(Some).chain(std::iter::repeat(None));
    let mut fields: Vec<Field> = Vec::new();
    let mut offset = 0_usize;
    let each = names.words().zip(kinds.words()).zip(sizes.words()).skip(1);
    for (((name, kind), size_word), count_word) in each.zip(count_or_one) {
        let size: usize = whole(size_word)
            .ok_or_else(|| expected("the size of a field in bytes", size_word).on_line(sizes.number))?;
        let count: usize = match (count_word, counts) {
            (Some(word), Some(line)) => whole(word)
                .ok_or_else(|| expected("the number of values of a field", word).on_line(line.number))?,
            _ => 1,
        };
        let part = part(name, kind, size, count).map_err(|fault| fault.on_line(kinds.number))?;
        // At most a dozen fields pass the first test, so the search is cheap.
        let is_second = part != Part::Nothing && fields.iter().any(|f| f.part.slots() == part.slots());
        let part = match part {
            Part::Slot(slot, _) if is_second && !is_unique(slot) => Part::Nothing,
            _ if is_second => return Err(Fault::Repeated { name: shown(name) }.on_line(names.number)),
            part => part,
        };
        let end = size.checked_mul(count).and_then(|bytes| offset.checked_add(bytes));
        let end = end.filter(|&end| end <= isize::MAX.cast_unsigned());
        fields.push(Field { name: shown(name), size, count, offset, part });
        let too_long = || expected("points shorter than 2^63 bytes", size_word).on_line(sizes.number);
        offset = end.ok_or_else(too_long)?;
    }
    Ok(fields)
}

fn part(name: &[u8], kind: &[u8], size: usize, count: usize) -> Result<Part, Fault> {
    let is_packed = name.eq_ignore_ascii_case(b"rgb") || name.eq_ignore_ascii_case(b"rgba");
    let slot = slot(name);
    if count != 1 || (slot.is_none() && !is_packed) {
        return Ok(Part::Nothing);
    }
    let scalar = match (kind, size) {
        (b"F", 4) => Scalar::F32,
        (b"F", 8) => Scalar::F64,
        (b"I", 1) => Scalar::I8,
        (b"I", 2) => Scalar::I16,
        (b"I", 4) => Scalar::I32,
        (b"I", 8) => Scalar::I64,
        (b"U", 1) => Scalar::U8,
        (b"U", 2) => Scalar::U16,
        (b"U", 4) => Scalar::U32,
        (b"U", 8) => Scalar::U64,
        _ => {
            return Err(Fault::FieldType { field: shown(name), kind: shown(kind), size: size as u64 });
        }
    };
    Ok(match slot {
        // Separate colours of other types have no agreed range.
        Some(slot) if !(6..9).contains(&slot) || scalar == Scalar::U8 => Part::Slot(slot, scalar),
        None if size == 4 => Part::Packed(scalar),
        _ => Part::Nothing,
    })
}

impl Header {
    /// Returns the number of points, limited to `fit`.
    pub(super) fn capacity(&self, fit: usize) -> usize {
        usize::try_from(self.points).unwrap_or(usize::MAX).min(fit)
    }

    /// Returns the fault of a file that contains only `present` points.
    pub(super) fn promised(&self, present: u64) -> Broken {
        let promised = Fault::Promised { element: "point".into(), promised: self.points, present };
        promised.on_line(self.line)
    }
}
